"""A scene prepared, up to existence, then solved, certified and estimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from dolfinx import fem
from mpi4py import MPI

from ..certify import certificate, plausibility
from ..certify.certificate import Examination
from ..certify.uniqueness import uniqueness
from ..errors import SolverError
from ..estimate import estimator
from ..estimate.estimator import estimate
from ..mesh import nodes
from ..mesh.domain import Domain, check_affordable
from ..model import Model
from ..model.content import SolverTable
from ..problem.compose import Formulation
from ..problem.problem import Problem
from ..rigid import LoadFactors, Solvability
from ..runtime.cost import Timer
from ..runtime.log import logger, newton_step, warn
from ..solvers import frozen_mixity, nested_iteration, obstacle_force
from ..solvers.method import Progress, SolveResult, SolveTask, checked, decides_stability, never, relative_width
from ..solvers.nested_iteration import CoarseStart, LevelSolution
from ..solvers.obstacle_force import PressedObstacle
from ..system import existence, rigid_motions
from ..system.multigrid import Levels
from ..system.system import System, assemble
from ..system.thresholds import DEFAULT, Thresholds
from .solution import Solution

_PREPARED = logger("preparation")
_LOG = logger("workflow")


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """A scene as an assembled problem, before the solve.

    Attributes:
        scene: what the user asked for.
        model: the effects and their places.
        options: how to solve.
        system: the assembled problem.
        solvability: whether a solution can exist.
        timer: wall time by phase.
        warnings: sentences about numbers that may be mistakes, as far as they are known before the solve.
    """

    scene: Model
    model: Formulation
    options: SolverTable
    system: System
    solvability: Solvability
    timer: Timer
    warnings: tuple[str, ...] = ()

    @property
    def problem(self) -> Problem:
        """The problem that is assembled."""
        return self.system.problem

    def task(self, progress: Progress = newton_step, interrupted: Callable[[], bool] = never) -> SolveTask:
        """What is to be solved, and how.

        Args:
            progress: called at each Newton step; by default it is logged.
            interrupted: whether to stop (collective, asked at each Newton step).
        """
        return SolveTask(
            model=self.model,
            solvability=self.solvability,
            options=self.options,
            timer=self.timer,
            progress=progress,
            interrupted=interrupted,
        )

    def load_factors(self, *loads: str) -> LoadFactors:
        """Between which factors of some loads together the body is held, the others constant. Collective.

        Args:
            loads: ``part.traction`` or ``region.force`` (``body.force``), or just the part or region; none for the
                whole load.

        Raises:
            InputError: on all ranks alike: there is no such load.
        """
        return existence.load_factors(self.problem, self.system.forces, *loads)


def prepare(
    scene: Model,
    comm: MPI.Comm = MPI.COMM_WORLD,
    timer: Timer | None = None,
    domain: Domain | None = None,
    solvability: Solvability | None = None,
    thresholds: Thresholds = DEFAULT,
) -> Preparation:
    """Everything before the solve: mesh, forms, assembly, existence. Collective.

    Args:
        scene: what to solve.
        comm: the ranks.
        timer: where time goes; by default a new one.
        domain: the body on its mesh, where that exists already; by default it is meshed.
        solvability: whether a solution can exist, where that is known.
        thresholds: the numbers that tune the solvers.

    Raises:
        InputError: on all ranks alike.
    """
    timer = timer or Timer()
    options, model = checked(scene.solver), scene.formulation()
    with timer("mesh"):
        domain = domain or _meshed(scene, comm)
    system = assemble(domain, model, timer, thresholds)
    with timer("existence"):
        solvability = solvability or existence.solvability(system.problem, system.forces)
    margin = "" if solvability.margin is None else f", margin {solvability.margin:.3g}"
    _PREPARED.info("%d unknowns; existence: %s%s", system.dofs, solvability.state, margin)
    with timer("assembly"):
        system.attach_free_motions(solvability.loose)
        warnings = _warnings(scene, system, solvability)
    return Preparation(
        scene=scene,
        model=model,
        options=options,
        system=system,
        solvability=solvability,
        timer=timer,
        warnings=warnings,
    )


def _meshed(scene: Model, comm: MPI.Comm) -> Domain:
    """The body on its mesh; each shape knows what its own vertices take, but neither other bodies nor the degree."""
    domain, degree = scene.domain.build_hierarchy(comm, scene.dimension), scene.solver.degree or 1
    place, mend = ("solver.degree", "use degree 1, or fewer cells") if degree > 1 else ("domain", "use fewer cells")
    unknowns = domain.dimension * nodes.count(domain.mesh, degree)
    check_affordable(comm, unknowns, domain.dimension, place, mend)
    return domain


def _warnings(scene: Model, system: System, solvability: Solvability) -> tuple[str, ...]:
    """Warnings about numbers that may be mistakes, logged. Collective."""
    found = (
        *scene.domain.implausible(system.problem.domain.length),
        *plausibility.before_solving(system.problem, system.forces),
        *plausibility.of_existence(solvability),
    )
    warn(_PREPARED, found)
    return found


def solve(
    scene: Model,
    comm: MPI.Comm = MPI.COMM_WORLD,
    timer: Timer | None = None,
    thresholds: Thresholds = DEFAULT,
) -> Solution:
    """Solve a scene and certify what was found. Collective.

    Args:
        scene: what to solve.
        comm: the ranks.
        timer: where time goes; by default a new one.
        thresholds: the numbers that tune the solvers.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    return finish(prepare(scene, comm, timer, thresholds=thresholds))


