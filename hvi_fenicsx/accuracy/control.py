"""Solve to a given accuracy: mesh, ε and tolerances follow from the estimated error."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI

from ..errors import ExitCode
from ..estimate.estimator import Estimate
from ..mesh import nodes
from ..model import Model
from ..runtime import cost
from ..runtime.mpi import largest
from ..workflow import Solution
from . import adaptive, quantities
from .adaptive import CONTROL, AdaptiveLevel, AdaptiveSolver, AdaptiveStep
from .quantity_base import Quantity

_INTERRUPTED = "interrupted"
_LARGEST = 2**31 - 1
"""Unknowns that PETSc's default integers can number."""
_AIM = math.sqrt(1 - CONTROL.smoothing**2)
"""Part of the accuracy asked for at which a step of the mesh aims: what smoothing's largest part leaves."""


class _EndedError(Exception):
    """A run ends without having reached its goal, for the reason that this says; on all ranks alike."""


def solve_to_goal(
    scene: Model, comm: MPI.Comm, goal: Goal, solver: AdaptiveSolver, report: Callable[[str], None]
) -> AccuracyResult:
    """Refine until the goal is reached, or cannot be. Collective.

    Where the scene states no degree it is 2; 1 for a quantity that is compared from mesh to mesh.

    Args:
        scene: what to solve; its mesh sets where to begin (:meth:`.AdaptiveSolver.begin`), its ε is the largest.
        comm: the ranks.
        goal: what is asked for.
        solver: timer and interruption.
        report: called with a line about each mesh.

    Raises:
        InputError: on all ranks alike: the scene has no such quantity, or does not fit its mesh.
    """
    quantity = quantities.find(goal.quantity)()
    solver = replace(solver, existence=quantity.needs_existence)
    degree = scene.solver.degree or (2 if quantity.estimated else 1)
    run = _Run(comm, goal.accuracy, quantity, solver, report)
    level, why = run.levels(scene.with_solver(degree=degree))
    return AccuracyResult(
        goal=goal,
        level=level,
        solution=replace(level.solution, scene=scene),
        degree=degree,
        steps=tuple(run.steps),
        why=why,
        interrupted=why is not None and solver.interrupted(),
    )


