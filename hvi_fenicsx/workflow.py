"""From a scene to a certified solution: domain, problem, existence, solve, certificate, in one direction."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from dolfinx import fem
from mpi4py import MPI

from .certify import certificate, plausibility
from .certify.certificate import Examination
from .certify.estimate.estimator import Estimate, estimate
from .errors import ExitCode, SolverError
from .mesh.domain import Domain
from .mesh.thresholds import Thresholds as MeshThresholds
from .problem.compose import Model
from .problem.problem import Problem
from .rigid import LoadFactors, Solvability
from .runtime.log import logger, newton_step
from .runtime.timing import Timer
from .scene import Scene
from .scene_model import model_of, options_of
from .solvers import nested_iteration
from .solvers.context import Progress, RunControl, never
from .solvers.nested_iteration import CoarseStart, LevelSolution
from .solvers.options import SolverOptions
from .solvers.result import SolveResult
from .solvers.thresholds import Thresholds as SolverThresholds
from .system import existence, free_motions
from .system.assemble import assemble
from .system.levels import Levels
from .system.system import System

_LOG = logger("workflow")


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """The numbers that tune a run.

    Attributes:
        mesh: how mesh hierarchies are made.
        solvers: how systems are solved.
    """

    mesh: MeshThresholds = field(default_factory=MeshThresholds)
    solvers: SolverThresholds = field(default_factory=SolverThresholds)


DEFAULT = Thresholds()


@dataclass(frozen=True, kw_only=True)
class Solution:
    """What a run found.

    Attributes:
        scene: what the user asked for.
        problem: what was solved; its laws are the smoothed ones where the scene smooths.
        solvability: whether a solution can exist.
        solve_result: what the method found, None when the state is *escapes* (nothing was solved).
        examination: the certificate and the state of Γc, None likewise.
        estimate: of the error; None where nothing was certified.
        dofs: unknowns.
        epsilon: relative width of the smoothing, None for exact laws.
        timer: wall time by phase.
        warnings: what is implausible, see :mod:`.plausibility`.
    """

    scene: Scene
    problem: Problem
    solvability: Solvability
    solve_result: SolveResult | None
    examination: Examination | None
    estimate: Estimate | None
    dofs: int
    epsilon: float | None
    timer: Timer
    warnings: tuple[str, ...] = ()

    @property
    def converged(self) -> bool:
        """Certified within the tolerance."""
        return self.examination is not None and self.examination.certificate.passed

    @property
    def exit_code(self) -> int:
        """By the contract: certified, no solution exists, or not converged."""
        if self.converged:
            return ExitCode.CERTIFIED
        if self.solve_result is None:
            return ExitCode.NO_SOLUTION
        return ExitCode.INTERRUPTED if self.solve_result.interrupted else ExitCode.NOT_CONVERGED

    @property
    def reason(self) -> str:
        """Why it ended as it did, in words."""
        if self.solve_result is None:
            return "no solution exists: the load moves the body away"
        if self.converged:
            local = " (a local equilibrium: the state is metastable)" if self.solvability.state == "metastable" else ""
            free = ", ".join(mode.name for mode in self.solvability.free)
            return f"certified{local}" + (f"; determined up to {free}" if free else "")
        if self.solvability.state == "metastable" and not self.solve_result.interrupted:
            return f"metastable, and no equilibrium found ({self.solve_result.reason})"
        unknown = "; whether a solution exists could not be decided" if self.solvability.state == "undecided" else ""
        return f"not certified ({self.solve_result.reason}){unknown}"


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """A scene made into an assembled problem whose existence is known.

    Attributes:
        scene: what the user asked for.
        model: the effects and their places.
        options: how to solve.
        system: the assembled problem.
        solvability: whether a solution can exist.
        timer: wall time by phase.
        warnings: what is implausible so far.
    """

    scene: Scene
    model: Model
    options: SolverOptions
    system: System
    solvability: Solvability
    timer: Timer
    warnings: tuple[str, ...] = ()

    @property
    def problem(self) -> Problem:
        """The problem that is assembled."""
        return self.system.problem

    def load_factors(self, load: str | None = None) -> LoadFactors:
        """Between which factors of a load the body is held, the other loads constant. Collective.

        Args:
            load: None for the whole load; else ``part.traction`` or ``region.force`` (``body.force``), or just the part
                or region.

        Raises:
            InputError: on all ranks alike: there is no such load.
        """
        return existence.load_factors(self.problem, self.system.forces, load)


def prepare(
    scene: Scene,
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
        timer: to go on with.
        domain: the body where its mesh is there already, refined.
        solvability: the verdict on existence, where it is known.
        thresholds: the numbers that tune the run.

    Raises:
        InputError: on all ranks alike.
    """
    timer = timer or Timer()
    options, model = options_of(scene.solver, thresholds.solvers), model_of(scene)
    with timer("mesh"):
        domain = domain or scene.domain.build_hierarchy(comm, scene.dimension, thresholds.mesh)
    system = assemble(domain, model, timer, thresholds.solvers.linear)
    with timer("existence"):
        solvability = solvability or existence.solvability(system.problem, system.forces)
    margin = "" if solvability.margin is None else f", margin {solvability.margin:.3g}"
    _LOG.info("%d unknowns; existence: %s%s", system.dofs, solvability.state, margin)
    with timer("assembly"):
        system.attach_free_motions(solvability.free)
        warnings = plausibility.before_solving(system.problem, system.forces)
    _log_warnings(warnings)
    return Preparation(
        scene=scene,
        model=model,
        options=options,
        system=system,
        solvability=solvability,
        timer=timer,
        warnings=warnings,
    )


