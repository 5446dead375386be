"""Facets over one facet: parts of a cut plane, edges that nearly coincide."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hvi_fenicsx.problem.facet_overlaps import overlaps
from hvi_fenicsx.problem.facets import Facets


def flat(triangles: npt.NDArray[np.float64], up: float) -> Facets:
    """Triangles (n, 3, 2) at the height zero."""
    points = np.concatenate([triangles, np.zeros((len(triangles), 3, 1))], axis=2)
    nodes = np.arange(3 * len(triangles)).reshape(-1, 3)
    return Facets(nodes=nodes, points=points, normals=np.tile([0.0, 0.0, up], (len(triangles), 1)))


REFERENCE = flat(np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]), 1.0)


def test_a_triangle_beyond_a_shared_edge_has_nothing_in_common() -> None:
    """Of these GEOS 3.13 returns the whole triangle."""
    beyond = [[1.0, 2.7755575615628914e-17], [0.0, 1.0], [0.3289306825365248, 1.9598487023640792]]
    same = [[0.0, 1.0], [1.0, 2.7755575615628914e-17], [0.0, 0.0]]
    found = overlaps(REFERENCE, flat(np.array([beyond, same]), -1.0))
    assert found.second.tolist() == [1]
    assert found.areas.sum() == pytest.approx(0.5, rel=1e-14)


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
        found = overlaps(REFERENCE, flat(triangles, -1.0))
        assert found.areas.sum() == pytest.approx(0.5, rel=1e-12)
        assert found.on_second.min() > -1e-12
        assert found.covered.all()
