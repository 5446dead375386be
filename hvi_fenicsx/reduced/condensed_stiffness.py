"""The stiffness S of a condensed problem, and the equations of one cell of its piecewise linear laws.

In a cell some unknowns move, with a slope k of their laws' forces; the others stand, and their forces are unknown. The
equations of the cell have the columns S e_i + k_i e_i of unknowns that move, and ± e_i of those that stand. One of
these variables may drive; the factor then takes its column. Their inverse is kept, and changed where one column is
exchanged.

S is an array (:class:`DenseStiffness`), or known by factorisations of the whole body
(:mod:`.factorised_stiffness`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs, dsytrf
from typing_extensions import override

from ..typing import Array, Mask

_ROUNDS = 4
"""Steps of an inverse iteration: each leaves of what is stiff the shift over its stiffness."""


@dataclass(frozen=True, kw_only=True)
class CellColumns:
    """What the columns of a cell's equations are.

    Attributes:
        slope: k of unknowns that move, (n,).
        rise: ±1 of unknowns that stand, 0 of those that move, (n,).
        driver: the unknown in whose place is the factor; None: all are in their own places.
        factor: the factor's column, (n,).
    """

    slope: Array
    rise: Array
    driver: int | None
    factor: Array

    @property
    def moving(self) -> Mask:
        """The unknowns that move, (n,)."""
        return self.rise == 0.0


class CellInverse:
    """The inverse of a cell's equations: what it does, and the columns that were exchanged since.

    Args:
        first: what all variables are for given right-hand sides before columns are exchanged.
        most: columns to exchange before it is long.
    """

    def __init__(self, first: Callable[[Array], Array], most: int) -> None:
        self._first, self._most = first, most
        self._changes: tuple[Callable[[Array], None], ...] = ()

    def solve(self, right: Array) -> Array:
        """What all variables are for given right-hand sides, (n,). Collective.

        Args:
            right: of the equations, (n,).
        """
        found = self._first(right)
        for change in self._changes:
            change(found)
        return found

    def exchange(self, values: Array, place: int) -> None:
        """Put another column in a place.

        Args:
            values: what :meth:`solve` finds for the new column, (n,).
            place: where.
        """
        spread, pivot = values.copy(), float(values[place])
        spread[place] -= 1.0

        def change(found: Array) -> None:
            found -= (found[place] / pivot) * spread

        self._changes = (*self._changes, change)

    def swap(self, one: int, other: int) -> None:
        """Swap the places of two variables.

        Args:
            one: the first place.
            other: the second one.
        """

        def change(found: Array) -> None:
            found[[one, other]] = found[[other, one]]

        self._changes = (*self._changes, change)

    def copy(self) -> CellInverse:
        """The same, to be changed by itself."""
        return copy(self)  # the changes are never changed

    @property
    def is_long(self) -> bool:
        """Whether so many columns were exchanged that it had better be found anew."""
        return len(self._changes) > self._most


def by_factors(matrix: Array, most: int) -> CellInverse:
    """The inverse of a matrix by its triangular factors.

    Args:
        matrix: the equations, (n, n); overwritten if its columns are contiguous.
        most: columns to exchange before it is long.

    Raises:
        numpy.linalg.LinAlgError: it is singular, or not finite.
    """
    if not matrix.size:
        return CellInverse(np.copy, most)  # LAPACK factorises no empty matrix
    factors, pivots, failed = dgetrf(matrix, overwrite_a=1)
    if failed or not np.all(np.isfinite(factors)):
        raise np.linalg.LinAlgError("the tangent is singular")
    return CellInverse(lambda right: dgetrs(factors, pivots, right)[0], most)


class CondensedStiffness(ABC):
    """S, symmetric and positive semidefinite, (n, n)."""

    @property
    @abstractmethod
    def array(self) -> Array:
        """S as an array, (n, n). Collective."""

    @property
    @abstractmethod
    def diagonal(self) -> Array:
        """What forces on single unknowns are measured by, (n,): of S, or greater."""

    @abstractmethod
    def __matmul__(self, x: Array) -> Array:
        """S x, (n,). Collective."""

    @abstractmethod
    def column(self, i: int) -> Array:
        """S e_i, (n,). Collective."""

    @abstractmethod
    def raised(self, by: float) -> CondensedStiffness:
        """S + by I."""

    @abstractmethod
    def inverse(self, columns: CellColumns) -> CellInverse:
        """The inverse of a cell's equations. Collective.

        Args:
            columns: what they are.

        Raises:
            numpy.linalg.LinAlgError: they are singular.
        """

    @abstractmethod
    def negative_directions(self, moving: Mask, slope: Array, negligible: float) -> int:
        """The number of negative eigenvalues of S + diag(slope) of the unknowns that move. Collective.

        Args:
            moving: the unknowns that move, (n,).
            slope: of the laws' forces, (n,).
            negligible: an eigenvalue that is zero, relative to the largest sum of a row.
        """

    @cached_property
    def rigid(self) -> Array:
        """The displacements that S does not resist, as orthonormal rows, (k, n): by inverse iteration. Collective."""
        diagonal = self.diagonal
        n, none = len(diagonal), np.zeros(len(diagonal))
        count = self.negative_directions(np.ones(n, dtype=bool), none, -ZERO)
        found = np.eye(n, count)
        if 0 < count < n:
            shifted = self.raised(ZERO * float(np.max(diagonal)))
            inverse = shifted.inverse(CellColumns(slope=none, rise=none, driver=None, factor=none))
            found = np.random.default_rng(0).standard_normal((n, count))
            for _ in range(_ROUNDS):
                found = np.linalg.qr(np.stack([inverse.solve(column) for column in found.T], axis=1))[0]
        return found.T

    @abstractmethod
    def free(self) -> None:
        """Free the PETSc objects, where there are any: those of all that it was raised to, too. Collective."""

    def is_singular(self, moving: Mask, slope: Array) -> bool:
        """Whether some displacement of the unknowns that move meets no stiffness, or a negative one. Collective.

        Args:
            moving: the unknowns that move, (n,).
            slope: of the laws' forces, (n,).
        """
        return self.negative_directions(moving, slope, -ZERO) > 0


class DenseStiffness(CondensedStiffness):
    """S as an array.

    Args:
        array: S, (n, n).
    """

    def __init__(self, array: Array) -> None:
        self._array, self._rounding = array, rounding_of(array)

    @property
    @override
    def array(self) -> Array:
        return self._array

    @property
    @override
    def diagonal(self) -> Array:
        return np.diag(self._array)

    @override
    def __matmul__(self, x: Array) -> Array:
        return self._array @ x

    @override
    def column(self, i: int) -> Array:
        return self._array[i].copy()

    @override
    def raised(self, by: float) -> CondensedStiffness:
        return DenseStiffness(self._array + by * np.eye(len(self._array)))

    @override
    def inverse(self, columns: CellColumns) -> CellInverse:
        moving = columns.moving
        matrix = np.where(moving, self._array, 0.0)
        matrix[np.diag_indices(len(matrix))] += np.where(moving, columns.slope, columns.rise)
        if columns.driver is not None:
            matrix[:, columns.driver] = columns.factor
        return by_factors(matrix, len(matrix) // 10)

    @override
    def negative_directions(self, moving: Mask, slope: Array, negligible: float) -> int:
        free = np.flatnonzero(moving)
        inner = self._array[np.ix_(free, free)] + np.diag(slope[free])
        return negative_directions(inner, negligible, self._rounding)

    @override
    def free(self) -> None:
        pass  # arrays only


ZERO = 1e-11
"""An eigenvalue so small beside the greatest is zero."""


def rounding_of(stiffness: Array) -> float:
    """What is nothing in a stiffness, and in what is left of it where unknowns are held.

    Args:
        stiffness: symmetric, (n, n).
    """
    return len(stiffness) * float(np.finfo(float).eps * np.linalg.norm(stiffness, 1)) if len(stiffness) else 0.0


def negative_directions(stiffness: Array, negligible: float, rounding: float = 0.0) -> int:
    """The number of negative eigenvalues, by the signs of the pivots of LDLᵀ (Sylvester's law of inertia).

    Args:
        stiffness: symmetric, (n, n).
        negligible: an eigenvalue that is zero, relative to the largest sum of a row; negative: zero ones count.
        rounding: an eigenvalue that is zero.
    """
    if not len(stiffness):
        return 0
    shifted = np.array(stiffness, order="F")
    size = max(abs(negligible) * float(np.linalg.norm(stiffness, 1)), rounding)
    shifted[np.diag_indices(len(shifted))] += np.copysign(size, negligible)
    factors, pivots, _ = dsytrf(shifted, lower=1, overwrite_a=1)
    pairs = pivots < 0  # a block of two pivots has one negative eigenvalue and one positive
    return int(np.count_nonzero(np.diag(factors)[~pairs] < 0.0) + np.count_nonzero(pairs) // 2)
