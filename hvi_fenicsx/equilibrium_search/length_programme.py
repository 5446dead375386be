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
from .convex_programme import minimise
from .lengths import Lengths, left_out, unknowns_of
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


def with_held_forces(programme: LengthProgramme, x: Array, springs: Array) -> tuple[Array, Array]:
    """The minimiser where the laws' forces on vectors stay as they are at a point, and the bounds' forces, (n,) each.

    Args:
        programme: the programme.
        x: the point, (n,).
        springs: a matrix (n, n) that resists rigid motions.
    """
    held = _forces(programme, x)
    pull = programme.b - held + springs @ x
    chains = ArcTable.of(_without_lengths(programme, x))
    y = minimise(programme.a + springs, pull, chains, x, programme.thresholds).x
    return y, programme.bound_forces(y, held)


def _forces(programme: LengthProgramme, x: Array) -> Array:
    """Forces of the laws on the vectors' unknowns: on long vectors the traction just before, on none what it holds."""
    lengths = programme.lengths
    along = lengths.along(programme.b - programme.a @ x)
    out = left_out(lengths, x, along, (programme.lower, programme.upper))
    vectors, needed = (np.where(out, 0.0, v) for v in (lengths.vectors(x), along))
    size, most = np.linalg.norm(vectors, axis=1), np.linalg.norm(needed, axis=1)
    before, start = programme.borne(size)
    moved = size > 0.0
    way, divisor = np.where(moved[:, None], vectors, needed), np.where(moved, size, most)
    traction = np.where(moved, before, np.minimum(most, start))
    each = np.divide(traction, divisor, out=np.zeros_like(size), where=divisor > 0.0)[:, None] * way
    result = np.zeros(len(x))
    result[lengths.members] = (each * lengths.factors)[lengths.there]
    return result


def _without_lengths(programme: LengthProgramme, x: Array) -> list[Array]:
    """The laws of the unknowns; of the vectors' ones their bounds."""
    chains = list(programme.chains[: len(x)])
    end = programme.thresholds.beyond * float(np.abs(x).max()) + 1.0
    for i in programme.lengths.members:
        low, high = max(float(programme.lower[i]), -end), min(float(programme.upper[i]), end)
        chains[i] = np.array([[low, high, 0.0, 0.0, 0.0, 0.0]])
    return chains
