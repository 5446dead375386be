"""The traction of a law as a polyline: exact where it is one; else of a curve nearby, and how far the energies differ.

Between two nodes a curve's traction becomes two lines that meet in the middle, such that tractions and energies at the
nodes are the law's own (Schumaker 1983, SIAM Journal on Numerical Analysis 20, with the knot in the middle). The
difference of the energies between nodes is bounded by sampling it, and between samples by the ranges of its first
derivative, which follows from the derivatives of the law's convex parts at the samples (these never fall), and of its
second, where the law tells its slopes. The smaller bound counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..laws import Superpotential
from ..laws.polyline import PolylineLaw
from ..laws.smoothing.smoothed_law import PlusSmoothedLaw
from ..laws.traction_graph import TractionGraph
from ..typing import Array
from .thresholds import DEFAULT, PolylineThresholds


@dataclass(frozen=True, kw_only=True)
class LawGraph:
    """A law's traction as a polyline.

    Attributes:
        graph: the polyline; its energy is zero at zero.
        offset: the law's energy at zero.
        error: the law's energy differs from that of the polyline by this at most.
    """

    graph: TractionGraph
    offset: float
    error: float


def exact_graph(law: Superpotential) -> TractionGraph | None:
    """The graph of a law whose traction is a polyline; None where it is curved.

    Args:
        law: the law.
    """
    return law.graph if isinstance(law, PolylineLaw | PlusSmoothedLaw) else None


def law_graph(
    law: Superpotential, far: float, tolerance: float, thresholds: PolylineThresholds = DEFAULT.polylines
) -> LawGraph:
    """The polyline of a law.

    Args:
        law: the law.
        far: displacements beyond it do not matter.
        tolerance: difference of energies per area that is aimed at, where the law is curved.
        thresholds: how many nodes and samples.
    """
    offset = float(law.value(np.zeros(1))[0])
    if (graph := exact_graph(law)) is not None:
        return LawGraph(graph=graph, offset=offset, error=0.0)
    nodes, error = _nodes(law, far, tolerance, thresholds)
    return LawGraph(graph=_joined(law, nodes), offset=offset, error=error)


def _nodes(law: Superpotential, far: float, tolerance: float, thresholds: PolylineThresholds) -> tuple[Array, float]:
    """Nodes between which energies differ by at most a tolerance, and how far they do."""
    first = _first_nodes(law, far, thresholds.one_place)
    begin, end = first[:-1], first[1:]
    kept, worst = [first[-1:]], 0.0
    while begin.size:
        full = sum(map(len, kept)) + 2 * begin.size > thresholds.most_nodes
        errors = _errors(law, begin, end, thresholds.samples)
        fine = (errors <= tolerance) | full
        worst = float(np.max(errors[fine], initial=worst))  # not a number stays so
        kept.append(begin[fine])
        begin, end = begin[~fine], end[~fine]
        middle = 0.5 * (begin + end)
        begin, end = np.append(begin, middle), np.append(middle, end)
    return np.sort(np.concatenate(kept)), worst


def _first_nodes(law: Superpotential, far: float, one_place: float) -> Array:
    """Breaks of a law, and distances from zero that double."""
    first = law.length_scale
    doubled = first * 2.0 ** np.arange(max(np.ceil(np.log2(far / first)), 1.0))
    known = np.concatenate([law.kinks, law.breaks, doubled, -doubled, [0.0, far, -far]])
    return _apart(known[np.abs(known) <= far], one_place)


def _apart(places: Array, one_place: float) -> Array:
    """Places in order; of those that only rounding tells apart, the one that is named first."""
    order = np.argsort(places, kind="stable")
    ordered = places[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > one_place * np.abs(ordered))
    return np.asarray(places[np.minimum.reduceat(order, begins)])


def _middle_tractions(law: Superpotential, begin: Array, end: Array) -> Array:
    """Tractions in the middles that give the energies at both ends, (n,)."""
    ends = 0.5 * (law.right(begin) + law.left(end))
    return np.asarray(2.0 * (law.value(end) - law.value(begin)) / (end - begin) - ends)


def _samples(begin: Array, end: Array, samples: int) -> tuple[Array, Array]:
    """Shares of intervals, and the places there, (n, k)."""
    share: Array = np.linspace(0.0, 1.0, samples + 1, dtype=np.float64)
    x = begin[:, None] + (end - begin)[:, None] * share
    x[:, -1] = end
    return share, x


def _rises(law: Superpotential, x: Array) -> Array:
    """By how much the tractions of the law's convex parts rise from sample to sample, together, (n, k - 1)."""
    ends = x[:, 1:].ravel(), x[:, :-1].ravel()
    rises = sum(part.left(ends[0]) - part.right(ends[1]) for part in (law.convex, law.concave))
    return np.asarray(rises).reshape(len(x), x.shape[1] - 1)


def _slopes_apart(law: Superpotential, x: Array, traction: Array) -> Array:
    """Bounds of what the slopes of the law and its polyline differ by between samples; inf if unknown, (n, k - 1)."""
    least, most = law.slope_range(x[:, :-1].ravel(), x[:, 1:].ravel())
    step = np.diff(x, axis=1)
    slope = np.diff(traction, axis=1) / step
    rounding = 4.0 * np.finfo(float).eps * np.abs(traction[:, 1:]) / step
    below, above = (ends.reshape(slope.shape) for ends in (least, most))
    return np.asarray(np.maximum(slope - below, above - slope) + rounding)


def _errors(law: Superpotential, begin: Array, end: Array, samples: int) -> Array:
    """Bounds of the difference of the energies on intervals, (n,)."""
    share, x = _samples(begin, end, samples)
    energy, traction = _polyline(law, begin, end, share)
    value = law.value(x.ravel()).reshape(x.shape)
    difference = np.abs(energy + value[:, :1] - value)
    step = np.diff(x, axis=1)
    span = np.abs(np.diff(traction, axis=1)) + _rises(law, x)
    between = step * np.minimum(0.25 * span, 0.125 * step * _slopes_apart(law, x, traction))
    most = np.maximum(difference[:, 1:], difference[:, :-1]) + between
    return np.asarray(most.max(axis=1) + np.finfo(float).eps * np.abs(value).max(axis=1))


def _polyline(law: Superpotential, begin: Array, end: Array, share: Array) -> tuple[Array, Array]:
    """Energy above that at the begin, and traction, of the two lines at shares of each interval, (n, k) each."""
    length, middle = (end - begin)[:, None], _middle_tractions(law, begin, end)[:, None]
    first, last = law.right(begin)[:, None], law.left(end)[:, None]
    a, b = np.minimum(share, 0.5), np.maximum(share - 0.5, 0.0)
    traction = first + 2.0 * a * (middle - first) + 2.0 * b * (last - middle)
    energy = length * (a * first + a * a * (middle - first) + b * middle + b * b * (last - middle))
    return energy, traction


def _joined(law: Superpotential, nodes: Array) -> TractionGraph:
    """Nodes and middles as one graph, constant beyond the ends."""
    size = 2 * len(nodes) - 1
    places, left, right = np.empty(size), np.empty(size), np.empty(size)
    places[::2], places[1::2] = nodes, 0.5 * (nodes[:-1] + nodes[1:])
    left[::2], right[::2] = law.left(nodes), law.right(nodes)
    left[1::2] = right[1::2] = _middle_tractions(law, nodes[:-1], nodes[1:])
    slopes = (left[1:] - right[:-1]) / np.diff(places)
    return TractionGraph(places, left, right, np.concatenate([[0.0], slopes, [0.0]]))
