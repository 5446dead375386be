"""Rigid motions of one body, or of bodies that meet: their basis and its fields.

Basis of one body: in 2D (t1, t2, r) with the rotation field (-(x2 - c2), x1 - c1); in 3D (t1, t2, t3, r1, r2, r3) with
r × (x - c). c is the body's centre; all lengths are nondimensional. Of several bodies: first the translations of all,
body by body, then the rotations of all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..typing import Array, Integers
from . import motion_names


@dataclass(frozen=True)
class RigidBody:
    """A body, as far as its rigid motions need it; nondimensional.

    Attributes:
        dimension: d, 2 or 3.
        centre: (3,).
        length: metres per unit of length, for the names of motions.
        name: where there are several bodies, what it is called.
        index: where there are several bodies, its number among them.
    """

    dimension: int
    centre: Array
    length: float = 1.0
    name: str = ""
    index: int = 0

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise ValueError(f"a body has 2 or 3 dimensions, not {self.dimension}")
        if np.shape(self.centre) != (3,):
            raise ValueError(f"the centre of a body is a point (3,), not an array {np.shape(self.centre)}")

    @property
    def motions(self) -> int:
        """Number of rigid motions: 3 in 2D, 6 in 3D."""
        return 3 if self.dimension == 2 else 6

    @property
    def shifts(self) -> int:
        """Number of translations among them; they come first."""
        return self.dimension

    def describe(self, coefficients: Array, *, signed: bool) -> str:
        """A motion in words, and whose it is.

        Args:
            coefficients: (3|6,), on the basis of this module.
            signed: whether the name has the sense too.
        """
        whose = f" of {self.name}" if self.name else ""
        return motion_names.describe(coefficients, self.centre, self.length, signed=signed) + whose


@dataclass(frozen=True)
class JoinedBodies:
    """Bodies that meet in interfaces, as far as their rigid motions need it; nondimensional.

    Attributes:
        bodies: at least two; the index of each is its number here.
        index: the number of the whole among all that do not meet.
    """

    bodies: tuple[RigidBody, ...]
    index: int = 0

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.bodies[0].dimension

    @property
    def name(self) -> str:
        """All names."""
        return " and ".join(body.name for body in self.bodies)

    @property
    def motions(self) -> int:
        """Number of rigid motions."""
        return sum(body.motions for body in self.bodies)

    @property
    def shifts(self) -> int:
        """Number of translations among them; they come first."""
        return sum(body.shifts for body in self.bodies)

    def own(self, number: int) -> Integers:
        """Which of the motions are those of one body, (3|6,).

        Args:
            number: of the body.
        """
        shifts, spins = self.bodies[number].shifts, self.bodies[number].motions - self.bodies[number].shifts
        first = self.shifts + number * spins
        return np.r_[number * shifts : (number + 1) * shifts, first : first + spins]

    def describe(self, coefficients: Array, *, signed: bool) -> str:
        """A motion in words: what the bodies do that move, those together that do the same.

        Args:
            coefficients: on the basis of this module.
            signed: whether the name has the sense too.
        """
        found: dict[str, list[str]] = {}
        for number, body in enumerate(self.bodies):
            own = np.asarray(coefficients)[self.own(number)]
            if np.abs(own).max() > motion_names.NEGLIGIBLE * np.abs(coefficients).max():
                motion = motion_names.describe(own, body.centre, body.length, signed=signed)
                found.setdefault(motion, []).append(body.name)
        return ", ".join(f"{motion} of {' and '.join(names)}" for motion, names in found.items())


AnyBody = RigidBody | JoinedBodies
"""What moves."""


class Movable(Protocol):
    """What has rigid motions: a body, bodies that meet, and what else moves with them."""

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def index(self) -> int:
        """Its number."""

    @property
    def motions(self) -> int:
        """Number of rigid motions."""

    @property
    def shifts(self) -> int:
        """Number of translations among them; they come first."""

    def describe(self, coefficients: Array, *, signed: bool) -> str:
        """A motion in words.

        Args:
            coefficients: on the basis, (motions,).
            signed: whether the name has the sense too.
        """


@dataclass(frozen=True)
class MotionFields:
    """What the basis motions are at some vertices: the displacement, on an interface the relative one.

    Attributes:
        values: (m, motions, d).
    """

    values: Array

    def __len__(self) -> int:
        return len(self.values)


Places = Array | MotionFields
"""Points (m, 3) of one body, nondimensional, or the motions there."""


def is_place(places: Places, count: int) -> bool:
    """Whether these are so many places.

    Args:
        places: points or motions.
        count: their number.
    """
    return len(places) == count and (isinstance(places, MotionFields) or np.shape(places) == (count, 3))


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


def mode_of(coefficients: Array, body: Movable, *, signed: bool) -> Mode:
    """The motion with the given coefficients, with its name.

    Args:
        coefficients: (3|6,), on the basis of this module.
        body: the body that moves.
        signed: whether the name has the sense too.
    """
    return Mode(body.describe(coefficients, signed=signed), tuple(float(c) for c in coefficients), body.index)


def fields_at(places: Places, body: Movable) -> Array:
    """The basis motions, (m, motions, d). Local to the rank.

    Args:
        places: points of the body, or the motions there.
        body: what moves.
    """
    if isinstance(places, MotionFields):
        return places.values
    if not isinstance(body, RigidBody):
        raise ValueError("points do not say which of several bodies they belong to; give MotionFields")
    return rigid_fields(places, body)


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
