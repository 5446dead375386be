"""The methods, one file each. A new method is a new class here and an entry in :data:`METHODS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from .. import method_names
from ..runtime.timing import Timer
from ..system.held_solver import LinearSettings
from ..system.system import System
from .active_set import ActiveSetSolver
from .auto import Auto
from .branch import BranchIteration
from .condensed import Condensation
from .continuation import Continuation
from .method import Progress, Settings, SolveResult
from .quadratic import ConvexProgramme, LinearSolve, is_equation, is_quadratic
from .ssls import SemismoothNewton
from .tao import BoundedNewton

if TYPE_CHECKING:
    from ..scene import SolverTable


class Method(Protocol):
    """A way to solve the inequality on a system.

    Attributes:
        name: in ``summary.json``. words: what it is.
        takes_start: whether ``solve`` takes a displacement to begin at, and so goes up the ladder.
    """

    name: str
    words: str
    takes_start: bool

    def __init__(self, solver: ActiveSetSolver, settings: Settings) -> None: ...

    def solve(self, *args: Any) -> SolveResult:
        """A stationary point, or what was reached. Collective."""


METHODS: Mapping[str, type[Method]] = {
    "auto": Auto,
    "branch": BranchIteration,
    "snes_vi": Continuation,
    "tao": BoundedNewton,
    "ssls": SemismoothNewton,
    "condensed": Condensation,
}


def relative_width(wanted: SolverTable, system: System) -> float | None:
    """ε relative to the first law's energy scale; None for exact laws, or without a law."""
    if wanted.epsilon_absolute is None or not system.terms:
        return wanted.epsilon
    scales = system.problem.scales
    return wanted.epsilon_absolute / (system.terms[0].exact.energy_scale * scales.stress * scales.displacement)


def choose(wanted: SolverTable, system: System) -> type[Method]:
    """The class that solves a system: the one that the scene names, or the simplest that what it holds allows."""
    if wanted.method == "auto" and is_quadratic(system):
        return LinearSolve if is_equation(system) else ConvexProgramme
    return METHODS[wanted.method] if wanted.method in METHODS else method_names.own()[wanted.method]


def create(
    wanted: SolverTable,
    system: System,
    timer: Timer,
    progress: Progress,
    interrupted: Callable[[], bool],
    *,
    steady: bool = False,
) -> Method:
    """The method of a scene's solver table, ready to solve; ``steady`` as in :class:`.method.Settings`."""
    method = choose(wanted, system)
    linear = LinearSettings.choose(system, wanted.linear_solver)
    epsilon = relative_width(wanted, system)
    settings = Settings(
        tolerance=wanted.tolerance,
        max_newton=wanted.max_iterations,
        progress=progress,
        epsilon=epsilon,
        start=wanted.start,
        steady=steady,
    )
    return method(ActiveSetSolver(system, linear, timer, interrupted), settings)
