"""The condensed problem with its laws as chains of parabolas, one of each unknown: ½ xᵀSx - fᵀx + Σ φᵢ(xᵢ)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask
from .arcs import FREE, INF, Arc, Chain

FAR = 1e6
"""Ends of the first box, relative to the problem's displacements; what is found must stay off them."""


@dataclass(frozen=True, kw_only=True)
class ScalarProblem:
    """Minimise, or make stationary, ½ xᵀSx - fᵀx + Σ φᵢ(xᵢ) + constant over lower ≤ x ≤ upper.

    Attributes:
        stiffness: S, symmetric, positive semidefinite, (n, n).
        force: f, (n,).
        lower: bounds, -inf where there is none, (n,).
        upper: bounds, inf where there is none, (n,).
        chains: φ, one of each unknown, over the whole line.
        constant: a part of the energy that x does not change.
        error: the energy of the laws differs from that of the chains by this at most; 0 where these are exact.
        farthest: displacements up to which this is known.
    """

    stiffness: Array
    force: Array
    lower: Array
    upper: Array
    chains: tuple[Chain, ...]
    constant: float = 0.0
    error: float = 0.0
    farthest: float = INF

    @property
    def far(self) -> float:
        """A displacement far beyond all joints of the chains: the end of what is searched."""
        ends = (abs(e) for c in self.chains for a in c for e in (a.low, a.high))
        return min(FAR * max([1.0, *(e for e in ends if e < INF)]), self.farthest)

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return len(self.force)

    @cached_property
    def bonded(self) -> Integers:
        """Numbers of the unknowns with a law."""
        return np.flatnonzero([c is not FREE for c in self.chains])

    @cached_property
    def arcs(self) -> ArcTable:
        """All chains as arrays."""
        return ArcTable.of(self.chains)

    def energy(self, x: Array) -> float:
        """The energy at x."""
        return float(0.5 * x @ (self.stiffness @ x) - self.force @ x + self.arcs.energy(x).sum()) + self.constant

    def energy_size(self, x: Array) -> float:
        """The sum of the sizes of all parts of the energy at x: what rounding is relative to."""
        elastic = 0.5 * np.abs(x) @ (np.abs(self.stiffness) @ np.abs(x)) + np.abs(self.force) @ np.abs(x)
        return float(elastic + np.abs(self.arcs.energy(x)).sum()) + abs(self.constant)


@dataclass(frozen=True, kw_only=True)
class ArcTable:
    """Chains over the whole line as arrays (n, m); rows are padded with empty arcs at +inf.

    Attributes:
        low: begin of each arc; -inf at the first.
        high: end of each arc; inf at the last.
        anchors: displacements.
        values: energies at the anchors.
        tractions: at the anchors.
        slopes: of the tractions.
        before: traction at the end of each arc.
        after: traction at the begin of each arc.
    """

    low: Array
    high: Array
    anchors: Array
    values: Array
    tractions: Array
    slopes: Array
    before: Array
    after: Array

    @classmethod
    def of(cls, chains: Sequence[Chain]) -> ArcTable:
        """Stack chains."""
        m = max(len(c) for c in chains)
        table = np.array([[*c, *[Arc(INF, INF, 0.0, 0.0, 0.0, 0.0)] * (m - len(c))] for c in chains], dtype=float)
        low, high, anchors, values, tractions, slopes = np.moveaxis(table, 2, 0)
        end, begin = np.where(np.isfinite(high), high, anchors), np.where(np.isfinite(low), low, anchors)
        return cls(
            low=low,
            high=high,
            anchors=anchors,
            values=values,
            tractions=tractions,
            slopes=slopes,
            before=tractions + slopes * (end - anchors),
            after=tractions + slopes * (begin - anchors),
        )

    def at(self, x: Array) -> Integers:
        """The arc that holds x, of the two at a joint the left one; (n,)."""
        return np.asarray((self.high < x[:, None]).sum(axis=1), dtype=np.int64)

    def energy(self, x: Array) -> Array:
        """φᵢ(xᵢ), (n,)."""
        rows, k = np.arange(len(x)), self.at(x)
        d = x - self.anchors[rows, k]
        return np.asarray(self.values[rows, k] + (self.tractions[rows, k] + 0.5 * self.slopes[rows, k] * d) * d)

    def meets(self, low: Array, high: Array) -> Mask:
        """Which arcs have more than a point in common with a box, (n, m); where the box is a point, its arc.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        inside = (self.low < high[:, None]) & (self.high > low[:, None])
        points = np.flatnonzero(low >= high)
        inside[points] = False
        inside[points, self.at(low)[points]] = True
        return np.asarray(inside)

    def drops(self, low: Array, high: Array) -> Array:
        """The largest drop of the traction strictly inside a box, (n,); 0 where it only rises.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        inside = (self.high[:, :-1] > low[:, None]) & (self.high[:, :-1] < high[:, None])
        fall = np.where(inside, self.before[:, :-1] - self.after[:, 1:], 0.0)
        sizes = np.abs(self.before[:, :-1]) + np.abs(self.after[:, 1:])
        fall = np.where(fall > 1e-13 * np.where(inside, sizes, 0.0), fall, 0.0)
        return np.asarray(fall.max(axis=1, initial=0.0))

    def least_slope(self, low: Array, high: Array) -> Array:
        """The least slope of the arcs that meet a box, (n,).

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        return np.asarray(np.where(self.meets(low, high), self.slopes, np.inf).min(axis=1))
