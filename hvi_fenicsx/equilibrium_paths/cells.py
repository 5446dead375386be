"""One cell of the piecewise linear equations: on which segment of its graph each unknown is, and where.

S x(τ) + r(τ) = f0 + λ f1, with x and r linear in the coordinates τ on the segments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..reduced.condensed_stiffness import ZERO, CellColumns, CellInverse, CondensedStiffness
from ..typing import Array, Integers, Mask
from .neutral import Unresisted, are_same, pins, unresisted
from .segments import Kind, Segment


class Cells:
    """The segments of all n unknowns and their coordinates.

    Args:
        stiffness: S.
        chains: the segments of each unknown.
        numbers: which of them it is on, (n,).
        coordinates: τ, (n,).

    Attributes:
        numbers: as given; changed by :meth:`enter`.
        tau: the coordinates.
        slope: of the force, (n,).
        rise: ±1 where the displacement stands, else 0, (n,).
        low: least coordinates, (n,).
        high: greatest coordinates, (n,).
        outward: directions in which bonds with memory go on, (n,).
        bound: whether the unknown is at a bound, (n,).
        held: rigid motions that nothing resists and no load drives, as orthonormal rows, (d, n).
        pins: springs that hold them and carry nothing, by unknown, (n,).
    """

    def __init__(
        self,
        stiffness: CondensedStiffness,
        chains: Sequence[tuple[Segment, ...]],
        numbers: Integers,
        coordinates: Array,
    ) -> None:
        self._stiffness, self._chains, n = stiffness, list(chains), len(chains)
        self.numbers, self.tau = np.zeros(n, dtype=np.int64), np.zeros(n)
        self._x, self._force = np.zeros(n), np.zeros(n)
        self.slope, self.rise, self.low, self.high = (np.zeros(n) for _ in range(4))
        self.outward, self.bound = np.zeros(n), np.zeros(n, dtype=bool)
        self.held: Array = np.empty((0, n))
        self.pins = np.zeros(n)
        for i in range(n):
            self.enter(i, int(numbers[i]), float(coordinates[i]))

    def __len__(self) -> int:
        return len(self.tau)

    def segment(self, i: int) -> Segment:
        """Where an unknown is."""
        return self._chains[i][self.numbers[i]]

    def chain(self, i: int) -> tuple[Segment, ...]:
        """The segments of an unknown."""
        return self._chains[i]

    def beyond(self, i: int, *, forward: bool) -> tuple[int, float]:
        """The number of the segment next to an unknown's, and the coordinate of the end at which they meet.

        Args:
            i: the unknown.
            forward: whether the one that comes after its own.
        """
        number = int(self.numbers[i]) + (1 if forward else -1)
        segment = self._chains[i][number]
        return number, segment.low if forward else segment.high

    def enter(self, i: int, number: int, coordinate: float) -> None:
        """Put an unknown on a segment.

        Args:
            i: the unknown.
            number: of the segment.
            coordinate: τ there.
        """
        segment = self._chains[i][number]
        self.numbers[i], self.tau[i] = number, coordinate
        self._x[i], self._force[i] = segment.x, segment.force
        self.slope[i], self.rise[i] = segment.slope, segment.rise
        self.low[i], self.high[i], self.outward[i] = segment.low, segment.high, segment.outward
        self.bound[i] = segment.kind is Kind.BOUND

    def replace_chain(self, i: int, chain: tuple[Segment, ...], number: int, coordinate: float) -> None:
        """Give an unknown other segments, and put it on one of them.

        Args:
            i: the unknown.
            chain: its segments.
            number: of the one that it is on.
            coordinate: τ there.
        """
        self._chains[i] = chain
        self.enter(i, number, coordinate)

    @property
    def moving(self) -> Mask:
        """The unknowns whose displacement moves, (n,)."""
        return np.asarray(self.rise == 0.0)

    @property
    def x(self) -> Array:
        """The displacements, (n,)."""
        return self._x + np.where(self.rise == 0.0, self.tau, 0.0)

    @property
    def force(self) -> Array:
        """The forces of laws and bounds, (n,)."""
        return self._force + np.where(self.rise == 0.0, self.slope, self.rise) * self.tau

    @property
    def bond_force(self) -> Array:
        """The forces of the laws alone, (n,)."""
        return np.asarray(np.where(self.bound, self._force, self.force))

    @property
    def standing_force(self) -> Array:
        """The forces at τ = 0, (n,)."""
        return self._force

    def column(self, i: int) -> Array:
        """How the equations change with a coordinate, (n,)."""
        if self.rise[i]:
            return np.asarray(self.rise[i] * np.eye(1, len(self), i)[0])
        found = self._stiffness.column(i)
        found[i] += self.tangent[i]
        return found

    @property
    def tangent(self) -> Array:
        """The slopes of the forces of laws and of what pins the body, (n,)."""
        return np.asarray(self.slope + self.pins)

    def unresisted(self, rate: Array) -> Unresisted:
        """The rigid motions that nothing resists.

        Args:
            rate: the load that grows, (n,).
        """
        if not len(self._stiffness.rigid):
            return Unresisted.none(rate)
        rigid, stiffest = self._stiffness.rigid, float(np.max(self._stiffness.diagonal, initial=0.0))
        resists = ~self.moving | (np.abs(self.slope) > ZERO * stiffest)
        return unresisted(rigid, rigid[:, resists], rate)

    def hold(self, rate: Array) -> bool:
        """Hold the motions that nothing resists and no load drives; whether they are others than before.

        Args:
            rate: the load that grows, (n,).
        """
        held = self.unresisted(rate).held
        if are_same(held, self.held):
            return False
        self.held, self.pins = held, np.zeros(len(self))
        self.pins[pins(held)] = float(np.max(self._stiffness.diagonal, initial=0.0)) or 1.0
        return True

    def columns(self, driver: int | None, factor: Array) -> CellColumns:
        """The columns of the cell's equations.

        Args:
            driver: the unknown in whose place is the factor; None: all are in their own places.
            factor: the factor's column, (n,).
        """
        return CellColumns(slope=self.tangent, rise=self.rise.copy(), driver=driver, factor=factor)

    def inverse(self) -> CellInverse:
        """The inverse of the cell's equations.

        Raises:
            numpy.linalg.LinAlgError: they are singular.
        """
        return self._stiffness.inverse(self.columns(None, np.zeros(len(self))))

    def is_singular(self) -> bool:
        """Whether the unknowns that move can do so without any stiffness, or against a negative one."""
        return self._stiffness.is_singular(self.moving, self.slope)

    def unstable_directions(self, negligible: float = 1e-12) -> int:
        """The number of directions in which the energy falls at constant loads.

        Args:
            negligible: an eigenvalue that is zero, relative to the greatest.
        """
        drops = np.count_nonzero((self.rise < 0.0) & ~self.bound)
        return self._stiffness.negative_directions(self.moving, self.tangent, negligible) + int(drops)

    def is_stable(self, negligible: float = 1e-12) -> bool:
        """Whether the energy falls in no direction at constant loads.

        Args:
            negligible: an eigenvalue that is zero, relative to the greatest.
        """
        return not np.any((self.rise < 0.0) & ~self.bound) and not self.unstable_directions(negligible)
