"""The graphs of all points as chains of segments, where each point is on its own, and what their laws remember.

A point is an unknown with its laws and bounds, or the unknowns of a law on a length (:class:`.VectorPoints`). Its graph
of force over displacement is one continuous line, vertical where a law jumps and at a bound (:mod:`.segments`); s runs
along it, nondimensional. The coordinate of a point of a length is a vector z of length s: displacement and force have
its direction. A point's status is the number of the segment on which it is. So sticking, sliding, a drop at a fixed
length and what is remembered all have smooth equations. An opening has a point of its own beside, without a law: what
it does where it is not positive.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Integers, Mask
from .curved_laws import Deviations
from .point_laws import PointLaws
from .segments import Segment, beside_opening, chain, extremes, from_zero
from .state import PathState
from .thresholds import ROUNDING
from .vertex_laws import shares

Kept = tuple[Integers, Array]
"""The numbers of the segments on which all points are, (m,), and what their laws remember, (v, 4)."""


class PointStatuses(PointLaws):
    """All points, each on one segment of its graph.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.

    Attributes:
        numbers: of the segments on which the points are, (m,).
        low: least s, (m,).
        high: greatest s, (m,).
        outward: where bonds with memory go on, 1 or -1; else 0, (m,).
        least: force that each point may yet have, beside the one that it has, (m,).
        greatest: likewise.
        elastic: S, or another one while a body moves.
        rigid: the displacements that S does not resist, as orthonormal rows, (k, n).

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int] = ()) -> None:
        super().__init__(problem, remember)
        self.elastic, self.rigid = problem.elastic, problem.elastic.rigid
        self._groups = list({law.group: law.laws for law in self.vertices}.values())
        self._ends = np.cumsum([len(laws.weights) for laws in self._groups])[:-1]
        self._deviations = Deviations(self.laws)
        m = len(self.laws)
        self.numbers = np.zeros(m, dtype=np.int64)
        self.low, self.high, self.outward = np.zeros(m), np.zeros(m), np.zeros(m)
        self.least, self.greatest = np.zeros(m), np.zeros(m)
        self._base, self._x, self._force = np.zeros(m), np.zeros(m), np.zeros(m)
        self._moves, self._rises = np.zeros(m), np.zeros(m)
        self._bound, self._curved, self._bent = (np.zeros(m, dtype=bool) for _ in range(3))
        self._chains: list[tuple[Segment, ...]] = [()] * m
        self._bases: list[Array] = [np.zeros(0)] * m
        self._extremes: list[Array] = [np.zeros((0, 2))] * m
        for k in range(m):
            self.rebuild(k)

    # -- graphs

    def rebuild(self, k: int) -> None:
        """Make the segments of a point with what its laws remember now.

        Args:
            k: the point.
        """
        self._chains[k] = self._segments(k)
        self._bases[k] = self._based(k)
        remembers = all(law.passed is not None for law in self.laws[k])
        self._extremes[k] = extremes(self._chains[k], remembers=remembers)

    @property
    def stiffness(self) -> Array:
        """S as an array, (n, n)."""
        return self.elastic.array

    def _segments(self, k: int) -> tuple[Segment, ...]:
        if self.radial(k) is not None:
            return from_zero(chain(self.laws[k], 0.0, np.inf))
        i = self.unknowns[k][0]
        low, high = float(self._problem.lower[i]), float(self._problem.upper[i])
        return beside_opening(low) if self.is_opening(k) else chain(self.laws[k], low, high)

    def _based(self, k: int) -> Array:
        """Where s is at the coordinate 0 of each segment."""
        found, at = np.zeros(len(self._chains[k])), 0.0
        if self.straight:
            return found
        for number, segment in enumerate(self._chains[k]):
            unit = self.unit(k, segment)
            if np.isfinite(segment.low):
                found[number] = at - segment.low / unit
                at += (segment.high - segment.low) / unit
            else:
                found[number] = -segment.high / unit if np.isfinite(segment.high) else 0.0
        return found - found[-1] if self.is_opening(k) else found

    def unit(self, k: int, segment: Segment) -> float:
        """The unit of a segment's own coordinate.

        Args:
            k: the point.
            segment: one of its segments.
        """
        return float(self._force_units[k]) if segment.rise else self.length

    def segment(self, k: int) -> Segment:
        """Where a point is."""
        return self._chains[k][self.numbers[k]]

    def chain(self, k: int) -> tuple[Segment, ...]:
        """The segments of a point."""
        return self._chains[k]

    def enter(self, k: int, number: int) -> None:
        """Put a point on a segment.

        Args:
            k: the point.
            number: of the segment.
        """
        segment, base = self._chains[k][number], float(self._bases[k][number])
        unit = self.unit(k, segment)
        self.numbers[k], self._base[k] = number, base
        self.low[k], self.high[k], self.outward[k] = base + segment.low / unit, base + segment.high / unit, 0
        if self.radial(k) is not None and number == 0:
            self.low[k] = -np.inf  # a length passes through 0
        self._x[k], self._force[k] = segment.x, segment.force
        self._moves[k] = 0.0 if segment.rise else unit
        self._rises[k] = (segment.rise or segment.slope) * unit
        self._bound[k] = segment.bound
        self.outward[k] = segment.outward
        self.least[k], self.greatest[k] = self._extremes[k][number]
        self._curved[k] = self._deviations.enter(k, segment)
        self._bent[k] = self._curved[k] or self._turns(k)
        if self.is_opening(k):  # it counts in its length, or not
            self.vectors.counts[self.vectors.flat == self.unknowns[k]] = number == len(self._chains[k]) - 1
            of = self.owner(k)
            self._bent[of] = self._curved[of] or self._turns(of)

    def _turns(self, k: int) -> bool:
        """Whether a point's vector may turn without its force being a multiple of it."""
        p = self.radial(k)
        if p is None or self.vectors.counted(p) <= 1:
            return False
        return any(law.bonds.mixity is not None for law in self.laws[k]) or not self._proportional(k)

    def _proportional(self, k: int) -> bool:
        """Whether displacement and force are multiples of s on the present segment."""
        x = (self._x[k] - self._moves[k] * self._base[k]) / self.length
        force = (self._force[k] - self._rises[k] * self._base[k]) / self._force_units[k]
        return bool(abs(x) + abs(force) <= 1e-12)

    def enter_next(self, k: int, *, forward: bool) -> None:
        """Put a point on the segment next to its own.

        Args:
            k: the point.
            forward: whether on the one that comes after its own.
        """
        self.enter(k, int(self.numbers[k]) + (1 if forward else -1))

    def leave(self, z: Array, k: int, *, forward: bool) -> None:
        """Put a point on the segment next to its own, at the end at which they meet.

        Args:
            z: all coordinates, changed, (n,).
            k: the point.
            forward: whether on the one that comes after its own.
        """
        self.enter_next(k, forward=forward)
        self.set(z, k, float(self.low[k] if forward else self.high[k]))

    def coordinate(self, k: int, x: float, force: float) -> float:
        """The s of a displacement and its force on the present segment.

        Args:
            k: the point.
            x: along the point's direction.
            force: likewise.
        """
        segment = self.segment(k)
        return float(self._base[k] + segment.coordinate(x, force) / self.unit(k, segment))

    def set(self, z: Array, k: int, s: float) -> None:
        """Change the coordinates of a point to another s in the same direction.

        Args:
            z: all coordinates, changed, (n,) or more.
            k: the point.
            s: the new one.
        """
        p = self.radial(k)
        if p is None:
            z[self.unknowns[k]] = s
        else:
            here = self.vectors.owner == p
            group = self.vectors.groups[p]
            z[group] = np.where(self.vectors.counts[here], s * self.polar(z)[1][here], z[group])

    def polar(self, z: Array) -> tuple[Array, Array]:
        """The coordinates along the graphs, (m,), and the unit vectors of the points of lengths, (N,).

        Args:
            z: the coordinates, (n,).
        """
        lengths, directions = self.vectors.polar(z)
        return np.concatenate([z[self.one], lengths, z[self.vectors.opening_unknowns]]), directions

    def rates(self, z: Array, direction: Array) -> Array:
        """How s changes along a direction of the coordinates, (m,); a length of 0, but for rounding, grows in each.

        Args:
            z: the coordinates, (n,).
            direction: of them, (n,).
        """
        vectors = self.vectors
        lengths, directions = vectors.polar(z)
        moved = lengths > ROUNDING
        along = np.where(moved, vectors.along(directions, direction), vectors.polar(direction)[0])
        return np.concatenate([direction[self.one], along, direction[vectors.opening_unknowns]])

    @property
    def moving(self) -> Mask:
        """The points whose displacements move, (m,)."""
        return self._moves != 0.0

    @property
    def slope(self) -> Array:
        """How steeply the forces rise at points that move, else 0, (m,); of straight graphs."""
        return np.where(self._moves != 0.0, self._rises, 0.0)

    @property
    def rise(self) -> Array:
        """±1 where the displacement stands, else 0, (m,); of straight graphs."""
        return np.where(self._moves != 0.0, 0.0, self._rises)

    @property
    def stiffest(self) -> float:
        """The largest stiffness of an unknown."""
        if self.straight:
            return float(np.max(self.elastic.diagonal, initial=0.0))
        return float(np.max(self.forces, initial=0.0)) / self.length

    def on_drops(self) -> list[int]:
        """The points where a law drops."""
        return [int(k) for k in np.flatnonzero((self._moves == 0.0) & (self._rises < 0.0) & ~self._bound)]

    # -- memory

    @property
    def memory(self) -> Array | None:
        """What the laws at all vertices remember, (v, 4), as :meth:`.VertexLaw.memory`; None where none does."""
        return self._remembered if any(laws.memory is not None for laws in self._groups) else None

    @property
    def _remembered(self) -> Array:
        """The same, with zeros of those that remember nothing."""
        parts = [np.zeros((len(g.weights), 4)) if g.memory is None else g.memory for g in self._groups]
        return np.concatenate([np.zeros((0, 4)), *parts])

    def kept(self) -> Kept:
        """Where all points are and what their laws remember, for :meth:`restore`."""
        return self.numbers.copy(), self._remembered

    def restore(self, kept: Kept) -> None:
        """Go back to where all points were.

        Args:
            kept: as :meth:`kept` found it.
        """
        numbers, memory = kept
        changed = np.flatnonzero(np.any(memory != self._remembered, axis=1))
        for laws, part in zip(self._groups, np.split(memory, self._ends), strict=False):  # one part of none
            if laws.memory is not None:
                laws.memory[:] = part
        for row in changed:
            self.vertices[row].forget_graph()
        for k in np.unique([self.point_of[self.vertices[row].unknowns[0]] for row in changed]):
            self.rebuild(int(k))
        for k, number in enumerate(numbers):
            self.enter(k, int(number))

    def take(self, state: PathState) -> Array:
        """Put all points where they were at a state of a path; their coordinates, (n,).

        Args:
            state: the state.
        """
        self.restore((state.position.numbers, self._remembered if state.memory is None else state.memory))
        return state.position.z.copy()

    def remember(self, k: int, x: float, traction: float) -> float:
        """Let a point's laws note where they have been, and take its segments anew.

        Args:
            k: the point.
            x: along the point's direction.
            traction: the force there.

        Returns:
            The displacement, 0 where it is rounding.
        """
        x = x if any(law.has_moved(x) for law in self.laws[k]) else 0.0
        for law, share in zip(self.laws[k], shares(self.laws[k], x, traction), strict=True):
            law.remember(x, share)
        self.rebuild(k)
        return x