@dataclass
class _Run:
    """One run to an accuracy, which balances three parts of the error; what it decides is the same on all ranks.

    The mesh has the largest part; smoothing and solver get what is small beside it.
    """

    _comm: MPI.Comm
    _accuracy: float
    _quantity: Quantity
    _solver: AdaptiveSolver
    _report: Callable[[str], None]
    _failures: int = 0
    _estimated: AdaptiveLevel | None = None

    def __post_init__(self) -> None:
        self.steps: list[AdaptiveStep] = []
        self._room = cost.memory_room(self._comm) - cost.peak_memory(self._comm)
        self._start = time.perf_counter()

    def levels(self, scene: Model) -> tuple[AdaptiveLevel, str | None]:
        """The last mesh, and why it does not reach the goal; from the coarsest one that sees the data. Collective."""
        level = self._solver.begin(scene, self._comm)
        try:
            self._record(level)
            while self._failures or not self.steps[-1].error <= self._accuracy:
                self._start = time.perf_counter()
                if self._estimated is not None and self._solver.interrupted():
                    raise _EndedError(_INTERRUPTED)
                level = self._next(level)
                self._record(level)
        except _EndedError as end:
            if str(end) != _INTERRUPTED or self._estimated is None:
                return level, str(end)
            self._report(_INTERRUPTED)
            return self._estimated, _INTERRUPTED  # the last mesh with an error
        return level, None

    def _record(self, level: AdaptiveLevel) -> None:
        """Record a level. Collective."""
        solution = level.solution
        if solution.solve_result is None or solution.solve_result.interrupted:
            stopped = solution.solve_result is not None and self._estimated is not None
            raise _EndedError(_INTERRUPTED if stopped else solution.reason)
        self._quantity.add(level)
        if solution.estimate is None and solution.converged:
            raise _EndedError("the error of a law whose energy of separation depends on the mode is not estimated")
        if solution.estimate is None:
            self._failures += 1
            self._report(f"{level.dofs:,} unknowns: {solution.reason}")
            if self._failures >= CONTROL.failures:
                raise _EndedError(solution.reason)
            return
        self._failures, self._estimated = 0, level
        self.steps.append(self._step(level, solution.estimate))
        self._report(_line(len(self.steps), self.steps[-1], self._solver.timer.total))

    def _step(self, level: AdaptiveLevel, estimate: Estimate) -> AdaptiveStep:
        norm, smoothing = estimate.energy_norm or 1.0, self._quantity.smoothing()
        return AdaptiveStep(
            dofs=level.dofs,
            error=self._quantity.error(),
            discretisation=estimate.discretisation / norm,
            smoothing=smoothing,
            algebraic=estimate.algebraic / norm,
            epsilon=level.solution.epsilon,
            tolerance=level.solution.scene.solver.tolerance,
            seconds=largest(self._comm, time.perf_counter() - self._start),
            memory=cost.peak_memory(self._comm),
        )

    def _next(self, level: AdaptiveLevel) -> AdaptiveLevel:
        """The next level. Collective."""
        scene, last = level.solution.scene, None if self._failures else self.steps[-1]
        degree, dimension = scene.solver.degree or 1, scene.dimension
        if last is not None and math.isfinite(last.error):  # at the best rate of convergence
            power, missing = (1 if self._quantity.in_energy_norm else 2), last.error / self._accuracy
            with np.errstate(over="ignore"):
                self._check_affordable(level.dofs * np.maximum(1.0, missing) ** (dimension / (power * degree)), scene)
        if self.steps:
            scene = self._scene(scene, self.steps[-1])
        if last is not None and self._mesh_suffices():
            return self._solver.again(level, scene)
        refined = adaptive.refined(level, self._bulk(last, dimension, degree))
        self._check_affordable(dimension * nodes.count(refined.domain.mesh, degree), scene)
        return self._solver.refine(level, refined, scene, self._quantity.ahead())

    def _check_affordable(self, dofs: float, scene: Model) -> None:
        """End where so many unknowns cannot be solved for."""
        if not math.isfinite(dofs):
            raise _EndedError(f"{self._accuracy:g} is beyond any number of unknowns")
        needed = cost.memory_of_all_meshes(dofs, scene.dimension, scene.solver.degree or 1)
        if dofs > _LARGEST or needed > self._room:
            raise _EndedError(
                f"{self._accuracy:g} would need {dofs:.1e} unknowns or more and {needed / 1024:.3g} GB; "
                f"{self._room / 1024:.3g} GB can be used"
            )

    def _bulk(self, last: AdaptiveStep | None, dimension: int, degree: int) -> float:
        """Part of the squared error to refine: no more than the aim needs.

        In space, and on Γc, where errors fall as the square of the energy norm's, a smaller part goes as far.
        """
        quantity = self._quantity
        on_contact = quantity.known_from_one_mesh and not quantity.in_energy_norm
        most = CONTROL.bulk ** (1 if dimension == 2 and not on_contact else 2)
        if last is None or not quantity.known_from_one_mesh:
            return most
        mesh, smoothing, _ = quantity.parts(last)
        if mesh <= 0.0:
            return most
        left = self._beside(smoothing) / mesh
        # Halving the edges of marked cells leaves 4^-p of it.
        needed = (1 - (left**2 if quantity.in_energy_norm else left)) / (1 - 0.25**degree)
        return min(needed, most) if needed > 0.0 else most

    def _beside(self, part: float) -> float:
        """The largest error beside a part with which both together are no larger than the aim."""
        return math.sqrt(max((_AIM * self._accuracy) ** 2 - part**2, 0.0))

    def _mesh_suffices(self) -> bool:
        """Whether the next step must change ε or the tolerance, and not the mesh."""
        *others, last = self.steps
        mesh, smoothing, algebraic = self._quantity.parts(last)
        if smoothing > max(mesh, self._allowed_smoothing(mesh)):  # unless a smaller ε on this mesh did not help
            return not (others and others[-1].dofs == last.dofs and last.smoothing >= 0.99 * others[-1].smoothing)
        return mesh <= _AIM * self._accuracy < max(smoothing, algebraic) * 2

    def _allowed_smoothing(self, mesh: float) -> float:
        """The error that smoothing may cause: a part of the accuracy, or all that a fine enough mesh leaves."""
        return max(CONTROL.smoothing * self._accuracy, self._beside(mesh))

    def _scene(self, scene: Model, last: AdaptiveStep) -> Model:
        """The scene with the ε and the tolerance of the next step."""
        mesh, smoothing, _ = self._quantity.parts(last)
        solver, values = scene.solver, dict[str, float]()
        if smoothing > self._allowed_smoothing(mesh):
            widths = {name: getattr(solver, name) for name in ("epsilon", "epsilon_absolute")}
            values = {name: CONTROL.smoothing * width for name, width in widths.items() if width is not None}
        if 10 * last.algebraic > max(last.discretisation, self._accuracy):
            values["tolerance"] = solver.tolerance / 10
        return scene.with_solver(**values)


def _line(level: int, step: AdaptiveStep, elapsed: float) -> str:
    width = "" if step.epsilon is None else f", ε {step.epsilon:.2g}"
    error = f"error {step.error:.2e}" if math.isfinite(step.error) else "no error yet"
    return (
        f"mesh {level}: {step.dofs:,} unknowns, {error} (energy norm: mesh {step.discretisation:.1e}, smoothing "
        f"{step.smoothing:.1e}, solver {step.algebraic:.1e}), tolerance {step.tolerance:.0e}{width}, {elapsed:.1f} s"
    )


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
