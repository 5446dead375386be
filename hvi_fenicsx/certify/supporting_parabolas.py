"""Whether a law's energy is nowhere below its tangent at a state, or by how much curvature it is.

With t a traction that the law allows at x, let c be the least number with j(y) >= j(x) + t (y - x) - ½ c (y - x)² for
all y. Where the stiffness outweighs the sum of c w of all vertices, w being their areas, no displacement has a lower
energy than the state, be there drops or not: with that parabola added, each law touches its convex envelope at x.
A law of a length is lowest along the vector itself, so the same c serves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..equilibrium_paths.graphs import graph_of
from ..laws import TractionGraph
from ..typing import Array
from .law_state import LawState
from .thresholds import UniquenessThresholds


def needed_falls(state: LawState, thresholds: UniquenessThresholds) -> Array | None:
    """The least c at each vertex, infinite where there is none, (m,); None where the traction is no polyline.

    Args:
        state: of a law at a certified displacement.
        thresholds: what is rounding.
    """
    graph = graph_of(state.term.law)
    if graph is None or state.term.mixity is not None:
        return None
    low, high = state.term.law.interval(state.argument, state.near)
    traction = np.clip(state.traction, low, high)
    x = _on_breaks(graph, state.argument, state.near)
    falls: Array = np.zeros(len(x))
    pieces = [_Piece(*row) for row in graph.parabolas()]
    for piece in (p for p in pieces if not state.term.radial or p.low >= 0.0):
        falls = np.maximum(falls, piece.needed(x, graph.primitive(x), traction, thresholds.rounding * state.scale))
    falls[falls <= thresholds.rounding * float(np.max(np.abs(graph.slopes)))] = 0.0
    if state.term.radial:
        return np.where(state.hidden | (traction < 0.0), np.inf, falls)
    return np.where(state.hidden, 0.0, falls)


def _on_breaks(graph: TractionGraph, x: Array, near: Array) -> Array:
    """Displacements; those that are on a break but for rounding, exactly there."""
    distances = np.abs(x[:, None] - graph.breaks)
    return np.where(distances.min(axis=1) <= near, graph.breaks[np.argmin(distances, axis=1)], x)


class _Piece(NamedTuple):
    """The energy value + traction (y - anchor) + ½ slope (y - anchor)² on low <= y <= high."""

    low: float
    high: float
    anchor: float
    value: float
    traction: float
    slope: float

    def needed(self, x: Array, energy: Array, traction: Array, rounding: Array) -> Array:
        """The least c for all y of the piece, (m,).

        Args:
            x: where the parabola touches the law, (m,).
            energy: of the law there, (m,).
            traction: there, (m,).
            rounding: differences of tractions that are none, (m,).
        """
        d = x - self.anchor
        above = self.value + (self.traction + 0.5 * self.slope * d) * d - energy
        steeper = self.traction + self.slope * d - traction
        inside = (x >= self.low) & (x <= self.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = 1.0 / (self.low - x), 1.0 / (self.high - x)  # c(y) = -(2 a w² + 2 b w + slope), w being 1/(y - x)
            turn = np.clip(np.where(above > 0.0, -0.5 * steeper / above, ends[0]), np.minimum(*ends), np.maximum(*ends))
            found = [-2.0 * (above * w + steeper) * w - self.slope for w in (*ends, turn)]
            sides = [self._beside(np.abs(w), way * steeper, rounding) for way, w in zip((-1.0, 1.0), ends, strict=True)]
        return np.where(inside, np.maximum(*sides), np.max(found, axis=0))

    def _beside(self, w: Array, steeper: Array, rounding: Array) -> Array:
        """The least c on one side of an x on the piece, which ends 1/w from x; infinite where the energy falls."""
        needed = np.where(steeper < -rounding, np.inf, -2.0 * np.maximum(steeper, 0.0) * w - self.slope)
        return np.where(np.isinf(w), -np.inf, needed)
