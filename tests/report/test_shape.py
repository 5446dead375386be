"""A strip so thin that its outline would hide it is drawn higher, and the picture says so."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.report.body_mesh import BodyMesh
from hvi_fenicsx.report.pictures.shape import deform, undeformed

LENGTH = 0.19


def strip(height: float, lift: float = 0.0) -> BodyMesh:
    """A strip of two cells along x that is lifted at one end."""
    points = np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0], [LENGTH, height, 0.0], [0.0, height, 0.0]])
    u = np.zeros_like(points)
    u[1:3, 1] = lift
    return BodyMesh(points=points, cells=np.array([[0, 1, 2], [0, 2, 3]]), displacement=u)


def test_a_thin_strip_is_drawn_high_enough_for_its_colours() -> None:
    """1:190 becomes 1:19, that is 9 mm of a picture as wide as a page; 1:10 stays as it is."""
    shape = undeformed(strip(0.001))
    assert np.ptp(shape.points, axis=0) == pytest.approx([LENGTH, 0.010, 0.0])
    assert shape.stretched == "height × 10"
    thick = undeformed(strip(0.019))
    assert thick.points == pytest.approx(thick.body.points)
    assert thick.stretched == ""


def test_displacements_of_a_stretched_strip_are_stretched_alike() -> None:
    """Else a lifted vertex would not stand where the stretched obstacle is."""
    shape = deform(strip(0.001, lift=1e-6), [])
    lifted = shape.points - shape.at_rest
    assert lifted[1:3, 1] == pytest.approx(np.full(2, 10.0 * shape.factor * 1e-6))
    assert lifted[:, 1].max() < 0.12 * LENGTH
    assert shape.scales == f"displacements × {shape.factor:g}".replace("1000", "1\u202f000") + ", height × 10"


def test_a_small_piece_beside_a_large_one_is_not_crushed() -> None:
    """A large square whose far corner moves, and a small one that is pressed to half its height at 50 times."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    points = np.concatenate([corners, 0.1 * corners + [0.0, 1.0, 0.0]])
    u = np.zeros_like(points)
    u[1, 0], u[6:, 1] = 1e-3, -1e-3
    halves = np.array([[0, 1, 2], [2, 3, 0]])
    body = BodyMesh(points=points, cells=np.concatenate([halves, 4 + halves]), displacement=u)
    assert deform(BodyMesh(points=points[:4], cells=halves, displacement=u[:4]), []).factor == 100.0
    shape = deform(body, [])
    assert shape.factor == 20.0
    assert body.kept(shape.points).min() == pytest.approx(0.8)
