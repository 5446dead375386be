"""Attempts at one solve: the first that converges, else the best."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ..system.equations import LawModel
from .active_set import ENERGY, ActiveSetSolver
from .convergence import Counts, Outcome


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One way to solve a step.

    Attributes:
        models: what takes the place of the laws, by term.
        line_search: PETSc's name.
        start: where to begin instead; None for where it would.
        steady: as in :meth:`.ActiveSetSolver.solve`.
        foundation: likewise.
    """

    models: Sequence[LawModel]
    line_search: str
    start: PETSc.Vec | None = None
    steady: bool = False
    foundation: float = 0.0


def first_success(
    solver: ActiveSetSolver,
    x: PETSc.Vec,
    attempts: Iterable[Attempt | str],
    tolerance: float,
    bounds: tuple[PETSc.Vec, PETSc.Vec],
    counts: Counts,
    most: int,
) -> Outcome:
    """The outcome of the first attempt that converges, else of the one with the smallest residual. Collective.

    Args:
        solver: of all attempts.
        x: start and result.
        attempts: the next is asked for only after the last has failed; a text instead of one is the reason to end.
        tolerance: as in :meth:`.ActiveSetSolver.solve`.
        bounds: lower and upper bounds.
        counts: gets the iterations of all.
        most: Newton steps of each at most.
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
        found = _solve(solver, x, attempt, tolerance, bounds, most)
        counts.add_outcome(found)
        if found.measure < outcome.measure or found.converged:
            outcome = found
            x.copy(best)
        if found.converged or found.interrupted:
            break
        # an energy that has fallen is kept; else the next attempt begins where this one began
        if attempt.line_search == ENERGY and np.isfinite(found.measure):
            x.copy(begin)
    best.copy(x)
    for vector in (begin, best):
        vector.destroy()
    return replace(outcome, interrupted=found.interrupted)


def _solve(
    solver: ActiveSetSolver,
    x: PETSc.Vec,
    attempt: Attempt,
    tolerance: float,
    bounds: tuple[PETSc.Vec, PETSc.Vec],
    most: int,
) -> Outcome:
    """How one attempt ends, from and into x. Collective."""
    return solver.solve(
        x,
        attempt.models,
        tolerance,
        lower=bounds[0],
        upper=bounds[1],
        line_search=attempt.line_search,
        max_iterations=most,
        steady=attempt.steady,
        foundation=attempt.foundation,
    )
