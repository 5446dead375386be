"""Hidden parts are drawn beside the body and beside each other, never onto another."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from hvi_fenicsx.report.pictures import apart
from hvi_fenicsx.report.pictures.vtk_view import best_view

MARGIN = 0.05


def test_hidden_parts_are_clear_of_the_body_and_of_each_other() -> None:
    """Two pieces of the underside that share an edge, the back, the left side, a hole through it, and the top."""
    box = np.array([[x, y, z] for x in np.linspace(0, 1, 5) for y in np.linspace(0, 0.6, 5) for z in (0, 0.4)])
    low, left, right = box[:, 2] == 0, box[:, 0] < 0.6, box[:, 0] > 0.4
    parts = [
        (box[low & left], np.array([0.0, 0.0, -1.0])),
        (box[low & right], np.array([0.0, 0.0, -1.0])),
        (box[box[:, 1] == 0.6], np.array([0.0, 1.0, 0.0])),
        (box[box[:, 0] == 0], np.array([-1.0, 0.0, 0.0])),
        (box[left & right], np.zeros(3)),
        (box[~low], np.array([0.0, 0.0, 1.0])),
    ]
    view = best_view([])
    ways = apart.ways(view, box, iter(parts), MARGIN)
    assert [bool(way.any()) for way in ways] == [True, True, True, True, False, False]
    for way, (_, normal) in zip(ways[:4], parts, strict=False):
        np.testing.assert_allclose(np.cross(way, normal), 0.0, atol=1e-12)
    moved = [points + way for (points, _), way in zip(parts[:4], ways, strict=False)]
    hulls = [shapely.MultiPoint(view.project(points)).convex_hull for points in [box, *moved]]
    for first, second in itertools.combinations(hulls, 2):
        assert first.distance(second) > 0.0
