"""What accuracy is asked for, and the result of a run to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import ExitCode
from ..solution import Solution
from .adaptive import AdaptiveLevel
from .cost_forecast import AdaptiveStep, Cost


@dataclass(frozen=True)
class Goal:
    """What is asked for: an accuracy of a quantity, or the best within a time, or both.

    Attributes:
        accuracy: relative error; None: as small as the time allows.
        quantity: name of the target quantity.
        seconds: time budget, s; None: no limit.
    """

    accuracy: float | None
    quantity: str = "energy"
    seconds: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        return {"requested": self.accuracy, "quantity": self.quantity, "time_budget": self.seconds}


@dataclass(frozen=True, kw_only=True)
class AccuracyResult:
    """The result of a run to a goal.

    Attributes:
        goal: what was asked for.
        level: the last mesh and its solution.
        solution: the same solution, as that of the scene.
        steps: all adaptive steps.
        why: why it ended without reaching the goal; None where it was reached.
        more: what a tenth of the error would cost; None where no error is known.
    """

    goal: Goal
    level: AdaptiveLevel
    solution: Solution
    steps: tuple[AdaptiveStep, ...]
    why: str | None
    more: Cost | None

    @property
    def exit_code(self) -> int:
        """The solution's, or *not converged* where the accuracy was not reached."""
        missed = self.goal.accuracy is not None and self.why is not None
        return self.solution.exit_code or (ExitCode.NOT_CONVERGED if missed else ExitCode.CERTIFIED)

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        last = self.steps[-1] if self.steps else None
        return {
            **self.goal.as_dict(),
            "estimated": last.error if last else None,
            "reached": self.why is None,
            "why": self.why,
            "tolerance": last.tolerance if last else None,
            "epsilon": last.epsilon if last else None,
            "ten_times_more": self.more.as_dict() if self.more else None,
            "levels": [step.as_dict() for step in self.steps],
        }
