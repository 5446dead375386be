"""Rigid motions of one body: their fields, and what they are called.

Basis: in 2D (t1, t2, r) with the rotation field (-(x2 - c2), x1 - c1); in 3D (t1, t2, t3, r1, r2, r3) with
r × (x - c). c is the body's centre; all lengths are nondimensional.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]

TINY = 1e-9  # a coefficient this small beside the largest is not worth a word
AXES = "xyz"


@dataclass(frozen=True)
class Body:
    """Dimension d (2 or 3) and centre (3,), nondimensional.

    For words only: metres per unit of `length`, and where there are several bodies its `name` and `index` among them.
    """

    dimension: int
    centre: Array
    length: float = 1.0
    name: str = ""
    index: int = 0

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise InputError(f"a body has 2 or 3 dimensions, not {self.dimension}")
        if np.shape(self.centre) != (3,):
            raise InputError(f"the centre of a body is a point (3,), not an array {np.shape(self.centre)}")

    @property
    def motions(self) -> int:
        """Number of rigid motions: 3 in 2D, 6 in 3D."""
        return 3 if self.dimension == 2 else 6


@dataclass(frozen=True)
class Mode:
    """A rigid motion of one body: in words, as coefficients (3 or 6) on the basis of this module, the body's index."""

    words: str
    coefficients: tuple[float, ...]
    body: int = 0


def named(coefficients: Array, body: Body, *, signed: bool) -> Mode:
    """The motion with these coefficients (3|6,), described."""
    return Mode(describe(coefficients, body, signed=signed), tuple(float(c) for c in coefficients), body.index)


def rigid_fields(points: Array, body: Body) -> Array:
    """The basis motions at points (m, 3), as (m, 3|6, d). Local to the rank."""
    lever, d = points - body.centre, body.dimension
    fields = np.zeros((len(points), body.motions, d))
    fields[:, :d, :] = np.eye(d)
    if d == 2:
        fields[:, 2, 0], fields[:, 2, 1] = -lever[:, 1], lever[:, 0]
    else:
        fields[:, 3:, :] = np.cross(np.eye(3)[None], lever[:, None, :])
    return fields


def motion_at(points: Array, body: Body, coefficients: tuple[float, ...] | Array) -> Array:
    """The motion with the given coefficients (3|6) at points (m, 3), as (m, d). Local to the rank."""
    return np.asarray(np.einsum("n,mnd->md", np.asarray(coefficients), rigid_fields(points, body)))


def describe(coefficients: Array, body: Body, *, signed: bool) -> str:
    """A motion in words, e.g. "translation along y"; `signed` tells the sense too: "translation along +y".

    Points are in metres (nondimensional coordinates times `body.length`).
    """
    z = np.where(np.abs(coefficients) <= TINY * np.abs(coefficients).max(), 0.0, coefficients)
    shift, spin = z[: body.dimension], z[body.dimension :]
    whose = f" of {body.name}" if body.name else ""
    if not spin.any():
        return f"translation along {_direction(shift, signed)}{whose}"
    rotation = _rotation_2d if body.dimension == 2 else _rotation_3d
    return rotation(shift, spin, body, signed) + whose


def _rotation_2d(shift: Array, spin: Array, body: Body, signed: bool) -> str:
    pole = body.centre[:2] + np.array([-shift[1], shift[0]]) / spin[0]
    sense = (", counterclockwise" if spin[0] > 0.0 else ", clockwise") if signed else ""
    return f"rotation about {_point(pole * body.length)}{sense}"


def _rotation_3d(shift: Array, spin: Array, body: Body, signed: bool) -> str:
    """Every motion in space is a screw; the point named is the one of its axis nearest the centre."""
    square = float(spin @ spin)
    pole, pitch = body.centre + np.cross(spin, shift) / square, float(shift @ spin) / square
    axis = f"about the axis through {_point(pole * body.length)} along {_direction(spin, signed)}"
    if abs(pitch) <= TINY:
        return f"rotation {axis}"
    return f"screw motion {axis}, advancing {_number(pitch * body.length)} per radian"


def _direction(vector: Array, signed: bool) -> str:
    """An axis by its letter, else a unit vector; without a sign its first largest entry is positive."""
    unit = vector / np.linalg.norm(vector)
    if not signed and unit[np.abs(unit).round(6).argmax()] < 0.0:
        unit = -unit
    if np.abs(unit).max() < 1.0 - TINY:
        return "(" + ", ".join(f"{_clean(c):.2f}" for c in unit) + ")"
    i = int(np.abs(unit).argmax())
    return (("+" if unit[i] > 0.0 else "-") if signed else "") + AXES[i]


def _point(point: Array) -> str:
    return "(" + ", ".join(_number(c) for c in point) + ")"


def _number(value: float) -> str:
    return f"{_clean(value):.4g}"


def _clean(value: float) -> float:
    return 0.0 if abs(value) < TINY else float(value)
