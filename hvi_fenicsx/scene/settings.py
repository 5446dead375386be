"""How to solve: the ``[solver]`` table."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from .tables import Count, Positive, Problem, Table, refuse

Smoothing = Literal["paper", "quadratic", "chks", "log_exp"]


class Solver(Table):
    """Method and accuracy. Without smoothing and epsilon the law itself is solved, not a smoothed one."""

    method: Literal["auto", "snes_vi", "branch", "tao", "ssls", "condensed"] = "auto"
    """auto chooses by the scene's effects; branch is exact; condensed is the paper's own"""
    smoothing: Smoothing | None = None
    """the plus function that rounds the law's kinks; paper is the paper's S; without it the law is exact"""
    epsilon: Positive | None = None
    """width of the smoothing, relative to the law's energy at its kink"""
    epsilon_absolute: Positive | None = None
    """the same in N/m (J/m²), as in the paper; one of the two, not both"""
    tolerance: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 1e-8
    """relative residual of the inequality at which the iteration ends"""
    linear_solver: Literal["auto", "lu", "gamg"] = "auto"
    """auto chooses by size; any PETSc option overrides it"""
    second_order: bool = False
    """whether to factorise the Hessian where a falling law leaves open if the solution is a local minimum"""
    max_iterations: Count = 100
    """Newton iterations at most"""

    @model_validator(mode="before")
    @classmethod
    def _default_smoothing(cls, data: Any) -> Any:
        smoothed = isinstance(data, dict) and ("epsilon" in data or "epsilon_absolute" in data)
        return {"smoothing": "quadratic", **data} if smoothed else data

    @model_validator(mode="after")
    def _fits(self) -> Solver:
        if problems := self._contradictions():
            raise refuse(problems)
        return self

    def _contradictions(self) -> list[Problem]:
        found = []
        if self.epsilon is not None and self.epsilon_absolute is not None:
            found.append(Problem(("epsilon_absolute",), "epsilon is given too; leave one of them out"))
        if self.smoothing and self.epsilon is None and self.epsilon_absolute is None:
            found.append(Problem(("smoothing",), _HOW_WIDE))
        if self.smoothing and self.method == "branch":
            text = '"branch" solves the law without smoothing; leave out smoothing and epsilon, or use "auto"'
            found.append(Problem(("method",), text))
        return found


_HOW_WIDE = (
    "needs its width: add epsilon = 0.01 (relative to the law's energy at its kink) "
    "or epsilon_absolute = 0.1 (N/m), or leave smoothing out to solve the law itself"
)
