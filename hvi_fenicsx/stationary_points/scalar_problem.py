"""The condensed problem with its laws as chains of parabolas: ½ xᵀSx - fᵀx + Σ φᵢ, each of one argument.

An argument is an unknown, or the length of a vector of unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..laws.arc import Arc
from ..typing import Array, Integers, Mask
from .arcs import INF, ROUNDING, Chain
from .lengths import Lengths
from .rigid_motions import RigidMotions
from .thresholds import DEFAULT, Thresholds


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
        motions: the rigid motions, which S does not resist; None where they are not told.
        thresholds: the numbers that tune the search.
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
    motions: RigidMotions | None = None
    thresholds: Thresholds = DEFAULT

    @property
    def far(self) -> float:
        """A displacement far beyond all joints of the chains: the end of what is searched."""
        return min(self.thresholds.polylines.far * self.reach, self.farthest)

    @cached_property
    def reach(self) -> float:
        """The largest displacement at which a chain has a joint, and one unit at least."""
        ends = (abs(e) for c in self.chains for a in c for e in (a.low, a.high))
        return max([1.0, *(e for e in ends if e < INF)])

    @cached_property
    def joint(self) -> float:
        """The largest displacement at which a traction bends or jumps by a share of its peak; one if there is none."""
        arcs = self.arcs
        at, rises = arcs.high[:, :-1], np.abs(arcs.after[:, 1:] - arcs.before[:, :-1])
        places = np.where(np.isfinite(at), np.abs(at), 0.0)
        bends = rises + np.abs(np.diff(arcs.slopes, axis=1)) * places
        peaks = np.maximum(np.abs(arcs.before), np.abs(arcs.after)).max(axis=1)
        seen = places[np.isfinite(at) & (places > 0.0) & (bends > self.thresholds.polylines.bent * peaks[:, None])]
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
        return np.asarray(d[: self.size] + self.lengths.diagonal(d[self.size :], self.size))

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
        table = np.full((len(chains), max(len(c) for c in chains), 6), Arc(INF, INF, 0.0, 0.0, 0.0, 0.0))
        for rows, arcs in zip(table, chains, strict=True):
            rows[: len(arcs)] = arcs
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

    @cached_property
    def rounding(self) -> Array:
        """The size of a jump of the traction that is rounding, (n,)."""
        return np.asarray(ROUNDING * np.maximum(np.abs(self.before), np.abs(self.after)).max(axis=1))

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
        fall = np.where(fall > self.rounding[:, None], fall, 0.0)
        return np.asarray(fall.max(axis=1, initial=0.0))

    def least_slope(self, low: Array, high: Array) -> Array:
        """The least slope of the arcs that meet a box, (n,).

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        return np.asarray(np.where(self.meets(low, high), self.slopes, np.inf).min(axis=1))

    def rates(self, t: Array) -> tuple[Array, Array]:
        """The tractions right of and left of t, (n,) each."""
        rows = np.arange(len(t))
        behind, k = np.asarray((self.high <= t[:, None]).sum(axis=1), dtype=np.int64), self.at(t)
        after, before = (
            self.tractions[rows, i] + self.slopes[rows, i] * (t - self.anchors[rows, i]) for i in (behind, k)
        )
        return np.asarray(after), np.asarray(before)

    def least(self, low: Array, high: Array, added: Array, force: Array) -> tuple[Array, Array]:
        """The least of φ + ½ d t² - force t over an interval, and the t where it is taken, (n,) each.

        Args:
            low: of the intervals, finite, (n,).
            high: of the intervals, finite, (n,).
            added: d, (n,).
            force: (n,).
        """
        first, last = np.maximum(self.low, low[:, None]), np.minimum(self.high, high[:, None])
        slope, offset = self.slopes + added[:, None], self.tractions - self.slopes * self.anchors - force[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            turn = np.clip(np.where(slope > 0.0, -offset / slope, first), first, last)
            places = np.stack([first, last, turn])
            d = places - self.anchors
            values = self.values + (self.tractions + 0.5 * self.slopes * d) * d
            values += (0.5 * added[:, None] * places - force[:, None]) * places
        values = np.where(first <= last, values, np.inf)
        flat = np.moveaxis(values, 0, 1).reshape(len(low), -1)
        k = np.argmin(flat, axis=1)[:, None]
        at = np.moveaxis(places, 0, 1).reshape(len(low), -1)
        return np.take_along_axis(flat, k, axis=1)[:, 0], np.take_along_axis(at, k, axis=1)[:, 0]
