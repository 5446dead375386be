"""What accuracy is asked for, the steps to it, how the next one follows from the last, and the result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import ExitCode
from ..model import Model
from ..runtime import memory
from ..workflow import Solution
from .adaptive import CONTROL, AdaptiveLevel, ControlThresholds
from .quantity_base import Quantity


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
class AdaptiveStep:
    """One adaptive step: its cost and what it gave.

    Attributes:
        dofs: unknowns.
        error: estimated, relative, of the quantity asked for (infinite: none yet).
        discretisation: the mesh's part of the error in the energy norm, relative.
        smoothing: smoothing's part of the quantity's error, relative.
        algebraic: the solver's part of the error in the energy norm, relative.
        epsilon: relative width of the smoothing, or None.
        tolerance: of the solver.
        seconds: wall time of this step.
        memory: the program's peak so far, MB.
    """

    dofs: int
    error: float
    discretisation: float
    smoothing: float
    algebraic: float
    epsilon: float | None
    tolerance: float
    seconds: float
    memory: float


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
        return memory.needed_by_all_meshes(dofs, self.dimension, self.degree)

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
