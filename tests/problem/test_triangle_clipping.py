"""Triangles clipped by a triangle: parts of a cut plane, edges that nearly coincide, thin parts."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.problem import facet_polygons
from hvi_fenicsx.problem.facet_polygons import CORNERS


def test_a_triangle_beyond_a_shared_edge_has_nothing_in_common() -> None:
    """Of these GEOS 3.13 returns the whole triangle."""
    beyond = [[1.0, 2.7755575615628914e-17], [0.0, 1.0], [0.3289306825365248, 1.9598487023640792]]
    same = [[0.0, 1.0], [1.0, 2.7755575615628914e-17], [0.0, 0.0]]
    np.testing.assert_allclose(facet_polygons.clip_triangles(np.array([beyond, same])).areas, [0.0, 0.5], atol=1e-15)


def test_the_parts_of_a_cut_plane_fill_the_triangle() -> None:
    """Turned grids of triangles: each point belongs to one of them."""
    random = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(-6, 6), np.arange(-6, 6))
    low = np.stack([x, y], axis=2).reshape(-1, 1, 2) + np.array([(0, 0), (1, 0), (0, 1)])
    high = np.stack([x, y], axis=2).reshape(-1, 1, 2) + np.array([(1, 1), (0, 1), (1, 0)])
    for _ in range(20):
        angle, size = random.uniform(0, 2 * np.pi), random.uniform(0.25, 2.0)
        turn = size * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        triangles = np.concatenate([low, high]) @ turn + random.uniform(-0.1, 0.1, 2)
        pieces = facet_polygons.clip_triangles(triangles)
        assert pieces.areas.sum() == pytest.approx(0.5, rel=1e-13)
        fans, polygon = pieces.fans(1e-14)
        assert np.abs(facet_polygons.twice_areas(fans)).sum() == pytest.approx(1.0, rel=1e-12)
        inside = facet_polygons.barycentric(triangles[polygon], fans)
        assert inside.min() > -1e-12
        for corner in CORNERS:
            full = {0.0: np.pi / 2}.get(float(corner.sum()), np.pi / 4)
            assert pieces.chosen(pieces.areas > 1e-14).angles_at(corner, 1e-9)[1].sum() == pytest.approx(full)
