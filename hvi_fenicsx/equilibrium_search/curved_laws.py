"""Curved laws: polylines near their tractions, how far the energies differ, and the laws' own stationary points.

Between two nodes a curve's traction becomes two lines that meet in the middle, such that tractions and energies at the
nodes are the law's own (Schumaker 1983, SIAM Journal on Numerical Analysis 20, with the knot in the middle). The
difference of the energies between nodes is bounded by sampling it, and between samples by the range of its first
derivative, which follows from the derivatives of the law's convex parts at the samples (these never fall), or of its
second at their ends, widened by as much as that changes. Newton's method makes a point of polylines exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..laws import Superpotential
from ..laws.traction_graph import TractionGraph
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array
from . import stationarity
from .scalar_problem import ScalarProblem
from .stationarity import StationaryPoint, Subdifferential
from .thresholds import LIMITS


def stationary_point(near: ScalarProblem, problem: CondensedProblem, x: Array) -> StationaryPoint | None:
    """The stationary point of laws of one component near one of their polylines; None where there is none.

    An unknown stays where a jump of its laws or a bound bears the force.

    Args:
        near: the problem with polylines near the laws.
        problem: the problem with the laws, at the load factor 1.
        x: displacements, (n,).
    """
    start, best = x, None
    for _ in range(LIMITS.most_steps):
        force, allowed = near.force - near.stiffness @ x, _subdifferential(near, problem, x)
        rest = force - np.clip(force, allowed.low, allowed.high)
        missing = float(np.max(np.abs(rest), initial=0.0))
        if best is not None and missing >= 0.5 * best[0] and best[0] <= LIMITS.accuracy * near.force_size:
            break  # at a fold, where two points are one, a step leaves a quarter of the rest
        best = missing, x, allowed
        free = (allowed.high - allowed.low <= LIMITS.accuracy * near.force_size) | (rest != 0.0)
        matrix = near.stiffness[np.ix_(free, free)] + np.diag(allowed.least[free])
        step = np.zeros(len(x))
        step[free] = np.linalg.lstsq(matrix, rest[free], rcond=None)[0]
        x = np.clip(x + step, near.lower, near.upper)
        if not np.max(np.abs(x - start)) <= LIMITS.longest * (1.0 + np.max(np.abs(start))):
            break
    if best is None or best[0] > LIMITS.accuracy**1.5 * near.force_size:
        return None
    _, x, allowed = best
    return StationaryPoint(x=x, energy=problem.energy(x), kind=stationarity.kind(near, x, allowed))


def _subdifferential(near: ScalarProblem, problem: CondensedProblem, x: Array) -> Subdifferential:
    """What the laws and bounds allow at a point."""
    close = LIMITS.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
    low, high, slope = np.zeros((3, near.size))
    falls = np.zeros(near.size, dtype=np.bool_)
    for bonds in problem.bonds:
        at, argument = bonds.unknowns[:, 0], bonds.argument(x)
        for total, force in zip((low, high), _forces(bonds, argument, close), strict=True):
            np.add.at(total, at, force)
        second = bonds.law.convex.second(argument) - bonds.law.concave.second(argument)
        np.add.at(slope, at, bonds.weights * bonds.signs[:, 0] ** 2 * second)
        for kink in bonds.law.concave.kinks:
            falls[at[(np.abs(argument - kink) <= close) & (bonds.weights > 0.0)]] = True
    laws = Subdifferential(low=low, high=high, falls=falls, least=slope, most=slope)
    return stationarity.with_bounds(near, x, laws)


def _forces(bonds: Bonds, argument: Array, close: float) -> tuple[Array, Array]:
    """The least and the largest force of each bond."""
    factors = bonds.weights * bonds.signs[:, 0]
    ends = [factors * traction for traction in bonds.law.interval(argument, close)]
    return np.minimum(*ends), np.maximum(*ends)


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


def law_graph(law: Superpotential, far: float, tolerance: float) -> LawGraph:
    """The polyline of a law.

    Args:
        law: the law.
        far: displacements beyond it do not matter.
        tolerance: difference of energies per area that is aimed at, where the law is curved.
    """
    offset = float(law.value(np.zeros(1))[0])
    if (graph := law.graph) is not None:
        return LawGraph(graph=graph, offset=offset, error=0.0)
    nodes, error = _nodes(law, far, tolerance)
    return LawGraph(graph=_joined(law, nodes), offset=offset, error=error)


def _nodes(law: Superpotential, far: float, tolerance: float) -> tuple[Array, float]:
    """Nodes between which energies differ by at most a tolerance, and how far they do."""
    first = _first_nodes(law, far)
    begin, end = first[:-1], first[1:]
    kept, worst = [first[-1:]], 0.0
    while begin.size:
        full = sum(map(len, kept)) + 2 * begin.size > LIMITS.most_nodes
        errors = _errors(law, begin, end)
        fine = (errors <= tolerance) | full
        worst = float(np.max(errors[fine], initial=worst))  # not a number stays so
        kept.append(begin[fine])
        begin, end = begin[~fine], end[~fine]
        middle = 0.5 * (begin + end)
        begin, end = np.append(begin, middle), np.append(middle, end)
    return np.sort(np.concatenate(kept)), worst


def _first_nodes(law: Superpotential, far: float) -> Array:
    """Breaks of a law, and distances from zero that double."""
    first = law.length_scale
    doubled = first * 2.0 ** np.arange(max(np.ceil(np.log2(far / first)), 1.0))
    known = np.concatenate([law.kinks, law.breaks, doubled, -doubled, [0.0, far, -far]])
    return _apart(known[np.abs(known) <= far])


def _apart(places: Array) -> Array:
    """Places in order; of those that only rounding tells apart, the one that is named first."""
    order = np.argsort(places, kind="stable")
    ordered = places[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > LIMITS.rounding * np.abs(ordered))
    return np.asarray(places[np.minimum.reduceat(order, begins)])


def _middle_tractions(law: Superpotential, begin: Array, end: Array) -> Array:
    """Tractions in the middles that give the energies at both ends, (n,)."""
    ends = 0.5 * (law.right(begin) + law.left(end))
    return np.asarray(2.0 * (law.value(end) - law.value(begin)) / (end - begin) - ends)


def _samples(begin: Array, end: Array) -> tuple[Array, Array]:
    """Shares of intervals, and the places there, (n, k)."""
    share: Array = np.linspace(0.0, 1.0, LIMITS.samples + 1, dtype=np.float64)
    x = begin[:, None] + (end - begin)[:, None] * share
    x[:, -1] = end
    return share, x


def _rises(law: Superpotential, x: Array) -> Array:
    """By how much the tractions of the law's convex parts rise from sample to sample, together, (n, k - 1)."""
    ends = x[:, 1:].ravel(), x[:, :-1].ravel()
    rises = sum(part.left(ends[0]) - part.right(ends[1]) for part in (law.convex, law.concave))
    return np.asarray(rises).reshape(len(x), x.shape[1] - 1)


def _slopes_apart(law: Superpotential, x: Array, traction: Array) -> Array:
    """What the slopes of the law and its polyline differ by between samples, (n, k - 1)."""
    step, ends = np.diff(x, axis=1), law.derivatives(x.ravel())[1].reshape(x.shape)
    apart = np.abs(np.stack([ends[:, 1:], ends[:, :-1]]) - np.diff(traction, axis=1) / step).max(axis=0)
    rounding = 4.0 * np.finfo(float).eps * np.abs(traction[:, 1:]) / step
    return np.asarray(apart + np.abs(np.diff(ends, axis=1)) + rounding)


def _errors(law: Superpotential, begin: Array, end: Array) -> Array:
    """Bounds of the difference of the energies on intervals, (n,)."""
    share, x = _samples(begin, end)
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
