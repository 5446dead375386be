"""A finite rigid motion from the field of an infinitesimal one, so that a ghost keeps the body's shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Array
from ..body_mesh import BodyMesh

REACH = 0.3
"""How far the ghost goes, of the body's size."""


@dataclass(frozen=True)
class Motion:
    """x → pole + rotation(x - pole) + shift: a screw, a rotation, or a translation (spin zero).

    Attributes:
        pole: a point of the axis, m, (3,).
        shift: along the axis, or the translation, m, (3,).
        spin: the axis times the angle, (3,).
    """

    pole: Array
    shift: Array
    spin: Array

    def at(self, points: Array, part: float = 1.0) -> Array:
        """Where points are after a part of the motion, m, (n, 3).

        Args:
            points: at rest, m, (n, 3).
            part: of the motion, 0 to 1.
        """
        arm, spin = points - self.pole, part * self.spin
        angle = float(np.linalg.norm(spin))
        axis = spin / angle if angle > 0.0 else spin
        turned = arm * np.cos(angle) + np.cross(axis, arm) * np.sin(angle)
        turned += np.outer(arm @ axis, axis) * (1.0 - np.cos(angle))
        return np.asarray(self.pole + turned + part * self.shift)


def fitted(body: BodyMesh) -> Motion:
    """The motion whose velocity is the body's escape mode, as far as :data:`REACH`.

    The field is a + w × (x - c); its pole is the point of the screw's axis that is nearest to c.
    """
    assert body.escape_mode is not None
    mode = body.escape_mode
    middle = body.points.mean(axis=0)
    shift = mode.mean(axis=0)
    spin = _spin(body.points - middle, mode - shift)
    square = float(spin @ spin)
    if square * body.size**2 < 1e-12 * float(np.max(np.sum(mode**2, axis=1))):
        return Motion(middle, shift * REACH * body.size / (float(np.linalg.norm(shift)) or 1.0), np.zeros(3))
    pole = middle + np.cross(spin, shift) / square
    reach = REACH * body.size / float(np.linalg.norm(mode, axis=1).max())
    return Motion(pole, reach * float(shift @ spin) / float(square) * spin, reach * spin)


def _spin(arms: Array, field: Array) -> Array:
    """Least squares for w in field = w × arm."""
    inertia = np.eye(3) * np.sum(arms**2) - arms.T @ arms
    return np.asarray(np.linalg.lstsq(inertia, np.cross(arms, field).sum(axis=0), rcond=1e-12)[0])


def followed(body: BodyMesh, motion: Motion) -> Array:
    """Points to follow on their way: the middle in a translation, else one far out in each diagonal direction; (j, 3).

    Args:
        body: the body at rest.
        motion: that it makes.
    """
    middle = (body.points.min(axis=0) + body.points.max(axis=0)) / 2
    if not motion.spin.any():
        return middle[None]
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * body.dimension)).reshape(body.dimension, -1).T
    far = body.points[np.unique(np.argmax((body.points - middle)[:, : body.dimension] @ signs.T, axis=0))]
    way = np.linalg.norm(motion.at(far) - far, axis=1)
    return np.asarray(far[way > 0.1 * way.max()])  # not the one that the body turns about
