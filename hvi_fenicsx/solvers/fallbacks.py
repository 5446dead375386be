"""A convex step tried in several ways, until one of them converges: no line search of PETSc's solves all of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ..system.system import LawModel
from .active_set import ActiveSetSolver, Outcome
from .result import Counts


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One way to solve a step.

    Attributes:
        models: what stands for the laws.
        line_search: PETSc's name.
        max_iterations: Newton steps at most.
        kept: whether the next one goes on from where this one fails, since this one lowers the energy, whatever it
            leaves undone; else the next one begins where this one did.
        start: where to begin instead, this one and the next.
        steady: as in :meth:`.ActiveSetSolver.solve`.
    """

    models: Sequence[LawModel]
    line_search: str
    max_iterations: int
    kept: bool
    start: PETSc.Vec | None = None
    steady: bool = False


def first_success(
    solver: ActiveSetSolver,
    x: PETSc.Vec,
    attempts: Iterable[Attempt | str],
    tolerance: float,
    bounds: tuple[PETSc.Vec, PETSc.Vec],
    counts: Counts,
) -> Outcome:
    """The outcome of the first attempt that converges, else of the one that came nearest. Collective.

    Args:
        solver: of each.
        x: start and result.
        attempts: the next is asked for only when the last has failed; words in place of one say why there is none.
        tolerance: as in :meth:`.ActiveSetSolver.solve`.
        bounds: from below and from above.
        counts: gets the iterations of all.
    """
    begin, best = x.copy(), x.copy()
    outcome = found = Outcome(False, 0, 0, float("inf"), "not started")
    for attempt in attempts:
        if isinstance(attempt, str):
            outcome = replace(outcome, reason=attempt)
            break
        if attempt.start is not None:
            attempt.start.copy(begin)
        begin.copy(x)
        found = _solved(solver, x, attempt, tolerance, bounds)
        counts.spend(found)
        if found.measure < outcome.measure or found.converged:
            outcome = found
            x.copy(best)
        if found.converged or found.interrupted:
            break
        if attempt.kept and np.isfinite(found.measure):
            x.copy(begin)
    best.copy(x)
    for vector in (begin, best):
        vector.destroy()
    return replace(outcome, interrupted=found.interrupted)


def _solved(
    solver: ActiveSetSolver, x: PETSc.Vec, attempt: Attempt, tolerance: float, bounds: tuple[PETSc.Vec, PETSc.Vec]
) -> Outcome:
    """How one attempt ends, from and into x. Collective."""
    return solver.solve(
        x,
        attempt.models,
        tolerance,
        lower=bounds[0],
        upper=bounds[1],
        line_search=attempt.line_search,
        max_iterations=attempt.max_iterations,
        steady=attempt.steady,
    )