def finish(
    prepared: Preparation,
    interrupted: Callable[[], bool] = never,
    start: fem.Function | None = None,
    *,
    estimating: bool = True,
) -> Solution:
    """Solve a prepared scene, certify and estimate; nothing is solved where no solution exists. Collective.

    Args:
        prepared: the scene.
        interrupted: whether to stop (collective, asked at each Newton step).
        start: a displacement on the same mesh to begin at, m.
        estimating: whether to estimate the error, which takes about as long as the solve.
    """
    found = find_solution(prepared, interrupted=interrupted, start=start)
    solution = found.estimated() if estimating else found.solution
    found.free_levels()
    return solution


@dataclass(frozen=True, kw_only=True)
class FoundSolution:
    """What was found of a prepared scene, before its error is estimated.

    Attributes:
        prepared: the scene, with the system that was solved last.
        solution: what was found, with its certificate.
        levels: the coarser levels that were used, for a mesh that will be refined.
    """

    prepared: Preparation
    solution: Solution
    levels: Levels

    def estimated(self, interrupted: Callable[[], bool] = never) -> Solution:
        """The solution with an estimate of its error, where one can be given. Collective.

        It takes about as long as the solve.

        Args:
            interrupted: whether to stop (collective); then nothing is estimated.
        """
        prepared, found = self.prepared, self.solution
        if found.solve_result is None or found.examination is None or not prepared.problem.has_potential:
            return found
        if not found.examination.certificate.passed or interrupted():
            return found
        with prepared.timer("estimate"):
            errors = estimate(prepared.system, self.levels, found.solve_result.u, found.examination)
        return replace(found, estimate=errors, warnings=found.warnings + estimator.warnings(errors))

    def free(self) -> None:
        """Free the systems, and what solving them has left. Collective."""
        self.free_levels()
        self.prepared.system.free()

    def free_levels(self) -> None:
        """Free the systems of the coarser levels. Collective."""
        for level in reversed(self.levels):
            level.free()


