"""The condensed problem of a system with one chain of parabolas for each argument of its laws.

Between two nodes a curve's traction becomes two lines that meet in the middle, such that tractions and energies at the
nodes are the law's own (Schumaker 1983, SIAM Journal on Numerical Analysis 20, with the knot in the middle). The
difference of the energies between nodes is bounded by sampling it.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..laws import Superpotential
from ..laws.traction_graph import TractionGraph
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array, magnitude
from .arcs import FREE, Chain, chain, total
from .lengths import Lengths
from .rigid_balance import without_resistance
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


def scalar_problem(
    problem: CondensedProblem,
    *,
    tolerance: float | None = None,
    within: Array | None = None,
) -> ScalarProblem:
    """The problem under the whole load. Of energies that depend on the mode one nearby, as these have no potential.

    Args:
        problem: the condensed problem.
        tolerance: energy by which curved laws may differ from their polylines, altogether; None: a coarse one.
        within: displacements up to which curved laws are followed, (n,); None: far beyond all that the laws tell apart.

    Raises:
        InputError: a law acts on the length of a vector whose components have other laws.
    """
    far = np.full(problem.size, _far(problem.bonds)) if within is None else within
    laws, constant, error = _laws(problem, far, tolerance)
    vectors = [argument for argument in laws if argument.factors]
    _refuse_overlap(problem, laws)
    unknowns = [laws.get(_Argument((i,)), []) for i in range(problem.size)]
    chains = [*unknowns, *(laws[v] for v in vectors)]
    whole = tuple(total(one) if one else FREE for one in chains)
    lower, upper = _off_drops(whole[: problem.size], problem.lower, problem.upper, LIMITS.zero)
    return ScalarProblem(
        stiffness=without_resistance(problem.stiffness),
        force=problem.load(1.0),
        lower=lower,
        upper=upper,
        chains=whole,
        lengths=_lengths(vectors),
        constant=constant,
        error=error,
        farthest=float(np.max(far)) if error else math.inf,
    )


def _off_drops(chains: Sequence[Chain], lower: Array, upper: Array, way: float) -> tuple[Array, Array]:
    """Bounds at which a traction drops moved off the drop, by less than points are told apart.

    An unknown there may bear any traction of the drop, whether the bound pushes or not; so the drop must be inside.
    """
    low, high = lower.copy(), upper.copy()
    for i in np.flatnonzero(lower < upper):
        drops = [a.high for a, b in itertools.pairwise(chains[i]) if b.rate(b.low) < a.rate(a.high)]
        if lower[i] in drops:
            low[i] -= way * (1.0 + abs(lower[i]))
        if upper[i] in drops:
            high[i] += way * (1.0 + abs(upper[i]))
    return low, high


class _Argument(NamedTuple):
    """What laws act on: one unknown, or the length of a vector factors * x[unknowns]."""

    unknowns: tuple[int, ...]
    factors: tuple[float, ...] = ()
    opens: bool = False


def _laws(
    problem: CondensedProblem, far: Array, tolerance: float | None
) -> tuple[dict[_Argument, list[Chain]], float, float]:
    """The chains on each argument, the constant of the energy, and its error, which laws share by their areas."""
    found: dict[_Argument, list[Chain]] = {}
    constant, error = problem.constant_at(1.0), 0.0
    curved = sum(float(b.weights.sum()) for b in problem.bonds if b.law.graph is None)
    for bonds in problem.bonds:
        aim = LIMITS.coarse * bonds.law.energy_scale if tolerance is None else tolerance / (curved or 1.0)
        law, bonds = law_graph(bonds.law, _argument(bonds, far), aim), _frozen(bonds)
        area = float(bonds.weights.sum())
        constant, error = constant + area * law.offset, error + area * law.error
        for argument, sign, weight in _arguments(bonds):
            found.setdefault(argument, []).append(chain(law.graph, weight, sign))
    return found, constant, error


def _arguments(bonds: Bonds) -> Iterator[tuple[_Argument, float, float]]:
    """Argument, factor and weight of each bond that has a weight."""
    for k in np.flatnonzero(bonds.weights > 0.0):
        weight = float(bonds.weights[k])
        numbers, factors = tuple(int(i) for i in bonds.unknowns[k]), tuple(float(s) for s in bonds.signs[k])
        if bonds.radial:
            yield _Argument(numbers, factors, bonds.opens), 1.0, weight
        else:
            yield _Argument(numbers), factors[0], weight


def _lengths(vectors: Sequence[_Argument]) -> Lengths:
    """The vectors as arrays."""
    if not vectors:
        return Lengths.none()
    return Lengths(
        unknowns=np.array([[*v.unknowns, *[v.unknowns[0]] * (3 - len(v.unknowns))] for v in vectors]),
        factors=np.array([[*v.factors, *[0.0] * (3 - len(v.factors))] for v in vectors]),
        opens=np.array([v.opens for v in vectors]),
    )


def _argument(bonds: Bonds, far: Array) -> float:
    """The largest argument of a law within displacements (n,), and no less than its own length."""
    arguments = np.linalg.norm(bonds.signs * far[bonds.unknowns], axis=1)
    return float(np.max(arguments, initial=bonds.law.length_scale))


def _far(laws: Sequence[Bonds]) -> float:
    """A displacement beyond all that the laws tell apart."""
    return LIMITS.far * max([1.0, *(magnitude([b.law.length_scale, *b.law.breaks]) for b in laws)])


def _frozen(bonds: Bonds) -> Bonds:
    """Bonds whose energy depends on the mode as bonds of half of each: equilibria are looked for near theirs."""
    if bonds.mixity is None:
        return bonds
    return replace(bonds, weights=bonds.weights * bonds.mixity.energy(np.array([0.5])))


def _refuse_overlap(problem: CondensedProblem, found: Iterable[_Argument]) -> None:
    """A component of a vector must have no other law."""
    taken = Counter(i for argument in found for i in argument.unknowns)
    several = {i for argument in found if argument.factors for i in argument.unknowns if taken[i] > 1}
    if several:
        parts = sorted({b.part for b in problem.bonds if several & set(b.unknowns.ravel().tolist())})
        raise InputError(
            f"boundary.{', boundary.'.join(parts)}: a vertex has a law on the length of a slip or an opening, and "
            "another law on one of its components; such a scene is not searched"
        )


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
    return places[np.minimum.reduceat(order, begins)]


def _middle_tractions(law: Superpotential, begin: Array, end: Array) -> Array:
    """Tractions in the middles that give the energies at both ends, (n,)."""
    ends = 0.5 * (law.right(begin) + law.left(end))
    return 2.0 * (law.value(end) - law.value(begin)) / (end - begin) - ends


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
    return apart + np.abs(np.diff(ends, axis=1)) + rounding


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
    return most.max(axis=1) + np.finfo(float).eps * np.abs(value).max(axis=1)


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
    return TractionGraph.chords(places, left, right)
