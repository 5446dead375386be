"""The condensed problem with its laws as chains of parabolas: ½ xᵀSx - fᵀx + Σ φᵢ, each of one argument.

An argument is an unknown, or the length of a vector of unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..typing import Array, magnitude
from .arcs import INF, ArcTable, Chain
from .lengths import Lengths
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class ScalarProblem:
    """Minimise, or make stationary, ½ xᵀSx - fᵀx + Σ φᵢ + constant over lower ≤ x ≤ upper.

    Attributes:
        stiffness: S, symmetric, positive semidefinite, (n, n).
        force: f, (n,).
        lower: bounds, -inf where there is none, (n,).
        upper: bounds, inf where there is none, (n,).
        chains: φ over the whole line, n of the unknowns and m of the lengths.
        lengths: of vectors of unknowns which have no law of their own.
        constant: a part of the energy that x does not change.
        error: the energy of the laws differs from that of the chains by this at most; 0 where these are exact.
        farthest: displacements up to which this is known.
    """

    stiffness: Array
    force: Array
    lower: Array
    upper: Array
    chains: tuple[Chain, ...]
    lengths: Lengths = field(default_factory=Lengths.none)
    constant: float = 0.0
    error: float = 0.0
    farthest: float = INF

    @property
    def far(self) -> float:
        """A displacement far beyond all joints of the chains: the end of what is searched."""
        return min(LIMITS.far * self.reach, self.farthest)

    @property
    def ends(self) -> tuple[Array, Array]:
        """Where the search of each unknown ends: at its bounds, or far away, (n,) each."""
        return np.maximum(self.lower, -self.far), np.minimum(self.upper, self.far)

    @cached_property
    def reach(self) -> float:
        """The largest displacement at which a chain has a joint, and one unit at least."""
        ends = (abs(e) for c in self.chains for a in c for e in (a.low, a.high))
        return max([1.0, *(e for e in ends if e < INF)])

    def is_far(self, x: Array) -> bool:
        """Whether a point is at the end of what is searched, or beyond: a body comes off.

        Args:
            x: the point, (n,).
        """
        return magnitude(x) >= (1.0 - LIMITS.accuracy) * self.far

    @cached_property
    def force_size(self) -> float:
        """The largest force, not zero."""
        return magnitude(self.force) or 1.0

    @cached_property
    def joint(self) -> float:
        """The largest displacement at which a traction bends or jumps by a share of its peak; one if there is none."""
        arcs = self.arcs
        at, rises = arcs.high[:, :-1], np.abs(arcs.after[:, 1:] - arcs.before[:, :-1])
        places = np.where(np.isfinite(at), np.abs(at), 0.0)
        bends = rises + np.abs(np.diff(arcs.slopes, axis=1)) * places
        peaks = np.maximum(np.abs(arcs.before), np.abs(arcs.after)).max(axis=1)
        seen = places[np.isfinite(at) & (places > 0.0) & (bends > LIMITS.bent * peaks[:, None])]
        return float(seen.max(initial=0.0)) or 1.0

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return len(self.force)

    def arguments(self, x: Array) -> Array:
        """What the laws act on: the unknowns and the lengths, (n + m,)."""
        return np.concatenate([x, self.lengths.of(x)])

    def with_lengths(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The ends of a box with the least and the largest lengths in it, (n + m,) each.

        Args:
            low: of the unknowns, (n,).
            high: of the unknowns, (n,).
        """
        least, most = self.lengths.within(low, high)
        return np.concatenate([low, least]), np.concatenate([high, most])

    def diagonal(self, d: Array) -> Array:
        """The diagonal, (n,), of the quadratic form that has dᵢ times the square of each argument, d (n + m,)."""
        return d[: self.size] + self.lengths.diagonal(d[self.size :], self.size)

    @cached_property
    def arcs(self) -> ArcTable:
        """All chains as arrays."""
        return ArcTable.of(self.chains)

    def under(self, force: Array) -> ScalarProblem:
        """The same laws, of which no array is made again, under another load.

        Args:
            force: f, (n,).
        """
        other = replace(self, force=force)
        vars(other)["arcs"] = self.arcs
        return other

    def energy(self, x: Array) -> float:
        """The energy at x."""
        laws = self.arcs.energy(self.arguments(x)).sum()
        return float(0.5 * x @ (self.stiffness @ x) - self.force @ x + laws) + self.constant

    def energy_size(self, x: Array) -> float:
        """The sum of the sizes of all parts of the energy at x: what rounding is relative to."""
        elastic = 0.5 * np.abs(x) @ (np.abs(self.stiffness) @ np.abs(x)) + np.abs(self.force) @ np.abs(x)
        return float(elastic + np.abs(self.arcs.energy(self.arguments(x))).sum()) + abs(self.constant)


@dataclass(frozen=True, kw_only=True)
class Box:
    """Intervals of the unknowns and the lengths, and what is known there.

    Attributes:
        low: (n + m,).
        high: (n + m,).
        x: where a relaxation has its minimiser, or is to begin, (n,).
        weights: where envelopes were not tight, (n + m,).
        bound: no point of it has a lower energy.
    """

    low: Array
    high: Array
    x: Array
    weights: Array
    bound: float = -math.inf

    @classmethod
    def around(cls, low: Array, high: Array, x: Array) -> Box:
        """A box of which nothing is known.

        Args:
            low: (n + m,).
            high: (n + m,).
            x: where to begin, (n,).
        """
        return cls(low=low, high=high, x=clipped(x, low, high), weights=np.zeros(len(low)))


def clipped(x: Array, low: Array, high: Array) -> Array:
    """The unknowns within their intervals, (n,).

    Args:
        x: (n,).
        low: of the box, (n + m,).
        high: of the box, (n + m,).
    """
    return np.clip(x, low[: len(x)], high[: len(x)])
