"""What accuracy is asked for, the steps to it, and the result."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..errors import ExitCode
from ..workflow import Solution
from .adaptive import AdaptiveLevel


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
