"""Whether a law's energy is nowhere below its tangent at a state, or by how much curvature it is.

With t a traction that the law allows at x, let c be the least number with j(y) >= j(x) + t (y - x) - ½ c (y - x)² for
all y. Where the stiffness outweighs the sum of c w of all vertices, w being their areas, no displacement has a lower
energy than the state, be there drops or not: with that parabola added, each law touches its convex envelope at x.
A law of a length is lowest along the vector itself, so the same c serves.
"""

from __future__ import annotations

import numpy as np

from ..laws import TractionGraph
from ..laws.traction_graph import Arc
from ..typing import Array
from .law_state import LawState
from .thresholds import DEFAULT


def needed_falls(state: LawState) -> Array | None:
    """The least c at each vertex, infinite where there is none, (m,); None where the traction is no polyline.

    Args:
        state: of a law at a certified displacement.
    """
    graph = state.term.law.graph
    if graph is None or state.term.mixity is not None:
        return None
    low, high = state.term.law.interval(state.argument, state.near)
    traction = np.clip(state.traction, low, high)
    x = _on_breaks(graph, state.argument, state.near)
    falls: Array = np.zeros(len(x))
    energy, rounding = graph.primitive(x), DEFAULT.near * state.scale
    for arc in (a for a in graph.arcs() if not state.term.radial or a.low >= 0.0):
        falls = np.maximum(falls, _needed(arc, x, energy, traction, rounding))
    falls[falls <= DEFAULT.near * float(np.max(np.abs(graph.slopes)))] = 0.0
    falls /= state.term.stretch
    if state.term.radial:
        return np.where(state.hidden | (traction < 0.0), np.inf, falls)
    return np.where(state.hidden, 0.0, falls)


def _on_breaks(graph: TractionGraph, x: Array, near: Array) -> Array:
    """Displacements; those that are on a break but for rounding, exactly there."""
    distances = np.abs(x[:, None] - graph.breaks)
    return np.where(distances.min(axis=1) <= near, graph.breaks[np.argmin(distances, axis=1)], x)


def _needed(arc: Arc, x: Array, energy: Array, traction: Array, rounding: Array) -> Array:
    """The least c for all y of a piece, (m,).

    Args:
        arc: the piece.
        x: where the parabola touches the law, (m,).
        energy: of the law there, (m,).
        traction: there, (m,).
        rounding: differences of tractions that are none, (m,).
    """
    above, steeper = arc.at(x) - energy, arc.rate(x) - traction
    inside = (x >= arc.low) & (x <= arc.high)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = 1.0 / (arc.low - x), 1.0 / (arc.high - x)  # c(y) = -(2 a w² + 2 b w + slope), w being 1/(y - x)
        turn = np.clip(np.where(above > 0.0, -0.5 * steeper / above, ends[0]), np.minimum(*ends), np.maximum(*ends))
        found = [-2.0 * _beyond(above * w + steeper, rounding) * w - arc.slope for w in (*ends, turn)]
        sides = [_beside(arc, np.abs(w), s * steeper, rounding) for s, w in zip((-1.0, 1.0), ends, strict=True)]
    return np.where(inside, np.maximum(*sides), np.max(found, axis=0))


def _beyond(tractions: Array, rounding: Array) -> Array:
    """Differences of tractions; 0 where they are rounding, (m,)."""
    return np.where(np.abs(tractions) <= rounding, 0.0, tractions)


def _beside(arc: Arc, w: Array, steeper: Array, rounding: Array) -> Array:
    """The least c on one side of an x on the piece, which ends 1/w from x; infinite where the energy falls."""
    needed = np.where(steeper < -rounding, np.inf, -2.0 * np.maximum(steeper, 0.0) * w - arc.slope)
    return np.where(np.isinf(w), -np.inf, needed)
