"""Nested iteration: each rung of the ladder starts from the solution of the coarser one.

Displacement, active set and branches come with it, so that one or two steps remain on the finest mesh; the
prolongations also build its geometric multigrid. Meshes without a ladder, and small ones, are solved as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from petsc4py import PETSc

from . import building, ladder, solvers
from .scene import Scene
from .solvers.base import Counts, Progress, Solved
from .solvers.branch import BranchIteration
from .system import System
from .timing import Timer

_WORTHWHILE = 20_000
"""Unknowns from which a coarser rung pays."""
_COARSE_TOLERANCE = 1e-4


def solve(scene: Scene, system: System, timer: Timer, progress: Progress, interrupted: Callable[[], bool]) -> Solved:
    """Solve a scene's system, from the coarsest rung up where there is one and the method takes a start. Collective.

    Raises:
        SolverError: a convex step raised the energy.
    """
    coarse = ladder.coarser(scene) if system.dofs >= _WORTHWHILE else None
    if coarse is None or not issubclass(solvers.METHODS[scene.solver.method], BranchIteration):
        return solvers.create(scene.solver, system, timer, progress, interrupted).solve()
    below = building.assemble(_loosened(coarse), system.comm, timer)
    found = solve(_loosened(coarse), below, timer, progress, interrupted)
    with timer("setup"):
        step = ladder.prolongation(system.problem.space, below.problem.space, scene)
    system.prolongations = (step, *below.prolongations)
    start = _prolonged(step, below, found, system) if found.converged else None
    method = solvers.create(scene.solver, system, timer, progress, interrupted)
    result = method.solve(start)
    if start is not None and not result.converged and not result.interrupted:
        result = solvers.create(scene.solver, system, timer, progress, interrupted).solve()
    counts = Counts()
    counts.add(found.counts)
    counts.add(result.counts)
    return replace(result, counts=counts, levels=found.levels + 1)


def _loosened(scene: Scene) -> Scene:
    """The scene at a tolerance that suits a start."""
    tolerance = max(_COARSE_TOLERANCE, scene.solver.tolerance)
    return scene.model_copy(update={"solver": scene.solver.model_copy(update={"tolerance": tolerance})})


def _prolonged(step: PETSc.Mat, below: System, found: Solved, system: System) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective."""
    x = system.load.duplicate()
    step.mult(below.unknowns(found.u), x)
    x.pointwiseMax(x, system.lower)
    x.pointwiseMin(x, system.upper)
    owned = system.problem.fixed[system.problem.fixed < x.local_size]
    x.array[owned] = system.load.array_r[owned]
    return x
