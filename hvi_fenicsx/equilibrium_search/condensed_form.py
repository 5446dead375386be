"""The condensed problem of a system with one chain of parabolas for each argument of its laws."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array
from .arcs import FREE, Chain, chain, total
from .curved_laws import LawGraph, law_graph
from .lengths import Lengths
from .rigid_motions import without_resistance
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


def scalar_problem(
    problem: CondensedProblem,
    factor: float = 1.0,
    *,
    tolerance: float | None = None,
    within: Array | None = None,
) -> ScalarProblem:
    """The problem at a load factor. Of energies that depend on the mode one nearby, as these have no potential.

    Args:
        problem: the condensed problem.
        factor: λ.
        tolerance: energy by which curved laws may differ from their polylines, altogether; None: a coarse one.
        within: displacements up to which curved laws are followed, (n,); None: far beyond all that the laws tell apart.

    Raises:
        InputError: a law acts on the length of a vector whose components have other laws.
    """
    far = np.full(problem.size, _far(problem.bonds)) if within is None else within
    laws = _Laws.of(problem, _graphs(problem.bonds, far, tolerance), problem.constant_at(factor))
    vectors = [argument for argument in laws.chains if argument.radial]
    _refuse_overlap(problem, laws.chains)
    unknowns = [laws.chains.get(_Argument(unknowns=(i,)), []) for i in range(problem.size)]
    chains = [*unknowns, *(laws.chains[v] for v in vectors)]
    whole = tuple(total(one) if one else FREE for one in chains)
    lower, upper = _off_drops(whole[: problem.size], problem.lower, problem.upper, LIMITS.zero)
    return ScalarProblem(
        stiffness=without_resistance(problem.stiffness),
        force=problem.load(factor),
        lower=lower,
        upper=upper,
        chains=whole,
        lengths=_lengths(vectors),
        constant=laws.constant,
        error=laws.error,
        farthest=float(np.max(far)) if laws.error else math.inf,
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


@dataclass(frozen=True, kw_only=True)
class _Argument:
    """What laws act on: one unknown, or the length of a vector factors * x[unknowns]."""

    unknowns: tuple[int, ...]
    factors: tuple[float, ...] = ()
    opens: bool = False

    @property
    def radial(self) -> bool:
        return bool(self.factors)


@dataclass(frozen=True, kw_only=True)
class _Laws:
    """The laws of all bonds.

    Attributes:
        chains: those that act on an argument.
        constant: of the energy.
        error: of the energy, at most.
    """

    chains: Mapping[_Argument, list[Chain]]
    constant: float
    error: float

    @classmethod
    def of(cls, problem: CondensedProblem, graphs: Iterable[LawGraph], constant: float) -> _Laws:
        """Gather the laws; the constant is that without them."""
        found: dict[_Argument, list[Chain]] = {}
        error = 0.0
        for bonds, law in zip(map(_frozen, problem.bonds), graphs, strict=True):
            area = float(bonds.weights.sum())
            constant, error = constant + area * law.offset, error + area * law.error
            for argument, sign, weight in _arguments(bonds):
                found.setdefault(argument, []).append(chain(law.graph, weight, sign))
        return cls(chains=found, constant=constant, error=error)


def _arguments(bonds: Bonds) -> Iterator[tuple[_Argument, float, float]]:
    """Argument, factor and weight of each bond that has a weight."""
    for k in np.flatnonzero(bonds.weights > 0.0):
        weight = float(bonds.weights[k])
        numbers, factors = tuple(int(i) for i in bonds.unknowns[k]), tuple(float(s) for s in bonds.signs[k])
        if bonds.radial:
            yield _Argument(unknowns=numbers, factors=factors, opens=bonds.opens), 1.0, weight
        else:
            yield _Argument(unknowns=numbers), factors[0], weight


def _lengths(vectors: Sequence[_Argument]) -> Lengths:
    """The vectors as arrays."""
    if not vectors:
        return Lengths.none()
    return Lengths(
        unknowns=np.array([[*v.unknowns, *[v.unknowns[0]] * (3 - len(v.unknowns))] for v in vectors]),
        factors=np.array([[*v.factors, *[0.0] * (3 - len(v.factors))] for v in vectors]),
        opens=np.array([v.opens for v in vectors]),
    )


def _graphs(laws: Sequence[Bonds], far: Array, tolerance: float | None) -> Iterator[LawGraph]:
    """The laws as polylines; those of curved laws share the error by their areas."""
    area = sum(float(b.weights.sum()) for b in laws if b.law.graph is None)
    for b in laws:
        aim = LIMITS.coarse * b.law.energy_scale if tolerance is None else tolerance / (area or 1.0)
        yield law_graph(b.law, _argument(b, far), aim)


def _argument(bonds: Bonds, far: Array) -> float:
    """The largest argument of a law within displacements (n,), and no less than its own length."""
    arguments = np.linalg.norm(bonds.signs * far[bonds.unknowns], axis=1)
    return float(np.max(arguments, initial=bonds.law.length_scale))


def _far(laws: Sequence[Bonds]) -> float:
    """A displacement beyond all that the laws tell apart."""
    sizes = [np.max(np.abs([b.law.length_scale, *b.law.breaks])) for b in laws]
    return LIMITS.far * max([1.0, *map(float, sizes)])


def _frozen(bonds: Bonds) -> Bonds:
    """Bonds whose energy depends on the mode as bonds of half of each: equilibria are looked for near theirs."""
    if bonds.mixity is None:
        return bonds
    return replace(bonds, weights=bonds.weights * bonds.mixity.energy(np.array([0.5])))


def _refuse_overlap(problem: CondensedProblem, found: Iterable[_Argument]) -> None:
    """A component of a vector must have no other law."""
    taken = Counter(i for argument in found for i in argument.unknowns)
    several = {i for argument in found if argument.radial for i in argument.unknowns if taken[i] > 1}
    if several:
        parts = sorted({b.part for b in problem.bonds if several & set(b.unknowns.ravel().tolist())})
        raise InputError(
            f"boundary.{', boundary.'.join(parts)}: a vertex has a law on the length of a slip or an opening, and "
            "another law on one of its components; such a scene is not searched"
        )
