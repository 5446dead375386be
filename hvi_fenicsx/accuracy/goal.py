"""What accuracy is asked for, and the result of a run to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import ExitCode
from ..workflow import Solution
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
class DegreeChoice:
    """The degree that was chosen, and why.

    Attributes:
        degree: 1 or 2.
        unknowns: that each degree is forecast to need.
    """

    degree: int
    unknowns: Mapping[int, float]

    def __str__(self) -> str:
        needed = ", ".join(f"degree {degree} about {count:.1e}" for degree, count in self.unknowns.items())
        return f"degree {self.degree} is chosen; unknowns needed, by the first mesh: {needed}"


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
        more: what the accuracy asked for would cost, or a tenth of the error where it was reached or none was asked;
            None where no error is known.
        interrupted: whether it ended because it was to stop.
        choice: how the degree was chosen; None where the scene states it, or there was no choice.
    """

    goal: Goal
    level: AdaptiveLevel
    solution: Solution
    degree: int
    steps: tuple[AdaptiveStep, ...]
    why: str | None
    more: Cost | None
    interrupted: bool
    choice: DegreeChoice | None = None

    @property
    def exit_code(self) -> int:
        """The solution's, or *interrupted* or *not converged* where the accuracy was not reached."""
        missed = self.goal.accuracy is not None and self.why is not None
        if self.interrupted and not self.solution.exit_code:
            return ExitCode.INTERRUPTED
        return self.solution.exit_code or (ExitCode.NOT_CONVERGED if missed else ExitCode.CERTIFIED)

    def as_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        last = self.steps[-1] if self.steps else None
        return {
            **self.goal.as_dict(),
            "estimated": last.error if last else None,
            "reached": self.why is None,
            "why": self.why,
            "degree": self.degree,
            "unknowns_needed": self.choice and {f"degree_{p}": count for p, count in self.choice.unknowns.items()},
            "tolerance": last.tolerance if last else None,
            "epsilon": last.epsilon if last else None,
            "ten_times_more": self.more.as_dict() if self.more else None,
            "levels": [step.as_dict() for step in self.steps],
        }
