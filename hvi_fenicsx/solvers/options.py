"""How a problem is solved: method, tolerance, limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ..formula import Formula
from ..system.system import System
from .thresholds import DEFAULT, Thresholds

Start = Literal["unbroken", "resting", "broken"] | Sequence[Formula]
"""Slips by which the first pieces of the laws are chosen.

None; those at rest (contact closed, every bond a spring); very large ones; those of a displacement (m) by component.
"""


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """How a problem is solved.

    Attributes:
        method: name of the method; auto chooses by the effects.
        epsilon: width of the laws' smoothing relative to their energy scale; None for exact laws.
        epsilon_absolute: the width in N/m (J/m²) instead.
        start: the pieces of the laws on which the branch iteration begins.
        tolerance: relative residual of the inequality.
        linear_solver: what the user wants; auto chooses by size.
        second_order: whether to factorise the Hessian where a falling law leaves open if u is a local minimum; None:
            where that takes little of a run.
        max_iterations: Newton iterations of one solve at most.
        thresholds: the numbers that tune the methods.
    """

    method: str = "auto"
    epsilon: float | None = None
    epsilon_absolute: float | None = None
    start: Start = "unbroken"
    tolerance: float = 1e-8
    linear_solver: Literal["auto", "lu", "gamg"] = "auto"
    second_order: bool | None = None
    max_iterations: int = 100
    thresholds: Thresholds = DEFAULT

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
        plane = system.problem.scales.dimension == 2
        return system.dofs <= (self.thresholds.inertia_plane if plane else self.thresholds.inertia_space)
