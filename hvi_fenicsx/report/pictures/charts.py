"""The charts of a load path and of a search of all equilibria.

``path.png``: the force over the displacement of the driven part, stable and unstable stretches, jumps and events;
``equilibria.png``: the energies of all equilibria, and beside each its state along Γc.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWN
from matplotlib.ticker import MaxNLocator

from ...typing import Array, Mask, magnitude
from ..reader import EquilibriaResult, PathResult, Row
from ..units import Unit, number, unit_for
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, VERMILION, few_ticks, figure, titled

PATH_CAPTION = (
    "The load path: force (under a moment the load factor) over mean displacement of the driven part. Solid: stable; "
    "dashed: unstable, which a test cannot hold; dotted: jumps; dots: events on the way, some where they are many."
)
MOST = 16
"""Equilibria in the picture, those of lowest energy."""
EQUILIBRIA_CAPTION = (
    "The equilibria that were found, the lowest at the top. Left: the energy above the lowest found. Right: the state "
    "of each along the contact parts, vertex by vertex."
)
_PIECES = (BLUE, ORANGE, GREEN, PURPLE)
_BESIDE = {-1: (VERMILION, "on a kink or drop"), -2: (PALE, "without a law")}
"""What is on no piece of a law: its colour and its words."""
_KINDS, _OTHER = {"minimiser": ("o", INK), "saddle": ("^", "white")}, ("s", "white")
"""The mark of each kind of equilibrium, and its face."""


def path_chart(result: PathResult) -> Figure:
    """The picture of a load path.

    Args:
        result: the path; a part of it is driven.
    """
    assert result.driven is not None
    u, force = result.along(result.driven)
    pulled, name = bool(np.any(force)), "N" if len(result.axes) == 3 else "N/m"
    load = force if pulled else result.columns["factor"]
    units = [unit_for(magnitude(u), "m"), unit_for(magnitude(load), name) if pulled else Unit(1.0, "")]
    fig = figure(5.8)
    titled(fig, result.title, _path_subject(result), *_path_verdict(result))
    axes = fig.add_subplot()
    x, y = u / units[0].size, load / units[1].size
    _stretches(axes, result, x, y)
    _marks(axes, result, x, y, units)
    axes.axhline(0.0, color=GREY, lw=0.8, zorder=0)
    direction = " along its force" if pulled else ""
    axes.set_xlabel(f"mean displacement of “{result.driven}”{direction} ({units[0].name})")
    axes.set_ylabel(f"force on “{result.driven}” ({units[1].name})" if pulled else "load factor")
    axes.margins(0.06, 0.10)
    fig.legend(loc="outside lower center", ncols=4, fontsize=11, handlelength=1.6, columnspacing=0.9)
    return fig


def _path_subject(result: PathResult) -> str:
    count = result.path["events"] + result.path["folds"]
    events = "1 event" if count == 1 else f"{count} events"
    return f"load path · largest factor {result.path['peak_factor']:.5g} · {events}"


def _path_verdict(result: PathResult) -> tuple[str, str]:
    path = result.path
    if path["uncertified"]:
        return f"✗ {path['uncertified']} rows NOT certified", VERMILION
    words = {"reached": "✓ certified to its end", "escapes": "✓ certified, then it comes off"}
    return (words[path["end"]], GREEN) if path["end"] in words else (f"✗ {path['end']}", VERMILION)


def _stretches(axes: Axes, result: PathResult, x: Array, y: Array) -> None:
    """The curve, each kind of it in its own look."""
    jump = np.array([event == "jump" for event in result.events[1:]], dtype=bool)
    stable, points = result.stable[:-1] & ~jump, np.column_stack([x, y])

    def draw(kind: Mask, **look: Any) -> None:
        if np.any(kind):
            pieces = list(np.stack([points[:-1], points[1:]], axis=1)[kind])
            axes.add_collection(LineCollection(pieces, **look))

    draw(stable, label="stable", color=BLUE, ls="-", lw=2.4, zorder=3)
    draw(~stable & ~jump, label="unstable", color=VERMILION, ls=(0, (4, 2)), lw=1.5, zorder=2)
    draw(jump, label="jump", color=GREY, ls=":", lw=2.2, zorder=2)


def _marks(axes: Axes, result: PathResult, x: Array, y: Array, units: Sequence[Unit]) -> None:
    """Events as dots, the largest force, turns and the end by name."""
    events = np.array(result.events)
    dots = np.flatnonzero(np.isin(events, ("kink", "contact", "release", "fold")))
    look: dict[str, Any] = {"ls": "", "ms": 9, "mec": "white", "mew": 0.8, "zorder": 6}
    peak, end = int(np.argmax(y)), str(result.path["end"])
    load = f"{number(y[peak], 4)} {units[1].name}".rstrip()
    words = f"peak {load} at {number(x[peak], 4)} {units[0].name}"
    axes.plot(x[peak], y[peak], marker=CARETDOWN, color=PURPLE, label=words, **{**look, "ms": 12})
    if len(dots):
        small = {**look, "ms": 3.4, "mew": 0, "zorder": 4}
        axes.plot(x[dots], y[dots], marker="o", color=INK, alpha=0.8, markevery=0.02, label="event", **small)
    if len(turns := np.flatnonzero(events == "turn")):
        axes.plot(x[turns], y[turns], marker="s", color=INK, label="turn", **look)
    if end != "reached":
        axes.plot(x[-1], y[-1], marker="X", color=VERMILION, label=end, **look)


def equilibria_chart(result: EquilibriaResult) -> Figure:
    """The picture of a search.

    Args:
        result: the search; it found something.
    """
    rows = result.rows[:MOST]
    fig = figure(1.8 + 0.62 * len(rows))
    titled(fig, result.title, *_search_subject(result, len(rows)))
    energies, strips = fig.subplots(1, 2, width_ratios=(2, 3))
    _energies(energies, result, rows)
    _strips(strips, rows, [result.state(row) for row in rows])
    fig.legend(loc="outside lower center", ncols=4, fontsize=10, handlelength=1.2)
    return fig


def _search_subject(result: EquilibriaResult, shown: int) -> tuple[str, str, str]:
    known, count = result.known, len(result.rows)
    below = f"{count} equilibria" if count != 1 else "one equilibrium"
    below += f", the {shown} lowest shown" if shown < count else ""
    if known["complete"]:
        return below, "✓ all, proven", GREEN
    return (below, "✓ the lowest, proven", GREEN) if known["proven"] else (below, "there may be others", INK)


def _energies(axes: Axes, result: EquilibriaResult, rows: Sequence[Row]) -> None:
    values = np.array(result.energies[: len(rows)]) - result.energies[0]
    unit = unit_for(float(values[-1]), result.unit)
    values /= unit.size
    kinds = np.array([row["kind"] for row in rows])
    for kind in np.unique(kinds).tolist():
        (mark, face), own = _KINDS.get(kind, _OTHER), np.flatnonzero(kinds == kind)
        axes.plot(values[own], own, mark, color=INK, mfc=face, ms=9, clip_on=False, label=kind)
    spread = float(values[-1]) or 1.0
    axes.set(xlim=(-0.06 * spread, 1.06 * spread), ylim=(len(rows) - 0.5, -0.5))
    axes.set_yticks(range(len(rows)), [row["index"] for row in rows])
    few_ticks(axes, "x", 2)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"{unit.name} above the lowest found,\n{number(result.energies[0])} {result.unit}")


def _strips(axes: Axes, rows: Sequence[Row], states: Sequence[Sequence[Row]]) -> None:
    """A strip for each equilibrium: the piece of the law at each vertex, and a line below where it has lifted off."""
    longest = max(map(len, states))
    vertices = [(i, at, vertex) for i, state in enumerate(states) for at, vertex in enumerate(state)]
    y, x = (np.array([vertex[k] for vertex in vertices]) for k in (0, 1))
    pieces = np.array([_piece(vertex) for *_, vertex in vertices])
    for piece in np.unique(pieces).tolist():
        own, plain = pieces == piece, (_PIECES[piece % len(_PIECES)], f"piece {piece + 1} of the law")
        colour, words = _BESIDE.get(piece, plain)
        width = 0.8 if longest < 80 else 0.2
        axes.bar(x[own], 0.52, 1.0, y[own] - 0.26, color=colour, ec="white", lw=width, label=words)
    if any(off := [vertex["contact"] == "0" for *_, vertex in vertices]):
        axes.hlines(y[off] + 0.34, x[off] - 0.5, x[off] + 0.5, color=INK, lw=3.0, label="lifted off")
    for i, row in enumerate(rows):
        words = f"{row['kind']}, {row['broken']} broken"
        axes.text(0.0, i - 0.3, words, transform=axes.get_yaxis_transform(), va="bottom", size=10, color=GREY)
    axes.set(xlim=(-0.5, longest - 0.5), ylim=(len(rows) - 0.5, -0.5), yticks=[])
    axes.set_xlabel("vertex along the contact parts")
    axes.spines[["left"]].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _piece(vertex: Row) -> int:
    """The piece that the laws of a vertex are on: of two laws the later one, or the kink that one of them is on."""
    found = [int(vertex[column]) for column in ("branch_t", "branch_n") if vertex[column]]
    return -1 if -1 in found else max(found, default=-2)
