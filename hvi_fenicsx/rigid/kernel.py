"""The kernel Y: the rigid motions that the homogeneous linear conditions of a scene leave free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ..errors import InputError
from .motions import Body, Mode, named, rigid_fields

Array = NDArray[np.float64]

RANK = 1e-9  # singular values this small beside the largest count as zero


@dataclass(frozen=True)
class Fixed:
    """Conditions direction·y(x) = 0: points (k, 3), directions (k, d); each rank gives its own rows."""

    points: Array
    directions: Array

    def __post_init__(self) -> None:
        if np.ndim(self.directions) != 2 or np.shape(self.points) != (len(self.directions), 3):
            raise InputError("Fixed wants points (k, 3) and directions (k, d) with the same k")


def kernel(comm: MPI.Comm, body: Body, fixed: Sequence[Fixed]) -> Array:
    """A basis of Y as columns of rigid coefficients, (3|6, k). Collective; the same on all ranks.

    First the translations, orthonormal; then rotations about orthonormal axes, one radian each, whose
    displacement of the centre is orthogonal to those translations. Coordinate axes are taken where possible.
    Each rank sends one triangular factor; the singular values of all of them stacked decide the rank.
    """
    rows = np.vstack([np.zeros((0, body.motions)), *(_condition_rows(part, body) for part in fixed)])
    factors = comm.gather(triangle(rows), root=0)
    basis = natural_basis(null_space(np.vstack(factors)), body.dimension) if factors is not None else None
    return np.asarray(comm.bcast(basis, root=0))


def modes(basis: Array, body: Body) -> tuple[Mode, ...]:
    """The columns of a kernel's basis with their names. Local."""
    return tuple(named(column, body, signed=False) for column in basis.T)


def triangle(rows: Array) -> Array:
    """At most n rows with the null space and singular values of `rows` (m, n): the R of its QR factors."""
    return np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) else rows


def null_space(rows: Array) -> Array:
    """Orthonormal basis (n, k) of {z: rows @ z = 0}; rows (m, n), m = 0 allowed."""
    n = rows.shape[1]
    if not rows.any():
        return np.eye(n)
    _, values, right = np.linalg.svd(np.vstack([rows, np.zeros((n, n))]), full_matrices=False)
    return np.asarray(right[values <= RANK * values[0]].T)


def natural_basis(basis: Array, dimension: int) -> Array:
    """The same space of rigid coefficients (3|6, k) by translations first, then rotations, see `kernel`."""
    basis = np.where(np.abs(basis) <= RANK, 0.0, basis)
    shifts = sparse_basis(basis[:dimension] @ null_space(basis[dimension:]))
    spins = sparse_basis(basis[dimension:])
    lift = np.linalg.lstsq(basis[dimension:], spins, rcond=RANK)[0]
    centre = basis[:dimension] @ lift
    centre = centre - shifts @ (shifts.T @ centre)
    zeros = np.zeros((len(basis) - dimension, shifts.shape[1]))
    return _snap(np.hstack([np.vstack([shifts, zeros]), np.vstack([centre, spins])]))


def sparse_basis(vectors: Array) -> Array:
    """Orthonormal basis of the span of the columns (n, k) of `vectors`, along axes where it can be."""
    left, values, _ = np.linalg.svd(vectors, full_matrices=False)
    span = left[:, values > RANK]
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
    return np.where(np.abs(values) < 1e-13, 0.0, values)


def _condition_rows(part: Fixed, body: Body) -> Array:
    """(k, 3|6): the work of each condition on the basis motions."""
    return np.asarray(np.einsum("kd,knd->kn", part.directions, rigid_fields(part.points, body)))
