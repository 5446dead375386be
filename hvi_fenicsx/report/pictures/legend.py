"""The foot of a picture of a body: a colour bar on the left, what the marks mean on the right."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, Locator, MaxNLocator

from .style import GREY, WIDTH, area

FOOT = 1.55
"""Height of the foot, inches."""
STEPS = (1, 2, 2.5, 5, 10)
"""Between ticks, times a power of ten."""
_BAR, _START = 3.2, 0.42
_LETTERS = 66.0
"""Points: the largest size of letters times the number of lines that fit in the foot."""


def colour_bar(
    fig: Figure, colours: Colormap, scale: tuple[float, float], words: str, remark: str = "", *, at: float = 0.0
) -> None:
    """Draw the bar of a scale.

    Args:
        fig: the picture.
        colours: of the scale.
        scale: its lowest and its largest value.
        words: above the bar.
        remark: below it.
        at: how far to the right of its usual place, inches.
    """
    axes = area(fig, _START + at, 0.82, _BAR, 0.2)
    low, high = scale if scale[1] > scale[0] else (0.0, 1.0)
    axes.imshow(np.linspace(0, 1, 256)[None], cmap=colours, aspect="auto", extent=(low, high, 0.0, 1.0))
    axes.yaxis.set_visible(False)
    axes.xaxis.set_major_locator(ticks(scale, 4))
    axes.tick_params(labelsize=12)
    axes.set_title(words, loc="left", size=12.5)
    for spine in axes.spines.values():
        spine.set_visible(False)
    fig.text((_START + at) / WIDTH, 0.2 / fig.get_figheight(), remark, size=12.5, weight="bold", color=GREY)


def ticks(scale: tuple[float, float], intervals: int) -> Locator:
    """Where the bar of a scale has numbers; of one that has no length at its only value.

    Args:
        scale: its lowest and its largest value.
        intervals: between the numbers, at most.
    """
    return MaxNLocator(intervals, steps=STEPS) if scale[1] > scale[0] else FixedLocator([scale[0]])


def legend(fig: Figure, keys: Sequence[Artist]) -> None:
    """Write what the marks mean, one in a line.

    Args:
        fig: the picture.
        keys: the lines.
    """
    lines = sum(str(key.get_label()).count("\n") + 1 for key in keys)
    fig.legend(
        handles=list(keys),
        loc="center left",
        bbox_to_anchor=(4.05 / WIDTH, 0.74 / fig.get_figheight()),
        frameon=False,
        fontsize=min(12.0, _LETTERS / max(lines, 1)),
        handlelength=1.8,
        labelspacing=0.38,
        borderpad=0.0,
    )
