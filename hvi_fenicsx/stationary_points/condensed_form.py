"""The condensed problem of a system with one chain of parabolas for each unknown."""

from __future__ import annotations

from ..errors import InputError
from ..laws.polyline import PolylineLaw
from ..system.condensed_problem import Bonds, CondensedProblem
from .arcs import FREE, Chain, chain, total
from .scalar_problem import ScalarProblem


def scalar_problem(problem: CondensedProblem, factor: float = 1.0) -> ScalarProblem:
    """The problem at a load factor.

    Args:
        problem: the condensed problem.
        factor: λ.

    Raises:
        InputError: a law is no polyline, or acts on the length of a slip vector.
    """
    found: list[list[Chain]] = [[] for _ in range(problem.size)]
    for bonds in problem.bonds:
        _refuse_others(bonds)
        graph = bonds.law.graph  # type: ignore[attr-defined]
        for unknown, sign, weight in zip(bonds.unknowns[:, 0], bonds.signs[:, 0], bonds.weights, strict=True):
            if weight > 0.0:
                found[unknown].append(chain(graph, float(weight), float(sign)))
    return ScalarProblem(
        stiffness=problem.stiffness,
        force=problem.load(factor),
        lower=problem.lower,
        upper=problem.upper,
        chains=tuple(total(chains) if chains else FREE for chains in found),
        constant=problem.constant_at(factor),
    )


def _refuse_others(bonds: Bonds) -> None:
    where = f"boundary.{bonds.part}"
    if bonds.unknowns.shape[1] > 1:
        raise InputError(
            f"{where}: friction in space acts on |u_t|; all equilibria are found for laws of one component"
        )
    if not isinstance(bonds.law, PolylineLaw):
        raise InputError(
            f"{where}: the law is smooth; all equilibria are found for laws that are polylines, unsmoothed: leave "
            "smoothing and epsilon away, or give a curved law as a graph"
        )