def solve(
    scene: Scene,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    progress: Progress = newton_step,
    timer: Timer | None = None,
    thresholds: Thresholds = DEFAULT,
) -> Solution:
    """Solve a scene and certify what was found. Collective.

    Args:
        scene: what to solve.
        comm: the ranks.
        progress: called at each Newton step; by default it is logged.
        timer: to go on with.
        thresholds: the numbers that tune the run.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    return finish(prepare(scene, comm, timer, thresholds=thresholds), progress)


def finish(
    prepared: Preparation, progress: Progress = newton_step, interrupted: Callable[[], bool] = never
) -> Solution:
    """Solve, certificate and estimate of a prepared scene; nothing is solved when no solution exists. Collective.

    Args:
        prepared: the scene.
        progress: called at each Newton step; by default it is logged.
        interrupted: whether to stop (collective, asked at each Newton step).
    """
    return finish_with_levels(prepared, progress, interrupted)[0]


def finish_with_levels(
    prepared: Preparation,
    progress: Progress = newton_step,
    interrupted: Callable[[], bool] = never,
    start: CoarseStart | None = None,
) -> tuple[Solution, Levels]:
    """As :func:`finish`, with the coarser levels that were used, for a mesh that will be refined. Collective.

    Args:
        prepared: the scene.
        progress: called at each Newton step; by default it is logged.
        interrupted: whether to stop (collective, asked at each Newton step).
        start: a solution on a coarser mesh, where the mesh was refined from it.
    """
    found = examination = errors = None
    levels: Levels = ()
    warnings, options = prepared.warnings, prepared.options
    if prepared.solvability.state != "escapes":
        solved = _solved(prepared, RunControl(timer=prepared.timer, progress=progress, interrupted=interrupted), start)
        found, levels = solved.result, solved.levels
        with prepared.timer("certificate"):
            examination = certificate.examine(
                prepared.problem, found.u, options.tolerance, inertia=options.second_order
            )
            implausible = plausibility.of_solution(prepared.problem, examination, found.u)
        _log_warnings(implausible)
        warnings += implausible
        _log_certificate(examination.certificate)
        if examination.certificate.passed:
            with prepared.timer("estimate"):
                errors = estimate(prepared.system, levels, found.u, examination)
    solution = Solution(
        scene=prepared.scene,
        problem=prepared.problem,
        solvability=prepared.solvability,
        solve_result=found,
        examination=examination,
        estimate=errors,
        dofs=prepared.system.dofs,
        epsilon=options.relative_width(prepared.system),
        timer=prepared.timer,
        warnings=warnings,
    )
    return solution, levels


def _log_warnings(warnings: Iterable[str]) -> None:
    for warning in warnings:
        _LOG.warning("%s", warning)


def _log_certificate(found: certificate.Certificate) -> None:
    names = ("equilibrium", "penetration", "tension", "complementarity", "inclusion")
    parts = ", ".join(f"{name} {getattr(found, name):.1e}" for name in names)
    verdict = "passed" if found.passed else "not passed"
    _LOG.info("certificate %s (%g): %s; %s", verdict, found.tolerance, parts, found.second_order)


def _solved(prepared: Preparation, control: RunControl, start: CoarseStart | None) -> LevelSolution:
    system, options, solvability = prepared.system, prepared.options, prepared.solvability
    try:
        if start is not None:
            found = nested_iteration.solve_from_coarser(system, start, solvability, options, control)
        else:
            found = nested_iteration.solve(prepared.model, system, solvability, options, control)
        if system.free_motions is not None:
            free_motions.remove_free_motions(prepared.problem, solvability.free, found.result.u)
        return found
    except SolverError as error:
        u = fem.Function(prepared.problem.space, name="displacement")
        result = SolveResult(u=u, method=options.method, converged=False, reason=str(error))
        return LevelSolution(system=system, levels=start.levels if start else (), result=result)
