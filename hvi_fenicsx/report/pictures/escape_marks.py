"""What a picture of an escaping body says: arrows along the motion, and the motion in words."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.path import Path as DrawnPath

from ...typing import Array
from ..reader import Result
from .legend import FOOT, legend
from .style import GREY, INK, PALE, VERMILION, WIDTH

WAY = np.linspace(0.0, 1.0, 25)
"""Parts of the motion at which a point's way is drawn."""


def arrow(axes: Axes, way: Array) -> None:
    """Draw an arrow.

    Args:
        axes: to draw on.
        way: the points along it, (n, 2).
    """
    drawn = FancyArrowPatch(
        path=DrawnPath(way), arrowstyle="-|>,head_length=9,head_width=5", color=VERMILION, lw=3.2, zorder=7, shrinkB=0
    )
    drawn.set_clip_on(False)
    axes.add_patch(drawn)


def keys(stretched: str = "") -> list[Artist]:
    """The legend's lines for the two bodies.

    Args:
        stretched: how the picture is stretched, in words.
    """
    ghost = Patch(fc="#fbe3d3", ec=VERMILION, ls="--", label="its ghost, on its way")
    words = f"the body at rest, {stretched}" if stretched else "the body at rest"
    return [Patch(fc=PALE, ec=INK, label=words), ghost]


def say(fig: Figure, result: Result, keys: list[Artist]) -> None:
    """Write the motion in words, and what the marks mean.

    Args:
        fig: the picture.
        result: whose body escapes.
        keys: the lines of the legend.
    """
    words = str(result.solvability.get("direction") or "a rigid motion").replace("-", "−")
    tall = fig.get_figheight()
    fig.text(0.3 / WIDTH, (FOOT - 0.28) / tall, "The load moves the body by", size=12.5, color=GREY, va="top")
    lines, size = textwrap.wrap(words, 27), 16.0
    if len(lines) > 2:
        lines, size = textwrap.wrap(words, 40), 11.5
    fig.text(0.3 / WIDTH, (FOOT - 0.56) / tall, "\n".join(lines), size=size, weight="bold", color=VERMILION, va="top")
    legend(fig, keys)
