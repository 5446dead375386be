"""``path.png``: the force over the displacement of the driven part, stable and unstable stretches, jumps and events."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWN

from ...typing import Array, Mask
from ..reader import PathResult
from ..units import Unit, number, unit_for
from .style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, figure, titled

NAME = "path.png"
CAPTION = (
    "The load path: force (under a moment the load factor) over mean displacement of the driven part. Solid: stable; "
    "dashed: unstable, which a test cannot hold; dotted: jumps; dots: events on the way, some where they are many."
)
_DOTS = 40
"""So many events have a dot at most."""


def make(result: PathResult) -> Figure:
    """The picture.

    Args:
        result: the path; a part of it is driven.
    """
    assert result.driven is not None
    u, force = result.along(result.driven)
    pulled = bool(np.any(force))
    load = force if pulled else result.columns["factor"]
    units = unit_for(float(np.max(np.abs(u))), "m"), _unit(result, load) if pulled else Unit(1.0, "")
    fig = figure(5.8)
    titled(fig, result.title, _subject(result), *_verdict(result))
    axes = fig.add_subplot()
    x, y = np.asarray(u / units[0].size), np.asarray(load / units[1].size)
    _stretches(axes, result, x, y)
    _marks(axes, result, x, y, units)
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=0)
    direction = " along its force" if pulled else ""
    axes.set_xlabel(f"mean displacement of “{result.driven}”{direction} ({units[0].name})")
    axes.set_ylabel(f"force on “{result.driven}” ({units[1].name})" if pulled else "load factor")
    axes.margins(0.06, 0.10)
    fig.legend(loc="outside lower center", ncols=4, fontsize=11, handlelength=1.6, columnspacing=0.9)
    return fig


def _unit(result: PathResult, force: Array) -> Unit:
    return unit_for(float(np.max(np.abs(force))), "N" if len(result.axes) == 3 else "N/m")


def _subject(result: PathResult) -> str:
    path = result.path
    return f"load path · largest factor {path['peak_factor']:.5g} · {_events(path['events'] + path['folds'])}"


def _events(count: int) -> str:
    return "1 event" if count == 1 else f"{count} events"


def _verdict(result: PathResult) -> tuple[str, str]:
    path = result.path
    if path["uncertified"]:
        return f"✗ {path['uncertified']} rows NOT certified", VERMILION
    words = {"reached": "✓ certified to its end", "escapes": "✓ certified, then it comes off"}
    return (words[path["end"]], GREEN) if path["end"] in words else (f"✗ {path['end']}", VERMILION)


def _stretches(axes: Axes, result: PathResult, x: Array, y: Array) -> None:
    """The curve, each kind of it as one line that has gaps."""
    jump = np.array([event == "jump" for event in result.events[1:]], dtype=bool)
    stable = result.stable[:-1] & ~jump
    kinds: tuple[tuple[Mask, str, dict[str, Any]], ...] = (
        (stable, "stable", {"color": BLUE, "ls": "-", "lw": 2.4, "zorder": 3}),
        (~stable & ~jump, "unstable", {"color": VERMILION, "ls": (0, (4, 2)), "lw": 1.5, "zorder": 2}),
        (jump, "jump", {"color": GREY, "ls": ":", "lw": 2.2, "zorder": 2}),
    )
    for kind, name, look in kinds:
        if np.any(kind):
            axes.plot(*_with_gaps(x, y, kind), label=name, **look)


def _with_gaps(x: Array, y: Array, chosen: Mask) -> tuple[Array, Array]:
    """The chosen stretches between neighbouring rows, others left out."""
    points = np.column_stack([x, y])
    parts = [np.vstack([points[at : at + 2], [[np.nan, np.nan]]]) for at in np.flatnonzero(chosen)]
    joined = np.vstack(parts)
    return joined[:, 0], joined[:, 1]


def _marks(axes: Axes, result: PathResult, x: Array, y: Array, units: tuple[Unit, Unit]) -> None:
    """Events as dots, the largest force, turns and the end by name."""
    events = np.flatnonzero([e in ("kink", "contact", "release", "fold") for e in result.events])
    shown = events[:: max(1, -(-len(events) // _DOTS))]
    if len(shown):
        axes.plot(x[shown], y[shown], "o", color=INK, ms=3.4, alpha=0.8, mew=0, zorder=4, label="event")
    look: dict[str, Any] = {"ls": "", "ms": 9, "mec": "white", "mew": 0.8, "zorder": 6}
    peak = int(np.argmax(y))
    load = f"{number(y[peak], 4)} {units[1].name}".rstrip()
    words = f"peak {load} at {number(x[peak], 4)} {units[0].name}"
    axes.plot(x[peak], y[peak], marker=CARETDOWN, color=PURPLE, label=words, **{**look, "ms": 12})
    for row, marker, colour, text in _named(result):
        axes.plot(x[row], y[row], marker=marker, color=colour, label=text, **look)


def _named(result: PathResult) -> Iterator[tuple[int, str, str, str | None]]:
    """Turns and the end: row, mark, colour and words."""
    for count, row in enumerate(n for n, event in enumerate(result.events) if event == "turn"):
        yield row, "s", INK, None if count else "turn"
    if result.path["end"] != "reached":
        yield len(result.events) - 1, "X", VERMILION, str(result.path["end"])
