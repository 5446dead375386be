"""What a method is given: one record for the system, its levels, what is known of it, and how to solve it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..rigid import Solvability
from ..runtime.log import newton_step
from ..runtime.timing import Timer
from ..system.held_solver import LinearSettings
from ..system.levels import Levels
from ..system.system import System
from .active_set import ActiveSetSolver
from .options import SolverOptions

Progress = Callable[[str, float | None, int, float, int], None]
"""Called with the method's name, ε, iteration, residual, and vertices in contact (of all ranks)."""


def never() -> bool:
    """Whether to stop: no."""
    return False


@dataclass(frozen=True, kw_only=True)
class RunControl:
    """What surrounds a solve.

    Attributes:
        timer: where time goes.
        progress: called at each Newton step; by default it is logged.
        interrupted: whether to stop (collective, asked at each Newton step).
    """

    timer: Timer
    progress: Progress = newton_step
    interrupted: Callable[[], bool] = never


@dataclass(frozen=True, kw_only=True)
class SolveContext:
    """What a method is given.

    Attributes:
        system: the assembled problem.
        solver: bound-constrained solves on it; keeps its preconditioner from solve to solve.
        solvability: whether a solution can exist, and which rigid motions the supports leave.
        options: method, tolerance, limits.
        timer: where time goes.
        progress: called at each Newton step; by default it is logged.
        steady: whether the pieces and the active set of a start from the coarser level are expected to stand.
    """

    system: System
    solver: ActiveSetSolver
    solvability: Solvability
    options: SolverOptions
    timer: Timer
    progress: Progress = newton_step
    steady: bool = False

    @classmethod
    def create(
        cls,
        system: System,
        levels: Levels,
        solvability: Solvability,
        options: SolverOptions,
        control: RunControl,
        *,
        steady: bool = False,
    ) -> SolveContext:
        """The context of one solve, with a new solver.

        Args:
            system: the assembled problem.
            levels: its coarser levels; none where there is no mesh hierarchy.
            solvability: the verdict on existence.
            options: method, tolerance, limits.
            control: timer, progress and interruption.
            steady: whether the pieces and the active set of the start are expected to stand.
        """
        thresholds = options.thresholds
        linear = LinearSettings.choose(system, options.linear_solver, thresholds.linear, levels=bool(levels))
        solver = ActiveSetSolver(system, levels, linear, control.timer, control.interrupted, thresholds)
        return cls(
            system=system,
            solver=solver,
            solvability=solvability,
            options=options,
            timer=control.timer,
            progress=control.progress,
            steady=steady,
        )

    @property
    def epsilon(self) -> float | None:
        """Relative width of the laws' smoothing; None for exact laws."""
        return self.options.relative_width(self.system)
