"""The condensed problem of a system with one chain of parabolas for each unknown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..errors import InputError
from ..system.condensed_problem import Bonds, CondensedProblem
from .arcs import FREE, Chain, chain, total
from .law_graphs import LawGraph, exact_graph, law_graph
from .scalar_problem import FAR, ScalarProblem

COARSE = 1e-4
"""Error of the energy of curved laws, relative to their scale, with which the first search is made."""


def scalar_problem(problem: CondensedProblem, factor: float = 1.0, *, tolerance: float | None = None) -> ScalarProblem:
    """The problem at a load factor.

    Args:
        problem: the condensed problem.
        factor: λ.
        tolerance: energy by which curved laws may differ from their polylines, altogether; None: a coarse one.

    Raises:
        InputError: a law acts on the length of a slip vector.
    """
    found: list[list[Chain]] = [[] for _ in range(problem.size)]
    far, constant, error = _far(problem.bonds), problem.constant_at(factor), 0.0
    for bonds, law in zip(problem.bonds, _graphs(problem.bonds, far, tolerance), strict=True):
        _refuse_others(bonds)
        area = float(bonds.weights.sum())
        constant, error = constant + area * law.offset, error + area * law.error
        for unknown, sign, weight in zip(bonds.unknowns[:, 0], bonds.signs[:, 0], bonds.weights, strict=True):
            if weight > 0.0:
                found[unknown].append(chain(law.graph, float(weight), float(sign)))
    return ScalarProblem(
        stiffness=problem.stiffness,
        force=problem.load(factor),
        lower=problem.lower,
        upper=problem.upper,
        chains=tuple(total(chains) if chains else FREE for chains in found),
        constant=constant,
        error=error,
        farthest=far if error else math.inf,
    )


def _graphs(laws: Sequence[Bonds], far: float, tolerance: float | None) -> Iterator[LawGraph]:
    """The laws as polylines; those of curved laws share the error by their areas."""
    area = sum(float(b.weights.sum()) for b in laws if exact_graph(b.law) is None)
    for b in laws:
        aim = COARSE * b.law.energy_scale if tolerance is None else tolerance / (area or 1.0)
        yield law_graph(b.law, far, aim)


def _far(laws: Sequence[Bonds]) -> float:
    """A displacement beyond all that the laws tell apart."""
    sizes = [np.max(np.abs([b.law.length_scale, *b.law.breaks])) for b in laws]
    return FAR * max([1.0, *map(float, sizes)])


def _refuse_others(bonds: Bonds) -> None:
    if bonds.radial:
        raise InputError(
            f"boundary.{bonds.part}: friction in space acts on |u_t|, and cohesion on opening and slip together; what "
            "is searched are laws of one component"
        )
