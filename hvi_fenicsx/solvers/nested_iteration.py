"""Nested iteration: each rung of the ladder starts from the solution of the coarser one.

Displacement, active set and branches come with it, so that one or two steps remain on the finest mesh; the
prolongations also build its geometric multigrid. Meshes without a ladder, and small ones, are solved as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from petsc4py import PETSc

from ..mesh import transfer
from ..mesh.domain import Refinement
from ..runtime.timing import Timer
from ..scene import Scene
from ..system import assemble
from ..system.coarser_level import Below
from ..system.held_solver import LinearSettings
from ..system.system import System
from . import registry
from .method import Counts, Progress, SolveResult
from .quadratic import LinearSolve

_WORTHWHILE = 5_000
"""Unknowns from which a coarser rung pays."""
_COARSE_TOLERANCE = 1e-4


def coarser(scene: Scene, system: System) -> Scene | None:
    """The scene one rung below; None where there is none, or where it would not pay."""
    if system.dofs < _WORTHWHILE:
        return None
    return scene if system.problem.domain.origin else transfer.coarser(scene)


def linear(scene: Scene, system: System) -> LinearSettings:
    """How the scene's linear systems will be solved: by multigrid where a ladder is climbed."""
    kind = registry.choose(scene.solver, system)
    climbed = coarser(scene, system) is not None and (kind.takes_start or kind is LinearSolve)
    return LinearSettings.choose(system, scene.solver.linear_solver, ladder=climbed)


def solve(
    scene: Scene, system: System, timer: Timer, progress: Progress, interrupted: Callable[[], bool]
) -> SolveResult:
    """Solve a scene's system, from the coarsest rung up where there is one and the method takes a start. Collective.

    Raises:
        SolverError: a convex step raised the energy.
    """
    coarse = coarser(scene, system)
    kind = registry.choose(scene.solver, system)
    if coarse is not None and kind is LinearSolve:
        system.below = hierarchy(scene, system, timer)
    if coarse is None or not kind.takes_start:
        return registry.create(scene.solver, system, timer, progress, interrupted).solve()
    below, nesting = _assembled(_loosened(coarse), scene, system, timer)
    below.release(system.freedom.modes if system.freedom else ())
    found = solve(_loosened(coarse), below, timer, progress, interrupted)
    with timer("setup"):
        system.below = Below(below, transfer.between(system, below, nesting))
    return ascend(scene, system, (below, found, system.below.prolongation), timer, progress, interrupted)


Rung = tuple[System, SolveResult, PETSc.Mat]
"""The next coarser rung, its solution, and the prolongation from its unknowns (:func:`.transfer.between`)."""


def ascend(
    scene: Scene, system: System, rung: Rung, timer: Timer, progress: Progress, interrupted: Callable[[], bool]
) -> SolveResult:
    """Solve a scene's system from the solution on the rung below. Collective.

    Raises:
        SolverError: a convex step raised the energy.
    """
    below, found, step = rung
    wanted = found.converged and registry.choose(scene.solver, system).takes_start
    start = _prolonged(step, below, found, system) if wanted else None
    method = registry.create(scene.solver, system, timer, progress, interrupted, steady=found.steady)
    result = method.solve() if start is None else method.solve(start)
    if start is not None and not result.converged and not result.interrupted:
        result = registry.create(scene.solver, system, timer, progress, interrupted).solve()
    counts = Counts()
    counts.add(found.counts)
    counts.add(result.counts)
    steady = result.steady and (found.steady or found.levels == 1)  # one rung that was is no sign yet
    return replace(result, counts=counts, levels=found.levels + 1, steady=steady)


def hierarchy(scene: Scene, system: System, timer: Timer) -> Below | None:
    """The rungs below for the multigrid of an equation, which needs no start. Collective."""
    coarse = coarser(scene, system)
    if coarse is None:
        return None
    below, nesting = _assembled(coarse, scene, system, timer)
    below.below = hierarchy(coarse, below, timer)
    with timer("setup"):
        return Below(below, transfer.between(system, below, nesting))


def _assembled(coarse: Scene, scene: Scene, system: System, timer: Timer) -> tuple[System, Scene | Refinement | None]:
    """The system one rung below that of a scene, and how their meshes are nested. Collective."""
    body, nesting = system.problem.domain.origin or (None, scene)
    return assemble.assemble(coarse, system.comm, timer, body), nesting


def _loosened(scene: Scene) -> Scene:
    """The scene at a tolerance that suits a start."""
    tolerance = max(_COARSE_TOLERANCE, scene.solver.tolerance)
    return scene.with_solver(tolerance=tolerance)


def _prolonged(step: PETSc.Mat, below: System, found: SolveResult, system: System) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective."""
    x = system.load.duplicate()
    step.mult(below.unknowns(found.u), x)
    x.scale(below.problem.scales.displacement / system.problem.scales.displacement)
    x.pointwiseMax(x, system.lower)
    x.pointwiseMin(x, system.upper)
    system.prescribe(x)
    return x
