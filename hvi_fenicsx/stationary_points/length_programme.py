"""Convex programmes with laws of lengths: the objective, the points that are allowed, and forces at a point.

They are solved by Newton's method (:mod:`.length_newton`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Mask
from .arcs import ArcTable
from .length_frames import unknowns_of
from .lengths import Lengths
from .scalar_problem import ScalarProblem
from .thresholds import ProgrammeThresholds


@dataclass(frozen=True, kw_only=True)
class LengthProgramme:
    """Minimise ½ xᵀAx - bᵀx + Σ ψᵢ + Σ ½ d ⟨-opening⟩², ψ being convex; those of lengths do not fall.

    Attributes:
        a: A (n, n), symmetric, positive semidefinite.
        b: (n,).
        chains: ψ as arcs (k, 6), n of the unknowns and m of the lengths, these from zero on.
        lengths: of the vectors.
        lower: bounds of the vectors' unknowns, (n,).
        upper: bounds of them, (n,).
        shut: d, (m,).
        thresholds: how many steps, and what is rounding.
    """

    a: Array
    b: Array
    chains: Sequence[Array]
    lengths: Lengths
    lower: Array
    upper: Array
    shut: Array
    thresholds: ProgrammeThresholds

    @classmethod
    def of(cls, problem: ScalarProblem, a: Array, b: Array, chains: Sequence[Array], shut: Array) -> LengthProgramme:
        """A programme on the vectors and bounds of a problem.

        Args:
            problem: the problem.
            a: A.
            b: b.
            chains: ψ.
            shut: d.
        """
        return cls(
            a=a,
            b=b,
            chains=chains,
            lengths=problem.lengths,
            lower=problem.lower,
            upper=problem.upper,
            shut=shut,
            thresholds=problem.thresholds.programmes,
        )

    @cached_property
    def stack(self) -> ArcTable:
        """ψ as arrays."""
        return ArcTable.of(self.chains)

    @cached_property
    def radius(self) -> Array:
        """The largest lengths that are allowed, (m,)."""
        return self.stack.last[len(self.b) :]

    def value(self, x: Array) -> float:
        """The objective.

        Args:
            x: an admissible point, (n,).
        """
        laws = self.stack.energy(np.concatenate([x, self.lengths.of(x)])).sum()
        negative = np.where(self.lengths.opens, np.minimum(self.lengths.vectors(x)[:, 0], 0.0), 0.0)
        return float(0.5 * x @ (self.a @ x) - self.b @ x + laws + 0.5 * self.shut @ negative**2)

    def bound_forces(self, x: Array, laws: Array) -> Array:
        """Forces of the bounds that are met, such that the laws' forces are left for the vectors' unknowns, (n,).

        Args:
            x: a point, (n,).
            laws: forces of the laws on the vectors' unknowns, (n,).
        """
        force = self.b - self.a @ x
        wanted = np.where(self._own, force, laws)
        return np.where(x <= self.lower, np.maximum(wanted - force, 0.0), 0.0) + np.where(
            x >= self.upper, np.minimum(wanted - force, 0.0), 0.0
        )

    def borne(self, size: Array) -> tuple[Array, Array]:
        """What the laws bear just before some lengths, and what they hold at zero, (m,) each.

        Args:
            size: the lengths, (m,).
        """
        n = len(self.b)
        low, _ = self.stack.interval(np.concatenate([self.stack.low[:n, 0], np.minimum(size, self.radius)]))
        return np.maximum(low[n:], 0.0), np.maximum(self.stack.after[n:, 0], 0.0)

    def admissible(self, x: Array) -> Array:
        """The point with its unknowns and lengths on their intervals, (n,).

        Args:
            x: a point, (n,).
        """
        low, high = self.stack.low[: len(x), 0], self.stack.last[: len(x)]
        x = np.where(self._own, np.clip(x, low, high), np.clip(x, self.lower, self.upper))
        size = self.lengths.of(x)
        share = np.divide(self.radius, size, out=np.ones_like(size), where=size > self.radius)
        return unknowns_of(self.lengths, x, self.lengths.vectors(x) * share[:, None])

    @cached_property
    def _own(self) -> Mask:
        """Which unknowns are in no vector, (n,)."""
        own = np.ones(len(self.b), dtype=np.bool_)
        own[self.lengths.members] = False
        return own
