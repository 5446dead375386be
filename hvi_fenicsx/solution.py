"""From a scene to a certified solution: domain, problem, existence, solve, certificate, in one direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dolfinx import fem
from mpi4py import MPI

from . import building, certificate, existence, nested, solvers, system
from .certificate import Examined
from .errors import SolverError
from .problem import Problem
from .rigid import Solvability
from .solvers.base import Progress, Solved, silent
from .timing import Timer

if TYPE_CHECKING:
    from .scene import Scene

CERTIFIED, NO_SOLUTION, NOT_CONVERGED, INTERRUPTED = 0, 3, 4, 130
"""Exit codes (design.md, the contract)."""


@dataclass(frozen=True)
class Solution:
    """What a run found.

    Attributes:
        scene, problem: what was solved; the problem's laws are the smoothed ones where the scene smooths.
        solvability: whether a solution can exist.
        solved: what the method found, None when the state is *escapes* (nothing was solved).
        examined: the certificate and the state of Γc, None likewise.
        dofs: unknowns. epsilon: relative width of the smoothing, None for exact laws. timer: wall time by phase.
    """

    scene: Scene
    problem: Problem
    solvability: Solvability
    solved: Solved | None
    examined: Examined | None
    dofs: int
    epsilon: float | None
    timer: Timer

    @property
    def converged(self) -> bool:
        """Certified within the tolerance."""
        return self.examined is not None and self.examined.certificate.passed

    @property
    def exit_code(self) -> int:
        """By the contract: certified, no solution exists, or not converged."""
        if self.converged:
            return CERTIFIED
        if self.solved is None:
            return NO_SOLUTION
        return INTERRUPTED if self.solved.interrupted else NOT_CONVERGED

    @property
    def reason(self) -> str:
        """Why it ended as it did, in words."""
        if self.solved is None:
            return "no solution exists: the load moves the body away"
        if self.converged:
            local = " (a local equilibrium: the state is metastable)" if self.solvability.state == "metastable" else ""
            return f"certified{local}"
        if self.solvability.state == "metastable" and not self.solved.interrupted:
            return f"metastable, and no equilibrium found ({self.solved.reason})"
        return f"not certified ({self.solved.reason})"


@dataclass(frozen=True)
class Prepared:
    """A scene made into a problem, assembled, its existence known."""

    scene: Scene
    problem: Problem
    system: system.System
    solvability: Solvability
    timer: Timer


def prepare(scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, timer: Timer | None = None) -> Prepared:
    """Everything before the solve: mesh, forms, assembly, existence. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    timer = timer or Timer()
    assembled = building.assemble(scene, comm, timer)
    with timer("assembly"):
        verdict = existence.solvability(assembled.problem, assembled.forces)
    return Prepared(scene, assembled.problem, assembled, verdict, timer)


def solve(
    scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, *, progress: Progress = silent, timer: Timer | None = None
) -> Solution:
    """Solve a scene and certify what was found. Collective.

    Raises:
        InputError: the scene does not fit its mesh, on all ranks alike.
    """
    return finish(prepare(scene, comm, timer), progress)


def finish(
    prepared: Prepared, progress: Progress = silent, interrupted: Callable[[], bool] = lambda: False
) -> Solution:
    """The solve and the certificate of a prepared scene; nothing is solved when no solution exists. Collective.

    Args:
        prepared: the scene. progress: see :mod:`.solvers.base`. interrupted: whether to stop (collective, asked often).
    """
    found = examined = None
    if prepared.solvability.state != "escapes":
        found = _solved(prepared, progress, interrupted)
        with prepared.timer("certificate"):
            wanted = prepared.scene.solver
            examined = certificate.examine(prepared.problem, found.u, wanted.tolerance, inertia=wanted.second_order)
    return Solution(
        prepared.scene,
        prepared.problem,
        prepared.solvability,
        found,
        examined,
        prepared.system.dofs,
        solvers.relative_width(prepared.scene.solver, prepared.system),
        prepared.timer,
    )


def _solved(prepared: Prepared, progress: Progress, interrupted: Callable[[], bool]) -> Solved:
    try:
        return nested.solve(prepared.scene, prepared.system, prepared.timer, progress, interrupted)
    except SolverError as error:
        u = fem.Function(prepared.problem.space, name="displacement")
        return Solved(u, prepared.scene.solver.method, False, str(error))