def find_solution(
    prepared: Preparation,
    progress: Progress = newton_step,
    interrupted: Callable[[], bool] = never,
    start: CoarseStart | fem.Function | None = None,
) -> FoundSolution:
    """As :func:`finish`, up to the certificate. Collective.

    Args:
        prepared: the scene.
        progress: called at each Newton step; by default it is logged.
        interrupted: whether to stop (collective, asked at each Newton step).
        start: a solution on a coarser mesh, where the mesh was refined from it; or a displacement on the same mesh, m.
    """
    if prepared.solvability.state == "escapes":
        return FoundSolution(prepared=prepared, solution=unsolved(prepared), levels=())
    with prepared.timer("solve"):
        solved, obstacle = _solved(prepared, prepared.task(progress, interrupted), start)
    prepared, result = replace(prepared, system=solved.system), solved.result
    found = replace(certified(prepared, result), obstacle=obstacle)
    if found.examination is not None and found.examination.certificate.passed:
        with prepared.timer("certificate"):
            found = replace(found, uniqueness=uniqueness(prepared.system, result.u, found.examination))
    return FoundSolution(prepared=prepared, solution=found, levels=solved.levels)


def certified(prepared: Preparation, found: SolveResult) -> Solution:
    """A displacement that was found elsewhere, certified; no error is estimated, no other one excluded. Collective.

    Args:
        prepared: the scene.
        found: the displacement.
    """
    with prepared.timer("certificate"):
        examination = examine(prepared, prepared.problem, found.u)
        warnings = plausibility.of_solution(prepared.problem, examination, found.u)
    warn(_LOG, warnings)
    proof = examination.certificate
    verdict = "passed" if proof.passed else "not passed"
    _LOG.info("certificate %s (%g): %s", verdict, proof.tolerance, proof)
    solution = unsolved(prepared)
    return replace(solution, solve_result=found, examination=examination, warnings=solution.warnings + tuple(warnings))


def examine(prepared: Preparation, problem: Problem, u: fem.Function) -> Examination:
    """What the certificate says of a displacement. Collective.

    Args:
        prepared: the scene.
        problem: that of the scene, or at another factor.
        u: nondimensional, ghosts updated.
    """
    options = prepared.options
    inertia = decides_stability(options, prepared.system)
    return certificate.examine(problem, u, options.tolerance, inertia=inertia)


def unsolved(prepared: Preparation) -> Solution:
    """A scene of which nothing was solved, or no single solution is meant.

    Args:
        prepared: the scene.
    """
    return Solution(
        scene=prepared.scene,
        problem=prepared.problem,
        solvability=prepared.solvability,
        solve_result=None,
        examination=None,
        estimate=None,
        dofs=prepared.system.dofs,
        epsilon=relative_width(prepared.options, prepared.system),
        timer=prepared.timer,
        warnings=prepared.warnings,
    )


def _solved(
    prepared: Preparation, task: SolveTask, start: CoarseStart | fem.Function | None
) -> tuple[LevelSolution, PressedObstacle | None]:
    """What the method found, zero where it broke down; and where an obstacle is that a force presses. Collective."""
    system, options, obstacle = prepared.system, prepared.options, None
    try:
        if obstacle_force.pressed(prepared.problem) is not None:
            found, obstacle = obstacle_force.ObstacleForceSolve(task, system).solve(start)
        elif isinstance(start, CoarseStart):
            found = nested_iteration.solve_from_coarser(task, system, start)
        elif start is not None:
            found = nested_iteration.solve_from_displacement(task, system, start)
        else:
            found = nested_iteration.solve(task, system)
        found = frozen_mixity.settled(task, found)
        if system.free_motions is not None:
            rigid_motions.remove_free_motions(prepared.problem, prepared.solvability.free, found.result.u)
        return found, obstacle
    except SolverError as error:
        u = fem.Function(prepared.problem.space, name="displacement")
        result = SolveResult(u=u, method=options.method, converged=False, reason=str(error))
        levels = start.levels if isinstance(start, CoarseStart) else ()
        nothing = obstacle_force.unsolved(prepared.problem, options.tolerance)
        return LevelSolution(system=system, levels=levels, result=result), nothing
