"""The energies of all equilibria, and beside each its state along Γc."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, MaxNLocator

from ..reader import EquilibriaResult, Row
from ..units import number, unit_for
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, VERMILION, figure, titled

NAME = "equilibria.png"
MOST = 16
"""Equilibria in the picture, those of lowest energy."""
CAPTION = (
    "The equilibria that were found, the lowest at the top. Left: the energy above the lowest found. Right: the state "
    "of each along the contact parts, vertex by vertex."
)
_PIECES = (BLUE, ORANGE, GREEN, PURPLE)
_KINDS, _OTHER = {"minimiser": ("o", INK), "saddle": ("^", "white")}, ("s", "white")
"""The mark of each kind of equilibrium, and its face."""


def make(result: EquilibriaResult) -> Figure:
    """The picture.

    Args:
        result: the search; it found something.
    """
    rows = result.rows[:MOST]
    states = [result.state(row) for row in rows]
    fig = figure(1.8 + 0.62 * len(rows))
    titled(fig, result.title, *_subject(result, len(rows)))
    energies, strips = fig.subplots(1, 2, width_ratios=(2, 3))
    _energies(energies, result, rows)
    _strips(strips, rows, states)
    _legend(fig, sorted({row["kind"] for row in rows}), states)
    return fig


def _subject(result: EquilibriaResult, shown: int) -> tuple[str, str, str]:
    known, count = result.known, len(result.rows)
    below = f"{count} equilibria" if count != 1 else "one equilibrium"
    below += f", the {shown} lowest shown" if shown < count else ""
    if known["complete"]:
        return below, "✓ all, proven", GREEN
    return (below, "✓ the lowest, proven", GREEN) if known["proven"] else (below, "there may be others", INK)


def _energies(axes: Axes, result: EquilibriaResult, rows: Sequence[Row]) -> None:
    values = np.array(result.energies[: len(rows)]) - result.energies[0]
    unit = unit_for(float(values[-1]), result.unit)
    values = np.asarray(values / unit.size)
    for i, (row, value) in enumerate(zip(rows, values, strict=True)):
        mark, face = _KINDS.get(row["kind"], _OTHER)
        axes.plot(value, i, mark, color=INK, mfc=face, ms=9, clip_on=False)
    spread = float(values[-1]) or 1.0
    axes.set_xlim(-0.06 * spread, 1.06 * spread)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), [row["index"] for row in rows])
    axes.xaxis.set_major_locator(MaxNLocator(2) if spread != 1.0 or values[-1] else FixedLocator([0.0]))
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"{unit.name} above the lowest found,\n{number(result.energies[0])} {result.unit}")


def _strips(axes: Axes, rows: Sequence[Row], states: Sequence[Sequence[Row]]) -> None:
    """A strip for each equilibrium: the piece of the law at each vertex, and a line below where it has lifted off."""
    longest = max(map(len, states))
    for i, (row, vertices) in enumerate(zip(rows, states, strict=True)):
        colours = np.array([[to_rgb(_colour(v)) for v in vertices]])
        axes.imshow(colours, extent=(-0.5, len(vertices) - 0.5, i + 0.26, i - 0.26), aspect="auto", zorder=1)
        edges = np.arange(len(vertices) - 1) + 0.5
        axes.vlines(edges, i - 0.26, i + 0.26, color="white", lw=0.8 if longest < 80 else 0.2)
        lifted = np.flatnonzero([_is_lifted(vertex) for vertex in vertices])
        axes.hlines(np.full(len(lifted), i + 0.34), lifted - 0.5, lifted + 0.5, color=INK, lw=3.0)
        words = f"{row['kind']}, {row['broken']} broken"
        axes.text(0.0, i - 0.3, words, transform=axes.get_yaxis_transform(), va="bottom", size=10, color=GREY)
    axes.set_xlim(-0.5, longest - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks([])
    axes.spines[["left"]].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("vertex along the contact parts")


def _is_lifted(vertex: Row) -> bool:
    return vertex["contact"] in ("0", "false", "False")


def _branch(vertex: Row) -> str:
    """The piece that the laws of a vertex are on: of two laws the later one, or the kink that one of them is on."""
    found = [vertex[column] for column in ("branch_t", "branch_n") if vertex[column]]
    return "-1" if "-1" in found else max(found, key=int, default="")


def _colour(vertex: Row) -> str:
    branch = _branch(vertex)
    if not branch:
        return PALE
    return VERMILION if branch == "-1" else _PIECES[int(branch) % len(_PIECES)]


def _legend(fig: Figure, kinds: Sequence[str], states: Sequence[Sequence[Row]]) -> None:
    found = sorted({_branch(v) for vertices in states for v in vertices} - {"", "-1"}, key=int)
    marks = {kind: _KINDS.get(kind, _OTHER) for kind in kinds}
    handles: list[Patch | Line2D] = [
        Line2D([], [], marker=mark, color=INK, mfc=face, ls="", label=kind) for kind, (mark, face) in marks.items()
    ]
    handles += [Patch(color=_PIECES[int(b) % len(_PIECES)], label=f"piece {int(b) + 1} of the law") for b in found[:4]]
    if any(_branch(v) == "-1" for vertices in states for v in vertices):
        handles.append(Patch(color=VERMILION, label="on a kink or drop"))
    if any(_is_lifted(v) for vertices in states for v in vertices):
        handles.append(Line2D([], [], color=INK, lw=3.0, label="lifted off"))
    fig.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=10, handlelength=1.2)
