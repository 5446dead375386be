"""The solution of a scene: what was solved, what was found, and how far it is certified."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..certify import placed_forces
from ..certify.certificate import Certificate, Examination
from ..certify.placed_forces import PlacedForces
from ..certify.uniqueness import Uniqueness
from ..errors import ExitCode
from ..estimate.estimator import Estimate
from ..model import Model
from ..problem.problem import Problem
from ..rigid import Solvability
from ..runtime.cost import Timer
from ..solvers.method import SolveResult
from ..solvers.obstacle_force import PressedObstacle


@dataclass(frozen=True, kw_only=True)
class LastBorne:
    """That a solution is the last state that is borne, since none was found under the whole load.

    Attributes:
        factor: of all loads and prescribed displacements.
        whole_load: what was found under the whole load.
    """

    factor: float
    whole_load: Solution


@dataclass(frozen=True, kw_only=True)
class Solution:
    """What a run found.

    Attributes:
        scene: what the user asked for.
        problem: what was solved; its laws are the smoothed ones where the scene smooths.
        solvability: whether a solution can exist.
        solve_result: what the method found; None where the state is *escapes* and nothing was solved.
        examination: the certificate and the state of Γc; None likewise.
        estimate: of the error; None where nothing was certified.
        dofs: unknowns.
        epsilon: relative width of the smoothing, None for exact laws.
        timer: wall time by phase.
        uniqueness: what is known about other equilibria; None where nothing was certified, or it was found elsewhere.
        warnings: sentences about numbers that may be mistakes (:mod:`..certify.plausibility`).
        last_borne: where none was found under the whole load, and problem, displacement and examination are those of
            the last state that is borne.
        obstacle: the one that a force presses, and whether contact bears it; None without one.
    """

    scene: Model
    problem: Problem
    solvability: Solvability
    solve_result: SolveResult | None
    examination: Examination | None
    estimate: Estimate | None
    dofs: int
    epsilon: float | None
    timer: Timer
    warnings: tuple[str, ...] = ()
    uniqueness: Uniqueness | None = None
    last_borne: LastBorne | None = None
    obstacle: PressedObstacle | None = None

    @property
    def certificate(self) -> Certificate | None:
        """How far the conditions of a solution under the whole load are met; None where nothing was solved.

        The same on all ranks; not collective.
        """
        if self.last_borne is not None:
            return self.last_borne.whole_load.certificate
        return None if self.examination is None else self.examination.certificate

    @property
    def converged(self) -> bool:
        """Certified within the tolerance, under the whole load; the same on all ranks, not collective."""
        borne = self.obstacle is None or self.obstacle.passed
        return borne and self.certificate is not None and self.certificate.passed

    @property
    def exit_code(self) -> int:
        """By the contract: certified, no solution exists, or not converged; not collective."""
        if self.converged:
            return ExitCode.CERTIFIED
        if self.solve_result is None:
            return ExitCode.NO_SOLUTION
        return ExitCode.INTERRUPTED if self.solve_result.interrupted else ExitCode.NOT_CONVERGED

    @property
    def reason(self) -> str:
        """Why it ended, for people; the same on all ranks, not collective."""
        if self.last_borne is not None:
            shown = f"the last state that is borne is shown, at load factor {self.last_borne.factor:.6g}"
            return f"{self.last_borne.whole_load.reason}; {shown}"
        if self.solve_result is None:
            return "no solution exists: the load moves the body away"
        if self.converged:
            free = ", ".join(mode.name for mode in self.solvability.free)
            return f"certified{self._which}" + (f"; determined up to {free}" if free else "")
        if self.solvability.state == "metastable" and not self.solve_result.interrupted:
            return f"metastable, and no equilibrium found ({self.solve_result.reason})"
        unknown = "; whether a solution exists could not be decided" if self.solvability.state == "undecided" else ""
        return f"not certified ({self.solve_result.reason}){unknown}"

    @property
    def _which(self) -> str:
        """Which equilibrium it is, in brackets, where that is not plain."""
        local = "a local equilibrium: the state is metastable" if self.solvability.state == "metastable" else ""
        off = self.solve_result.off_path if self.solve_result else None
        path = f"loading leads to it by a jump, if at all: {off}" if off else ""
        said = "; ".join(part for part in (local, path) if part)
        return f" ({said})" if said else ""

    @cached_property
    def forces(self) -> PlacedForces | None:
        """What acts on the body, place by place, nondimensional; None where nothing was solved.

        Collective when first used.
        """
        if self.solve_result is None or self.examination is None:
            return None
        found = self.examination
        reactions = placed_forces.reactions(self.problem, self.solve_result.u, found.forces, found.states)
        return PlacedForces(placed_forces.loads(self.problem), reactions)
