"""Solve to a given accuracy: mesh, ε and tolerances follow from the estimated error."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from mpi4py import MPI

from ..errors import ExitCode
from ..mesh import nodes
from ..mesh.domain import Domain
from ..model import Model
from ..runtime import cost
from ..runtime.mpi import largest
from ..workflow import Solution
from . import adaptive, quantities
from .adaptive import CONTROL, AdaptiveLevel, AdaptiveSolver, AdaptiveStep, ControlThresholds
from .quantity_base import Quantity

_INTERRUPTED = "interrupted"
_LARGEST = 2**31 - 1
"""Unknowns that PETSc's default integers can number."""


def solve_to_goal(
    scene: Model,
    comm: MPI.Comm,
    goal: Goal,
    solver: AdaptiveSolver,
    report: Callable[[str], None],
    thresholds: ControlThresholds = CONTROL,
) -> AccuracyResult:
    """Refine until the goal is reached, or cannot be. Collective.

    Where the scene states no degree it is 2; 1 for a quantity that is compared from mesh to mesh.

    Args:
        scene: what to solve; its mesh sets where to begin (:func:`.adaptive.coarsest`), its ε is the largest.
        comm: the ranks.
        goal: what is asked for.
        solver: timer, progress and interruption.
        report: called with a line about each mesh.
        thresholds: how mesh and smoothing follow from the error.

    Raises:
        InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
    """
    degree = scene.solver.degree or (2 if quantities.find(goal.quantity).estimated else 1)
    run = AdaptiveRun(
        scene=scene.with_solver(degree=degree), goal=goal, solver=solver, report=report, thresholds=thresholds
    )
    found = run.finish(solver.first_domain(scene, comm))
    return replace(found, solution=replace(found.solution, scene=scene))


@dataclass(kw_only=True)
class AdaptiveRun:
    """One run to a goal. Everything it decides on is the same on all ranks.

    Attributes:
        scene: what to solve; its ε is the largest.
        goal: what is asked for.
        solver: timer, progress and interruption.
        report: called with a line about each mesh.
        thresholds: how mesh and smoothing follow from the error.
        steps: the meshes whose error is known.
    """

    scene: Model
    goal: Goal
    solver: AdaptiveSolver
    report: Callable[[str], None]
    thresholds: ControlThresholds = CONTROL
    steps: list[AdaptiveStep] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.elements = Elements(dimension=self.scene.dimension, degree=self.scene.solver.degree or 1)
        self.quantity = quantities.find(self.goal.quantity)()
        self.solver = replace(self.solver, existence=self.quantity.needs_existence)
        self.balance = ErrorBalance(
            accuracy=self.goal.accuracy, quantity=self.quantity, elements=self.elements, thresholds=self.thresholds
        )
        self._failures = 0
        self._estimated: AdaptiveLevel | None = None

    def finish(self, domain: Domain) -> AccuracyResult:
        """Refine the coarsest mesh that sees the data until the goal is reached, or cannot be. Collective.

        Args:
            domain: the body on the first mesh (:meth:`.AdaptiveSolver.first_domain`).
        """
        self.comm, start = domain.mesh.comm, time.perf_counter()
        self.room = cost.memory_room(self.comm) - cost.peak_memory(self.comm)
        level = self.solver.begin(adaptive.coarsest(self.scene), domain, self.thresholds)
        why = self._record(level, start)
        while why is None and not (self._known and self.steps[-1].error <= self.goal.accuracy):
            start, stopped = time.perf_counter(), self._estimated is not None and self.solver.interrupted()
            found = _INTERRUPTED if stopped else self._next(level)
            if isinstance(found, str):
                why = found
            elif self._estimated is not None and _is_stopped(found):
                why = _INTERRUPTED
            else:
                level, why = found, self._record(found, start)
        if why == _INTERRUPTED and self._estimated is not None:  # the last mesh with an error is given
            level = self._estimated
            self.report(why)
        return AccuracyResult(
            goal=self.goal,
            level=level,
            solution=level.solution,
            degree=self.elements.degree,
            steps=tuple(self.steps),
            why=why,
            interrupted=why is not None and self.solver.interrupted(),
        )

    @property
    def _known(self) -> bool:
        """Whether the last mesh has an error."""
        return bool(self.steps) and not self._failures

    def _record(self, level: AdaptiveLevel, start: float) -> str | None:
        """Record a level; why to stop at it, or None. Collective."""
        solution = level.solution
        if solution.solve_result is None or solution.solve_result.interrupted:
            return solution.reason
        self.quantity.add(level)
        if solution.estimate is None and solution.converged:
            return "the error of a law whose energy of separation depends on the mode is not estimated"
        if solution.estimate is None:
            self._failures += 1
            self.report(f"{level.dofs:,} unknowns: {solution.reason}")
            return solution.reason if self._failures >= self.thresholds.failures else None
        self._failures, self._estimated = 0, level
        self.steps.append(self._step(level, largest(self.comm, time.perf_counter() - start)))
        self.report(_line(len(self.steps), self.steps[-1], self.solver.timer.total))
        return None

    def _step(self, level: AdaptiveLevel, seconds: float) -> AdaptiveStep:
        estimate = level.solution.estimate
        assert estimate is not None
        norm, smoothing = estimate.energy_norm or 1.0, self.quantity.smoothing()
        return AdaptiveStep(
            dofs=level.dofs,
            error=self.quantity.error(),
            discretisation=estimate.discretisation / norm,
            smoothing=smoothing,
            algebraic=estimate.algebraic / norm,
            epsilon=level.solution.epsilon,
            tolerance=level.solution.scene.solver.tolerance,
            seconds=seconds,
            memory=cost.peak_memory(self.comm),
        )

    def _next(self, level: AdaptiveLevel) -> AdaptiveLevel | str:
        """The next level, or why there is none. Collective."""
        if self._known and math.isfinite(error := self.steps[-1].error):
            needed = self.elements.needed(level.dofs, error / self.goal.accuracy, self.quantity)
            if too_many := self._too_many(needed):
                return too_many
        scene = level.solution.scene
        if self.steps:
            scene = self.balance.next_scene(scene, self.steps[-1])
        if self._known and self.balance.mesh_suffices(self.steps):
            return self.solver.again(level, scene)
        refined = adaptive.refined(level, self.balance.bulk(self.steps[-1] if self._known else None))
        unknowns = refined.domain.dimension * nodes.count(refined.domain.mesh, self.elements.degree)
        return self._too_many(unknowns) or self.solver.refine(level, refined, scene, self.quantity.ahead())

    def _too_many(self, dofs: float) -> str | None:
        """Why so many unknowns cannot be solved for; None where they can."""
        needed = self.elements.memory(dofs)
        if dofs <= _LARGEST and needed <= self.room:
            return None
        if not math.isfinite(dofs):
            return f"{self.goal.accuracy:g} is beyond any number of unknowns"
        return (
            f"{self.goal.accuracy:g} would need {dofs:.1e} unknowns or more and {needed / 1024:.3g} GB; "
            f"{self.room / 1024:.3g} GB can be used"
        )


