"""The kernel Y: the rigid motions that the homogeneous linear conditions of a scene leave free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..typing import Array
from .motions import Mode, Movable, Places, fields_at, is_place, mode_of
from .thresholds import DEFAULT, RigidThresholds


@dataclass(frozen=True)
class FixedDirections:
    """Conditions direction·y(x) = 0; each rank gives its own rows.

    Attributes:
        points: x, (k, 3), or the motions there.
        directions: (k, d).
    """

    points: Places
    directions: Array

    def __post_init__(self) -> None:
        if np.ndim(self.directions) != 2 or not is_place(self.points, len(self.directions)):
            raise ValueError("FixedDirections needs points (k, 3) and directions (k, d) with the same k")


def kernel(
    comm: MPI.Comm, body: Movable, fixed: Sequence[FixedDirections], thresholds: RigidThresholds = DEFAULT
) -> Array:
    """A basis of Y as columns of rigid coefficients, (3|6, k). Collective; the same on all ranks.

    First the translations, orthonormal; then rotations about orthonormal axes, one radian each, whose
    displacement of the centre is orthogonal to those translations. Coordinate axes are taken where possible.
    Each rank sends one triangular factor; the singular values of all of them stacked decide the rank.

    Args:
        comm: the ranks of the mesh.
        body: the body that moves.
        fixed: the conditions, on each rank its own.
        thresholds: what counts as zero.
    """
    rows = np.vstack([np.zeros((0, body.motions)), *(_condition_rows(part, body) for part in fixed)])
    factors = comm.gather(triangle(rows), root=0)
    basis = None if factors is None else _natural_null_space(np.vstack(factors), body.shifts, thresholds)
    return np.asarray(comm.bcast(basis, root=0))


def _natural_null_space(rows: Array, shifts: int, thresholds: RigidThresholds) -> Array:
    return natural_basis(null_space(rows, thresholds), shifts, thresholds)


def modes(basis: Array, body: Movable) -> tuple[Mode, ...]:
    """The motions of a kernel's basis. Local.

    Args:
        basis: rigid coefficients (3|6, k), one column each.
        body: the body that moves.
    """
    return tuple(mode_of(column, body, signed=False) for column in basis.T)


def triangle(rows: Array) -> Array:
    """At most n rows with the null space and singular values of `rows` (m, n): the R of its QR factors."""
    return np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) else rows


def null_space(rows: Array, thresholds: RigidThresholds = DEFAULT) -> Array:
    """Orthonormal basis (n, k) of {z: rows @ z = 0}.

    Args:
        rows: (m, n), m = 0 allowed.
        thresholds: what counts as zero.
    """
    n = rows.shape[1]
    if not rows.any():
        return np.eye(n)
    _, values, right = np.linalg.svd(np.vstack([rows, np.zeros((n, n))]), full_matrices=False)
    return np.asarray(right[values <= thresholds.rounding * values[0]].T)


def natural_basis(basis: Array, count: int, thresholds: RigidThresholds = DEFAULT) -> Array:
    """The same space by translations first, then rotations, see `kernel`.

    Args:
        basis: rigid coefficients (3|6, k), one column for each motion.
        count: how many of the coefficients are translations; they come first.
        thresholds: what counts as zero.
    """
    basis = np.where(np.abs(basis) <= thresholds.rounding, 0.0, basis)
    shifts = _sparse_basis(basis[:count] @ null_space(basis[count:], thresholds), thresholds)
    spins = _sparse_basis(basis[count:], thresholds)
    lift = np.linalg.lstsq(basis[count:], spins, rcond=thresholds.rounding)[0]
    centre = basis[:count] @ lift
    centre = centre - shifts @ (shifts.T @ centre)
    zeros = np.zeros((len(basis) - count, shifts.shape[1]))
    return _snap(np.hstack([np.vstack([shifts, zeros]), np.vstack([centre, spins])]))


def _sparse_basis(vectors: Array, thresholds: RigidThresholds) -> Array:
    """Orthonormal basis of the span of the columns (n, k) of `vectors`, along axes where it can be."""
    left, values, _ = np.linalg.svd(vectors, full_matrices=False)
    span = left[:, values > thresholds.rounding]
    factor, upper = np.linalg.qr(_reduce(span))
    return _snap(factor * np.sign(np.diag(upper)))


def _reduce(span: Array) -> Array:
    """Column echelon form with full pivoting, columns ordered by pivot row."""
    columns = span.copy()
    pivots: list[int] = []
    for j in range(columns.shape[1]):
        open_rows = np.abs(columns[:, j:])
        row, offset = divmod(int(np.round(open_rows, 9).argmax()), open_rows.shape[1])
        columns[:, [j, j + offset]] = columns[:, [j + offset, j]]
        columns[:, j] /= columns[row, j]
        others = np.arange(columns.shape[1]) != j
        columns[:, others] -= np.outer(columns[:, j], columns[row, others])
        pivots.append(row)
    return columns[:, np.argsort(pivots)]


def _snap(values: Array) -> Array:
    """The values, with zero for what is rounding in an orthonormal basis."""
    return np.where(np.abs(values) < 1e-13, 0.0, values)


def _condition_rows(part: FixedDirections, body: Movable) -> Array:
    """(k, 3|6): the work of each condition on the basis motions."""
    return np.asarray(np.einsum("kd,knd->kn", part.directions, fields_at(part.points, body)))
