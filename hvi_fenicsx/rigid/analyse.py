"""Can a solution exist, along which rigid motion would the body escape, and how much more load would it bear?

With C = Y ∩ K∞ the rigid motions that the contact admits, j^∞ the growth and ĵ the peak of the laws:
held if <g,y> < ∫ j^∞(y) for all y ≠ 0 in C, escapes if <g,y> > ∫ ĵ(y) for some y in C, metastable in between,
borderline where one of these is an equality, undecided where rounding lets no programme end. The theory and the closed
forms are in docs/solvability.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from mpi4py import MPI

from ..errors import HviError, InputError, SolverError
from .kernel import modes
from .limit_analysis import Analysis
from .reduction import ReducedProblem, RigidProblem, reduce
from .solvability import LoadFactors, Solvability, undecided, unmovable
from .thresholds import DEFAULT, RigidThresholds

Result = TypeVar("Result")


def analyse(comm: MPI.Comm, problem: RigidProblem, thresholds: RigidThresholds = DEFAULT) -> Solvability:
    """The state of a scene and its margins, before anything is solved. Collective; the same on all ranks.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
        thresholds: what counts as zero, and when to give up.
    """
    return _judged(comm, problem, thresholds, unmovable(), lambda found: _verdict(problem, found))


def gives_way(comm: MPI.Comm, problem: RigidProblem, thresholds: RigidThresholds = DEFAULT) -> bool:
    """Whether the load does more work along a rigid motion than the growth resists. Collective; the same on all ranks.

    The growth does not hold the body then, whatever the peak does. One minimum tells, where the whole verdict takes one
    for each face of the unit ball; where the programmes broke down, nothing is known, and it is not said to give way.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
        thresholds: what counts as zero, and when to give up.
    """
    return _judged(comm, problem, thresholds, False, lambda found: _gives_way(problem, found))


def _gives_way(problem: RigidProblem, reduced: ReducedProblem) -> bool:
    try:
        return Analysis(problem, reduced).gives_way
    except SolverError:
        return False


def _verdict(problem: RigidProblem, reduced: ReducedProblem) -> Solvability:
    analysis = Analysis(problem, reduced)
    try:
        return analysis.solvability()
    except SolverError as error:
        return undecided(modes(reduced.frame, problem.body), analysis.paper_c, str(error))


def load_factors(
    comm: MPI.Comm, problem: RigidProblem, *loads: str, thresholds: RigidThresholds = DEFAULT
) -> LoadFactors:
    """Factors of some loads together, the others constant. Collective; the same on all ranks.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
        loads: their names; none: the whole load.
        thresholds: what counts as zero, and when to give up.

    Raises:
        InputError: there is no such load.
        SolverError: the linear programmes broke down.
    """
    names = loads or tuple(problem.loads)
    for name in names:
        if name not in problem.loads:
            raise InputError(f"there is no load {name!r}; there are: {', '.join(problem.loads) or 'none'}")
    unmoved = LoadFactors(-np.inf, np.inf, np.inf, None, None)
    return _judged(comm, problem, thresholds, unmoved, lambda found: Analysis(problem, found).load_factors(names))


def _judged(
    comm: MPI.Comm,
    problem: RigidProblem,
    thresholds: RigidThresholds,
    unmoved: Result,
    work: Callable[[ReducedProblem], Result],
) -> Result:
    """What the work finds of the reduced problem; the given result where no rigid motion is left. Collective."""
    basis, reduced = reduce(comm, problem, thresholds)
    return unmoved if basis.shape[1] == 0 else _on_root(comm, reduced, work)


def _on_root(comm: MPI.Comm, reduced: ReducedProblem | None, work: Callable[[ReducedProblem], Result]) -> Result:
    """Do the work on the rank that holds the data and send the result, or its error, to all ranks."""
    outcome: Result | HviError | None = None
    if reduced is not None:
        try:
            outcome = work(reduced)
        except HviError as error:
            outcome = error
    outcome = comm.bcast(outcome, root=0)
    if isinstance(outcome, HviError):
        raise outcome
    return cast(Result, outcome)
