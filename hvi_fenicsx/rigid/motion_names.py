"""What the rigid motions of one body are called, in words; points in them are in metres.

Coefficients are those of the basis of :mod:`.motions`, nondimensional.
"""

from __future__ import annotations

import numpy as np

from ..typing import Array

NEGLIGIBLE = 1e-9
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
