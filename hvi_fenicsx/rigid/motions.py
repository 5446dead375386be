"""Rigid motions of one body, or of bodies that meet: their basis and its fields.

Basis of one body: in 2D (t1, t2, r) with the rotation field (-(x2 - c2), x1 - c1); in 3D (t1, t2, t3, r1, r2, r3) with
r × (x - c). c is the body's centre; all lengths are nondimensional. Of several bodies: first the translations of all,
body by body, then the rotations of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class RigidThresholds:
    """Limits of the analysis; everything it compares is nondimensional and of order 1.

    Attributes:
        rounding: what counts as zero: a singular value beside the largest, a coefficient of a motion, a margin beside
            the work of the loads, a gap between value and lower bound that shrinks no more;
            a body that has gone its inverse (times p0 L / E0) slides away.
        exact: the same where rows have unit length and nothing was summed up: a row that constrains no motion, the
            violation of one, an energy above the least one.
        dropped: so small a share of an edge of a cone of slips, relative to the largest, is none.
        max_rounds: linear programmes for one minimum (friction in 3D needs about 40), and divisions of a cone of slips.
        touching: distance from its bound, over the largest bound, at which a vertex rests on it; part of a support's
            row that must not be spanned by others.
    """

    rounding: float = 1e-9
    exact: float = 1e-10
    dropped: float = 1e-3
    max_rounds: int = 2000
    touching: float = 1e-7


DEFAULT = RigidThresholds()


@dataclass(frozen=True)
class RigidBody:
    """A body, as far as its rigid motions need it; nondimensional.

    Attributes:
        dimension: d, 2 or 3.
        centre: (3,).
        length: metres per unit of length, for the names of motions.
        name: where there are several bodies, what it is called.
    """

    dimension: int
    centre: Array
    length: float = 1.0
    name: str = ""

    @property
    def motions(self) -> int:
        """Number of rigid motions: 3 in 2D, 6 in 3D."""
        return 3 if self.dimension == 2 else 6


@dataclass(frozen=True)
class JoinedBodies:
    """One body, or bodies that meet in interfaces, and obstacles that slide along given directions; nondimensional.

    Attributes:
        bodies: one, or all that meet.
        index: the number of the whole among all that do not meet.
        obstacles: their names; the way of each is a translation, after those of the bodies.
    """

    bodies: tuple[RigidBody, ...]
    index: int = 0
    obstacles: tuple[str, ...] = ()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.bodies[0].dimension

    @property
    def motions(self) -> int:
        """Number of rigid motions."""
        return sum(body.motions for body in self.bodies) + len(self.obstacles)

    @property
    def shifts(self) -> int:
        """Number of translations among them; they come first."""
        return len(self.bodies) * self.dimension + len(self.obstacles)

    def own(self, number: int) -> Integers:
        """Which of the motions are those of one body, (3|6,).

        Args:
            number: of the body.
        """
        shifts, spins = self.dimension, self.bodies[number].motions - self.dimension
        first = self.shifts + number * spins
        return np.r_[number * shifts : (number + 1) * shifts, first : first + spins]

    def describe(self, coefficients: Array, *, signed: bool) -> str:
        """A motion in words: what the bodies do that move, those together that do the same, and which obstacles move.

        Args:
            coefficients: on the basis of this module.
            signed: whether the name has the sense too.
        """
        found: dict[str, list[str]] = {}
        size = np.abs(coefficients) / np.abs(coefficients).max()
        for number, body in enumerate(self.bodies):
            own = self.own(number)
            if size[own].max() > NEGLIGIBLE:
                motion = describe(coefficients[own], body.centre, body.length, signed=signed)
                found.setdefault(motion, []).append(body.name)
        moved = ", ".join(
            motion + (f" of {' and '.join(names)}" if any(names) else "") for motion, names in found.items()
        )
        ways = size[self.shifts - len(self.obstacles) : self.shifts]
        who = " and ".join(name for name, way in zip(self.obstacles, ways, strict=True) if way > NEGLIGIBLE)
        if not who:
            return moved
        return f"{moved}, together with the obstacle of {who}" if moved else f"the obstacle of {who} alone"


@dataclass(frozen=True)
class Mode:
    """A rigid motion of one body, or of bodies that meet.

    Attributes:
        name: the motion in words.
        coefficients: (motions,), on the basis of this module.
        body: the index of what moves.
    """

    name: str
    coefficients: tuple[float, ...]
    body: int = 0


def mode_of(coefficients: Array, body: JoinedBodies, *, signed: bool) -> Mode:
    """The motion with the given coefficients, with its name.

    Args:
        coefficients: (3|6,), on the basis of this module.
        body: the body that moves.
        signed: whether the name has the sense too.
    """
    return Mode(body.describe(coefficients, signed=signed), tuple(float(c) for c in coefficients), body.index)


def rigid_fields(points: Array, body: RigidBody) -> Array:
    """The basis motions of one body, (m, 3|6, d). Local to the rank.

    Args:
        points: (m, 3), nondimensional.
        body: the body that moves.
    """
    d, centre = body.dimension, body.centre
    shifts = np.zeros((body.motions, d))
    shifts[:d] = np.eye(d)
    fields = np.tile(shifts.ravel(), len(points)).reshape(-1, *shifts.shape)  # far quicker than to fill it by columns
    if d == 2:
        np.subtract(centre[1], points[:, 1], out=fields[:, 2, 0])
        np.subtract(points[:, 0], centre[0], out=fields[:, 2, 1])
    else:
        fields[:, 3:, :] = np.cross(np.eye(3)[None], (points - centre)[:, None, :])
    return fields


def works(directions: Array, fields: Array) -> Array:
    """The work of a direction at each of some places in the basis motions, (m, motions).

    Args:
        directions: (m, d).
        fields: the basis motions there, (m, motions, d).
    """
    return np.einsum("md,mnd->mn", directions, fields)


def kernel(comm: MPI.Comm, body: JoinedBodies, fixed: Sequence[Array]) -> Array:
    """A basis of Y as columns of rigid coefficients, (3|6, k). Collective; the same on all ranks.

    First the translations, orthonormal; then rotations about orthonormal axes, one radian each, whose
    displacement of the centre is orthogonal to those translations. Coordinate axes are taken where possible.
    Each rank sends one triangular factor; the singular values of all of them stacked decide the rank.

    Args:
        comm: the ranks of the mesh.
        body: the body that moves.
        fixed: rows that are zero for all motions of Y, on each rank its own, (q, 3|6).
    """
    rows = np.vstack([np.zeros((0, body.motions)), *fixed])
    factors = comm.gather(triangle(rows), root=0)
    basis = None if factors is None else natural_basis(null_space(np.vstack(factors)), body.shifts)
    return comm.bcast(basis, root=0)


def modes(basis: Array, body: JoinedBodies) -> tuple[Mode, ...]:
    """The motions of a kernel's basis. Local.

    Args:
        basis: rigid coefficients (3|6, k), one column each.
        body: the body that moves.
    """
    return tuple(mode_of(column, body, signed=False) for column in basis.T)


def triangle(rows: Array) -> Array:
    """At most n rows with the null space and singular values of `rows` (m, n): the R of its QR factors."""
    return np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) else rows


def null_space(rows: Array) -> Array:
    """Orthonormal basis (n, k) of {z: rows @ z = 0}.

    Args:
        rows: (m, n), m = 0 allowed.
    """
    n = rows.shape[1]
    if not rows.any():
        return np.eye(n)
    _, values, right = np.linalg.svd(np.vstack([rows, np.zeros((n, n))]), full_matrices=False)
    return right[values <= DEFAULT.rounding * values[0]].T


def natural_basis(basis: Array, count: int) -> Array:
    """The same space by translations first, then rotations, see `kernel`.

    Args:
        basis: rigid coefficients (3|6, k), one column for each motion.
        count: how many of the coefficients are translations; they come first.
    """
    basis = np.where(np.abs(basis) <= DEFAULT.rounding, 0.0, basis)
    shifts = _sparse_basis(basis[:count] @ null_space(basis[count:]))
    spins = _sparse_basis(basis[count:])
    lift = np.linalg.lstsq(basis[count:], spins, rcond=DEFAULT.rounding)[0]
    centre = basis[:count] @ lift
    centre = centre - shifts @ (shifts.T @ centre)
    zeros = np.zeros((len(basis) - count, shifts.shape[1]))
    return _snap(np.hstack([np.vstack([shifts, zeros]), np.vstack([centre, spins])]))


def _sparse_basis(vectors: Array) -> Array:
    """Orthonormal basis of the span of the columns (n, k) of `vectors`, along axes where it can be."""
    left, values, _ = np.linalg.svd(vectors, full_matrices=False)
    span = left[:, values > DEFAULT.rounding]
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


NEGLIGIBLE = DEFAULT.rounding
"""A coefficient this small beside the largest is not named."""
AXES = "xyz"


def describe(coefficients: Array, centre: Array, length: float, *, signed: bool) -> str:
    """A motion in words, such as "translation along y".

    Args:
        coefficients: (3|6,).
        centre: of the body, (3,).
        length: metres per unit of length.
        signed: whether the name has the sense too: "translation along +y".
    """
    z = np.where(np.abs(coefficients) <= NEGLIGIBLE * np.abs(coefficients).max(), 0.0, coefficients)
    d = 2 if len(z) == 3 else 3
    shift, spin = z[:d], z[d:]
    if not spin.any():
        return f"translation along {_direction(shift, signed)}"
    return (_rotation_2d if d == 2 else _rotation_3d)(shift, spin, centre, length, signed)


def _rotation_2d(shift: Array, spin: Array, centre: Array, length: float, signed: bool) -> str:
    pole = centre[:2] + np.array([-shift[1], shift[0]]) / spin[0]
    sense = (", counterclockwise" if spin[0] > 0.0 else ", clockwise") if signed else ""
    return f"rotation about {_point(pole, length)}{sense}"


def _rotation_3d(shift: Array, spin: Array, centre: Array, length: float, signed: bool) -> str:
    """Every motion in space is a screw; the point named is the one of its axis nearest the centre."""
    square = float(spin @ spin)
    pole, pitch = centre + np.cross(spin, shift) / square, float(shift @ spin) / square
    axis = f"about the axis through {_point(pole, length)} along {_direction(spin, signed)}"
    if abs(pitch) <= NEGLIGIBLE:
        return f"rotation {axis}"
    return f"screw motion {axis}, advancing {_metres(pitch, length)} per radian"


def _direction(vector: Array, signed: bool) -> str:
    """An axis by its letter, else a unit vector; without a sign its first largest entry is positive."""
    unit = vector / np.linalg.norm(vector)
    if not signed and unit[np.abs(unit).round(6).argmax()] < 0.0:
        unit = -unit
    if np.abs(unit).max() < 1.0 - NEGLIGIBLE:
        return "(" + ", ".join(f"{_clean(c):.2f}" for c in unit) + ")"
    i = int(np.abs(unit).argmax())
    return (("+" if unit[i] > 0.0 else "-") if signed else "") + AXES[i]


def _point(point: Array, length: float) -> str:
    return "(" + ", ".join(_metres(c, length) for c in point) + ")"


def _metres(value: float, length: float) -> str:
    """A length in metres; one that is rounding beside the body is zero, however small the body is."""
    return f"{_clean(value) * length:.4g}"


def _clean(value: float) -> float:
    return 0.0 if abs(value) < NEGLIGIBLE else float(value)
