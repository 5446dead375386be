"""The methods, one file each. A new method is a new class here and an entry in :data:`METHODS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from ..errors import InputError
from ..system import System
from ..timing import Timer
from .activeset import ActiveSetSolver
from .auto import Auto
from .base import Progress, Settings, Solved
from .branch import BranchIteration
from .condensed import Condensation
from .continuation import Continuation
from .linear import LinearSettings
from .ssls import SemismoothNewton
from .tao import BoundedNewton

if TYPE_CHECKING:
    from ..scene import Solver


class Method(Protocol):
    """A way to solve the inequality on a system."""

    name: str

    def __init__(self, solver: ActiveSetSolver, settings: Settings) -> None: ...

    def solve(self, *args: Any) -> Solved:
        """A stationary point, or what was reached. Collective."""


METHODS: Mapping[str, type[Method]] = {
    "auto": Auto,
    "branch": BranchIteration,
    "snes_vi": Continuation,
    "tao": BoundedNewton,
    "ssls": SemismoothNewton,
    "condensed": Condensation,
}


def relative_width(wanted: Solver, system: System) -> float | None:
    """ε relative to the first law's energy scale; None for exact laws, or without a law."""
    if wanted.epsilon_absolute is None or not system.terms:
        return wanted.epsilon
    scales = system.problem.scales
    return wanted.epsilon_absolute / (system.terms[0].exact.energy_scale * scales.stress * scales.displacement)


def create(wanted: Solver, system: System, timer: Timer, progress: Progress, interrupted: Callable[[], bool]) -> Method:
    """The method of a scene's solver table, ready to solve.

    Raises:
        InputError: the method is not there.
    """
    if wanted.method not in METHODS:
        raise InputError(f'solver.method = "{wanted.method}" is not available; use {", ".join(METHODS)}')
    linear = LinearSettings.choose(system, wanted.linear_solver)
    epsilon = relative_width(wanted, system)
    settings = Settings(
        tolerance=wanted.tolerance, max_newton=wanted.max_iterations, progress=progress, epsilon=epsilon
    )
    return METHODS[wanted.method](ActiveSetSolver(system, linear, timer, interrupted), settings)