def _is_stopped(level: AdaptiveLevel) -> bool:
    """Whether a solve was stopped by a signal."""
    result = level.solution.solve_result
    return result is not None and result.interrupted


def _line(level: int, step: AdaptiveStep, elapsed: float) -> str:
    width = "" if step.epsilon is None else f", ε {step.epsilon:.2g}"
    error = f"error {step.error:.2e}" if math.isfinite(step.error) else "no error yet"
    return (
        f"mesh {level}: {step.dofs:,} unknowns, {error} (energy norm: mesh {step.discretisation:.1e}, smoothing "
        f"{step.smoothing:.1e}, solver {step.algebraic:.1e}), tolerance {step.tolerance:.0e}{width}, {elapsed:.1f} s"
    )


@dataclass(frozen=True, kw_only=True)
class Elements:
    """What elements are refined.

    Attributes:
        dimension: d, 2 or 3.
        degree: p, 1 or 2.
    """

    dimension: int
    degree: int = 1

    def memory(self, dofs: float) -> float:
        """What so many unknowns take, about, on meshes refined where the error is, MB."""
        return cost.memory_of_all_meshes(dofs, self.dimension, self.degree)

    def needed(self, dofs: int, times: float, quantity: Quantity) -> float:
        """The unknowns that an error so many times smaller takes, at the best rate of convergence.

        Args:
            dofs: unknowns now.
            times: the error now over the one wanted.
            quantity: whose error it is.
        """
        rate = quantity.power_of_energy * self.degree / self.dimension
        with np.errstate(over="ignore"):
            return float(dofs * np.maximum(1.0, np.float64(times)) ** (1.0 / rate))


