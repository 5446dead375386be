"""The context of a method: the system, its solver, what is known about existence, and how to solve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

from pydantic import PrivateAttr

from ..model.options import SolverTable
from ..rigid import Solvability
from ..runtime.cost import Timer
from ..runtime.log import NewtonStep, newton_step
from ..system.levels import Levels
from ..system.linear_settings import LinearSettings
from ..system.system import System
from .active_set import ActiveSetSolver
from .thresholds import DEFAULT, Thresholds

Progress = Callable[[NewtonStep], None]
"""Called at each Newton step, on all ranks."""


def never() -> bool:
    """Never stop."""
    return False


@dataclass(frozen=True, kw_only=True)
class RunControl:
    """What a run hands to its solves.

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
    """The context of a method.

    Attributes:
        system: the assembled problem.
        solver: solves with bounds on the system; keeps its preconditioner from solve to solve.
        solvability: whether a solution can exist, and which rigid motions the supports leave.
        options: method, tolerance, limits.
        timer: where time goes.
        progress: called at each Newton step; by default it is logged.
        steady: whether the pieces and the active set of a start from the coarser level are expected to be the final
            ones.
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
            solvability: whether a solution can exist.
            options: method, tolerance, limits.
            control: timer, progress and interruption.
            steady: whether the pieces and the active set of the start are expected to be the final ones.
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

    def with_options(self, **changes: Any) -> SolveContext:
        """The context with some options changed.

        Args:
            changes: fields of :class:`.SolverOptions` and their values.
        """
        return replace(self, options=self.options.model_copy(update=changes))

    def tell(self, method: str, epsilon: float | None, iteration: int, residual: float, contact: int) -> None:
        """Tell a Newton step to whom the progress is shown.

        Args:
            method: its name.
            epsilon: relative width of the smoothing; None for exact laws.
            iteration: counted from the start of the solve.
            residual: of the inequality, relative.
            contact: vertices in contact, of all ranks.
        """
        self.progress(
            NewtonStep(method=method, epsilon=epsilon, iteration=iteration, residual=residual, contact=contact)
        )

    @property
    def epsilon(self) -> float | None:
        """Relative width of the laws' smoothing; None for exact laws."""
        return self.options.relative_width(self.system)


class SolverOptions(SolverTable):
    """The table ``[solver]`` with the numbers that tune the methods."""

    _thresholds: Thresholds = PrivateAttr(default=DEFAULT)

    @classmethod
    def of(cls, table: SolverTable, thresholds: Thresholds = DEFAULT) -> Self:
        """The options of a table.

        Args:
            table: what the user wants.
            thresholds: the numbers that tune the methods.
        """
        found = cls.model_construct(**dict(table))
        found._thresholds = thresholds
        return found

    @property
    def thresholds(self) -> Thresholds:
        """The numbers that tune the methods."""
        return self._thresholds

    def relative_width(self, system: System) -> float | None:
        """ε relative to the first law's energy scale; None for exact laws, or without a law."""
        if self.epsilon_absolute is None or not system.terms:
            return self.epsilon
        scales = system.problem.scales
        return self.epsilon_absolute / (system.terms[0].exact.energy_scale * scales.stress * scales.displacement)

    def decides_stability(self, system: System) -> bool:
        """Whether the Hessian is factorised where a falling law leaves open if u is a local minimum.

        Args:
            system: that was solved.
        """
        if self.second_order is not None:
            return self.second_order
        return system.dofs <= self.thresholds.linear.largest_direct[system.problem.scales.dimension]
