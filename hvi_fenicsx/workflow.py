"""From a scene to a certified solution: domain, problem, existence, solve, certificate, in one direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dolfinx import fem
from mpi4py import MPI

from .certify import certificate, plausibility
from .certify.certificate import Examination
from .certify.estimate.estimator import Estimate, estimate
from .errors import ExitCode, SolverError
from .mesh.domain import Domain
from .problem.problem import Problem
from .rigid import LoadFactors, Solvability
from .runtime.timing import Timer
from .solvers import nested_iteration, registry
from .solvers.method import Progress, SolveResult, silent
from .system import assemble, existence, free_motions, system

if TYPE_CHECKING:
    from .scene import Scene


@dataclass(frozen=True)
class Solution:
    """What a run found.

    Attributes:
        scene, problem: what was solved; the problem's laws are the smoothed ones where the scene smooths.
        solvability: whether a solution can exist.
        solved: what the method found, None when the state is *escapes* (nothing was solved).
        examination: the certificate and the state of Γc, None likewise.
        estimate: of the error; None where nothing was certified.
        dofs: unknowns. epsilon: relative width of the smoothing, None for exact laws. timer: wall time by phase.
        warnings: what looks odd, see :mod:`.plausibility`.
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


@dataclass(frozen=True)
class Prepared:
    """A scene made into a problem, assembled, its existence known; ``warnings``: what looks odd so far."""

    scene: Scene
    problem: Problem
    system: system.System
    solvability: Solvability
    timer: Timer
    warnings: tuple[str, ...] = ()

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
    body: Domain | None = None,
    verdict: Solvability | None = None,
) -> Prepared:
    """Everything before the solve: mesh, forms, assembly, existence. Collective.

    Args:
        scene: what to solve. comm: the ranks. timer: to go on with.
        body: the domain where it is there already, refined. verdict: on existence, where it is known.

    Raises:
        InputError: on all ranks alike.
    """
    timer = timer or Timer()
    assembled = assemble.assemble(scene, comm, timer, body)
    with timer("existence"):
        verdict = verdict or existence.solvability(assembled.problem, assembled.forces)
    with timer("assembly"):
        assembled.release(verdict.free)
        odd = plausibility.foreseen(assembled.problem, assembled.forces)
    return Prepared(scene, assembled.problem, assembled, verdict, timer, odd)


def solve(
    scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, *, progress: Progress = silent, timer: Timer | None = None
) -> Solution:
    """Solve a scene and certify what was found. Collective.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    return finish(prepare(scene, comm, timer), progress)


def finish(
    prepared: Prepared,
    progress: Progress = silent,
    interrupted: Callable[[], bool] = lambda: False,
    below: nested_iteration.Rung | None = None,
) -> Solution:
    """Solve, certificate and estimate of a prepared scene; nothing is solved when no solution exists. Collective.

    Args:
        prepared: the scene. progress: see :mod:`.method`. interrupted: whether to stop (collective, asked often).
        below: a coarser rung to start from, where the mesh was refined.
    """
    found = examination = errors = None
    odd = prepared.warnings
    if prepared.solvability.state != "escapes":
        found = _solved(prepared, progress, interrupted, below)
        with prepared.timer("certificate"):
            wanted = prepared.scene.solver
            examination = certificate.examine(prepared.problem, found.u, wanted.tolerance, inertia=wanted.second_order)
            odd += plausibility.found(prepared.problem, examination, found.u)
        if examination.certificate.passed:
            with prepared.timer("estimate"):
                errors = estimate(prepared.system, found.u, examination)
    return Solution(
        prepared.scene,
        prepared.problem,
        prepared.solvability,
        found,
        examination,
        errors,
        prepared.system.dofs,
        registry.relative_width(prepared.scene.solver, prepared.system),
        prepared.timer,
        odd,
    )


def _solved(
    prepared: Prepared, progress: Progress, interrupted: Callable[[], bool], below: nested_iteration.Rung | None
) -> SolveResult:
    scene, assembled, timer = prepared.scene, prepared.system, prepared.timer
    try:
        if below is not None:
            found = nested_iteration.ascend(scene, assembled, below, timer, progress, interrupted)
        else:
            found = nested_iteration.solve(scene, assembled, timer, progress, interrupted)
        if assembled.freedom is not None:
            free_motions.settle(prepared.problem, prepared.solvability.free, found.u)
        return found
    except SolverError as error:
        u = fem.Function(prepared.problem.space, name="displacement")
        return SolveResult(u, prepared.scene.solver.method, False, str(error))