@dataclass(frozen=True, kw_only=True)
class ErrorBalance:
    """The balance between the three parts of the error.

    The mesh has the largest part; smoothing and solver get what is small beside it.

    Attributes:
        accuracy: what is asked for, relative.
        quantity: the target quantity.
        elements: that are refined.
        thresholds: how the parts are balanced.
    """

    accuracy: float
    quantity: Quantity
    elements: Elements
    thresholds: ControlThresholds = CONTROL

    def bulk(self, last: AdaptiveStep | None) -> float:
        """Part of the squared error to refine: no more than the aim needs.

        In space, and on Γc, where errors fall as the square of the energy norm's, a smaller part goes as far.

        Args:
            last: the last step; None where no error is known.
        """
        on_contact = self.quantity.known_from_one_mesh and not self.quantity.in_energy_norm
        most = self.thresholds.bulk ** (1 if self.elements.dimension == 2 and not on_contact else 2)
        mesh, smoothing, _ = (0.0, 0.0, 0.0) if last is None else self.quantity.parts(last)
        if not self.quantity.known_from_one_mesh or mesh <= 0.0:
            return most
        left = self._beside(smoothing) / mesh
        # Halving the edges of marked cells leaves 4^-p of it.
        needed = (1 - (left**2 if self.quantity.in_energy_norm else left)) / (1 - 0.25**self.elements.degree)
        return min(needed, most) if needed > 0.0 else most

    def _beside(self, part: float) -> float:
        """The largest error beside a part with which both together are no larger than the aim."""
        return math.sqrt(max((self.thresholds.aim * self.accuracy) ** 2 - part**2, 0.0))

    def mesh_suffices(self, steps: Sequence[AdaptiveStep]) -> bool:
        """Whether the next step must change ε or the tolerance, and not the mesh.

        Args:
            steps: all steps so far, one at least.
        """
        mesh, smoothing, algebraic = self.quantity.parts(steps[-1])
        if smoothing > max(mesh, self._allowed_smoothing(mesh)):
            return self._smoothing_falls(steps)
        wanted = self.thresholds.aim * self.accuracy
        return mesh <= wanted < max(smoothing, algebraic) * 2

    @staticmethod
    def _smoothing_falls(steps: Sequence[AdaptiveStep]) -> bool:
        """Whether a smaller ε on the same mesh, where the last step tried it, made smoothing's part smaller."""
        last, before = steps[-1], steps[-2] if len(steps) > 1 else None
        return before is None or before.dofs != last.dofs or last.smoothing < 0.99 * before.smoothing

    def _allowed_smoothing(self, mesh: float) -> float:
        """The error that smoothing may cause: a part of the accuracy, or all that a fine enough mesh leaves."""
        return max(self.thresholds.smoothing * self.accuracy, self._beside(mesh))

    def next_scene(self, scene: Model, last: AdaptiveStep) -> Model:
        """The scene with the ε and the tolerance of the next step.

        Args:
            scene: of the last step.
            last: the last step.
        """
        mesh, smoothing, _ = self.quantity.parts(last)
        solver, values = scene.solver, dict[str, float]()
        if smoothing > self._allowed_smoothing(mesh):
            widths = {name: getattr(solver, name) for name in ("epsilon", "epsilon_absolute")}
            values = {name: self.thresholds.smoothing * width for name, width in widths.items() if width is not None}
        if 10 * last.algebraic > max(last.discretisation, self.accuracy):
            values["tolerance"] = solver.tolerance / 10
        return scene.with_solver(**values)


@dataclass(frozen=True)
class Goal:
    """What is asked for.

    Attributes:
        accuracy: relative error.
        quantity: name of the target quantity.
    """

    accuracy: float
    quantity: str = "energy"

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        return {"requested": self.accuracy, "quantity": self.quantity}


@dataclass(frozen=True, kw_only=True)
class AccuracyResult:
    """The result of a run to a goal.

    Attributes:
        goal: what was asked for.
        level: the last mesh and its solution.
        solution: the same solution, as that of the scene.
        degree: of the elements.
        steps: all adaptive steps.
        why: why it ended without reaching the goal; None where it was reached.
        interrupted: whether it ended because it was to stop.
    """

    goal: Goal
    level: AdaptiveLevel
    solution: Solution
    degree: int
    steps: tuple[AdaptiveStep, ...]
    why: str | None
    interrupted: bool

    @property
    def description(self) -> str:
        """What the accuracy is of, in words."""
        return quantities.find(self.goal.quantity).description

    @property
    def exit_code(self) -> int:
        """The solution's, or *interrupted* or *not converged* where the accuracy was not reached."""
        if self.interrupted and not self.solution.exit_code:
            return ExitCode.INTERRUPTED
        return self.solution.exit_code or (ExitCode.NOT_CONVERGED if self.why else ExitCode.CERTIFIED)

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        last = self.steps[-1] if self.steps else None
        return {
            **self.goal.as_dict(),
            "estimated": last.error if last else None,
            "reached": self.why is None,
            "why": self.why,
            "degree": self.degree,
            "tolerance": last.tolerance if last else None,
            "epsilon": last.epsilon if last else None,
            "levels": [asdict(step) for step in self.steps],
        }
