"""How to solve and which load path to follow: the tables ``[solver]`` and ``[path]`` of a scene file."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer, model_validator

from ..effects.values import as_value
from ..laws.smoothing import registered as smoothings
from ..schema import Count, Mistake, Names, OneOf, Positive, Table, refusal, shown, validation_error

LinearSolver = Literal["auto", "lu", "gamg"]
_STARTS = ("unbroken", "resting", "broken")


def _start_value(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(as_value, value))
    if value not in _STARTS:
        words = ", ".join(map(shown, _STARTS))
        text = f"must be one of {words}, or a list of formulas, one for each component (is {shown(value)})"
        raise refusal(text)
    return value


Start = Annotated[
    Any,
    BeforeValidator(_start_value),
    PlainSerializer(lambda start: start if isinstance(start, str) else [f.source for f in start]),
]
"""The name of a start, or a displacement by component."""


class SolverTable(Table):
    """How the problem is solved. Without `smoothing` and `epsilon` the law itself is solved, not a smoothed one."""

    degree: Annotated[int, Field(ge=1, le=2)] | None = None
    """the degree of the elements: 1, or 2, which needs far fewer unknowns for the same accuracy; without it 1, but with
    `--accuracy` the cheaper one"""
    method: str = "auto"
    """the method: auto chooses linear, convex or branch by the effects; branch solves the exact law; condensed is the
    procedure of the paper; snes_vi is for comparison; or the name of your own method"""
    smoothing: Annotated[str | None, OneOf(smoothings)] = None
    """the plus function that smooths the kinks of the law; paper is the S of the paper; without it the law is exact"""
    epsilon: Positive | None = None
    """width ε of the smoothing, relative to the energy of the law at its kink"""
    epsilon_absolute: Positive | None = None
    """width ε of the smoothing in N/m (J/m²), as in the paper; not together with `epsilon`"""
    start: Start = "unbroken"
    """the start value, which matters if there are several solutions: "unbroken" (no slip), "resting" (the equilibrium
    in which every law is a spring), "broken" (beyond every drop of the laws), or a displacement (m, formulas)"""
    tolerance: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 1e-8
    """the iteration ends when the relative residual of the inequality is below it"""
    linear_solver: LinearSolver = "auto"
    """the linear solver; auto chooses by the number of unknowns; PETSc options override it"""
    second_order: bool | None = None
    """if a softening law leaves open whether the solution is a local minimiser, factorise the Hessian; by default up to
    50,000 unknowns in the plane and 5,000 in space, where that takes less than 5 % of a run"""
    max_iterations: Annotated[Count, Field(le=10**9)] = 100
    """the largest number of Newton iterations"""

    @model_validator(mode="before")
    @classmethod
    def _default_smoothing(cls, data: Any) -> Any:
        smoothed = isinstance(data, dict) and ("epsilon" in data or "epsilon_absolute" in data)
        return {"smoothing": "quadratic", **data} if smoothed else data

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if mistakes := self._contradictions():
            raise validation_error(mistakes)
        return self

    def _contradictions(self) -> list[Mistake]:
        found = []
        if self.epsilon is not None and self.epsilon_absolute is not None:
            found.append(Mistake(("epsilon_absolute",), "epsilon is given too; leave one of them out"))
        if self.smoothing and self.epsilon is None and self.epsilon_absolute is None:
            found.append(Mistake(("smoothing",), _HOW_WIDE))
        return found


_HOW_WIDE = (
    "needs its width: add epsilon = 0.01 (relative to the law's energy at its kink) "
    "or epsilon_absolute = 0.1 (N/m), or leave smoothing out to solve the law itself"
)
Factor = Annotated[float, Field(ge=-1e100, le=1e100)]
"""A factor beyond this makes work of which squares are no numbers."""
_AS_LIST = BeforeValidator(lambda value: tuple(value) if isinstance(value, list | tuple) else (value,))


def _programme(factors: tuple[float, ...]) -> tuple[float, ...]:
    if not factors:
        raise refusal("is an empty list; give the factor to go to, like 1.5")
    for one, other in pairwise((0.0, *factors)):
        if one == other:
            raise refusal(f"goes from {one:g} to {other:g}, which is no way; a path starts at 0")
    return factors


def _written(factors: tuple[float, ...]) -> Any:
    return factors[0] if len(factors) == 1 else list(factors)


class PathTable(Table):
    """The load path that `hvi path` follows. A factor grows from 0 and multiplies what drives the body."""

    to: Annotated[tuple[Factor, ...], _AS_LIST, AfterValidator(_programme), PlainSerializer(_written)] = (1.0,)
    """the factor at which the path ends; or a programme with turns: [1.0, 0.2, 1.5] loads, unloads, loads again"""
    scaled: Names | None = None
    """what the factor multiplies: loads, prescribed displacements and moved obstacles by name, such as
    ["pull.traction", "lid.contact"]; all others are constant; by default all"""
    follow: Literal["stable", "exact"] = "stable"
    """stable: as a testing machine does, at a limit point on to the next stable equilibrium; exact: the path itself,
    through limit points, where the factor falls and rises again"""
    memory: bool = True
    """whether bonds remember: true: they unload along the secant, and what is broken stays broken; false: the laws as
    they are, which heal"""
    contact_at: Annotated[tuple[Factor, ...], _AS_LIST, PlainSerializer(list)] = ()
    """factors at which the state of Γc is written into path_contact.csv, each time the path crosses them"""
    states: Annotated[int, Field(ge=2)] = 50
    """how many states displacement.pvd shows at most, start, limit points, jumps and end among them"""
