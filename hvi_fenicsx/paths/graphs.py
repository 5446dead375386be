"""Traction graphs of laws as bonds feel them: turned round, in other units, and with a memory of what was passed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..laws import PolylineLaw, Superpotential, TractionGraph
from ..laws.base import ScaledLaw
from ..laws.smoothing import PlusSmoothedLaw
from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Mask


def graph_of(law: Superpotential) -> TractionGraph | None:
    """The traction graph of a law; None where the traction is not piecewise linear. A smoothed one may have one."""
    if isinstance(law, PolylineLaw | PlusSmoothedLaw):
        return law.graph
    inner = graph_of(law.law) if isinstance(law, ScaledLaw) else None
    if inner is None or not isinstance(law, ScaledLaw):
        return None
    length, traction = law.length, law.traction
    breaks, slopes = inner.breaks / length, inner.slopes * (length / traction)
    parts = (breaks, inner.left / traction, inner.right / traction, slopes)
    return TractionGraph(*(np.asarray(part, dtype=np.float64) for part in parts))


def is_straight(problem: CondensedProblem) -> bool:
    """Whether all equilibria form a piecewise linear curve: each law acts on one unknown and has a graph."""
    return all(not b.radial and graph_of(b.law) is not None for b in problem.bonds)


def turned(graph: TractionGraph) -> TractionGraph:
    """The graph of a law that acts on -x: its force along x."""
    return TractionGraph(-graph.breaks[::-1], -graph.right[::-1], -graph.left[::-1], graph.slopes[::-1])


@dataclass(frozen=True, kw_only=True)
class Passed:
    """What one bond with memory remembers: on either side the greatest displacement, and the traction it had there.

    Attributes:
        displacements: least and greatest, (2,); ≤ 0 and ≥ 0.
        tractions: there, (2,).
    """

    displacements: tuple[float, float] = (0.0, 0.0)
    tractions: tuple[float, float] = (0.0, 0.0)

    @property
    def row(self) -> list[float]:
        """All four numbers, as states of a path keep them."""
        return [*self.displacements, *self.tractions]

    @classmethod
    def of(cls, row: Array) -> Passed:
        """The same from its row, (4,)."""
        low, high, low_traction, high_traction = map(float, row)
        return cls(displacements=(low, high), tractions=(low_traction, high_traction))

    def reached(self, x: float, traction: float, *, even: bool) -> Passed:
        """The memory after a greater displacement.

        Args:
            x: the displacement.
            traction: of the bond.
            even: whether both sides are one (|x|).
        """
        ends, tractions = list(self.displacements), list(self.tractions)
        side = int(x > 0.0)
        if abs(x) >= abs(ends[side]) * (1.0 - 1e-12):
            x = ends[side] if abs(x - ends[side]) <= 1e-12 * abs(x) else x
            ends[side], tractions[side] = x, traction
            if even:
                ends[1 - side], tractions[1 - side] = -x, -traction
        return Passed(displacements=(ends[0], ends[1]), tractions=(tractions[0], tractions[1]))


def on_corner(graph: TractionGraph, x: float, traction: float, rounding: float = 1e-12) -> tuple[float, float]:
    """A point of a graph; where it is an end of a piece or jump but for rounding, that end.

    Args:
        graph: the graph.
        x: displacement.
        traction: there.
        rounding: relative.
    """
    nearest = float(graph.breaks[np.argmin(np.abs(graph.breaks - x))])
    if abs(nearest - x) > rounding * abs(x):
        return x, traction
    ends = (_limit(graph, nearest, "left"), _limit(graph, nearest, "right"))
    size = float(np.max(np.abs([graph.left, graph.right])))  # where a bond is broken, both ends are zero
    return nearest, next((end for end in ends if abs(end - traction) <= rounding * size), traction)


def was_passed(x: Array, low: float | Array, high: float | Array, side: str) -> Mask:
    """Whether the limit of a traction from a side is taken where a bond has been, (m,).

    Args:
        x: coordinates, (m,).
        low: the least coordinate so far, 0 at first.
        high: the greatest, likewise.
        side: "left" or "right".
    """
    return np.asarray((x > low) & (x <= high) if side == "left" else (x >= low) & (x < high))


def remembering(graph: TractionGraph, passed: Passed) -> TractionGraph:
    """The graph of a bond that has been so far: secants up to there, the law beyond.

    Args:
        graph: of the law.
        passed: how far the bond has been.
    """
    (low, high), (low_traction, high_traction) = passed.displacements, passed.tractions
    rows = _rows(graph, graph.breaks < low)
    if low:
        rows.append((low, _limit(graph, low, "left"), low_traction))
    left, right = (0.0 if low else _limit(graph, 0.0, "left")), (0.0 if high else _limit(graph, 0.0, "right"))
    rows.append((0.0, left, right))
    if high:
        rows.append((high, high_traction, _limit(graph, high, "right")))
    table = np.array(rows + _rows(graph, graph.breaks > high))
    secants = [(x, t / x if x else 0.0) for x, t in ((low, low_traction), (high, high_traction))]
    return TractionGraph(table[:, 0], table[:, 1], table[:, 2], _slopes(graph, table[:, 0], secants[0], secants[1]))


def _rows(graph: TractionGraph, chosen: Mask) -> list[tuple[float, float, float]]:
    """Breaks with the limits on either side."""
    parts = (graph.breaks[chosen], graph.left[chosen], graph.right[chosen])
    return [(float(x), float(left), float(right)) for x, left, right in zip(*parts, strict=True)]


def _limit(graph: TractionGraph, x: float, side: str) -> float:
    return float(graph.traction(np.array([x]), side)[0])


def _slopes(graph: TractionGraph, breaks: Array, low: tuple[float, float], high: tuple[float, float]) -> Array:
    """Slopes of the pieces between breaks: those of the graph, and of the secants (end, slope) inside."""
    middles = np.concatenate([[breaks[0] - 1.0], 0.5 * (breaks[1:] + breaks[:-1]), [breaks[-1] + 1.0]])
    found = graph.slopes[np.searchsorted(graph.breaks, middles)]
    found = np.where((middles > low[0]) & (middles < 0.0), low[1], found)
    return np.asarray(np.where((middles < high[0]) & (middles > 0.0), high[1], found))
