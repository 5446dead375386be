"""The edges that pictures draw of a body in space: its own, none of a coarse mesh."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.report.pictures.creases import creases


def prism(sides: int, layers: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """A prism of radius 1 on a regular polygon, its mantle twisted from layer to layer as free meshes are."""
    turn = 2 * np.pi / sides
    rings = [
        np.column_stack([np.cos(a), np.sin(a), np.full(sides, z)])
        for z in range(layers + 1)
        for a in [turn * (np.arange(sides) + 0.5 * (z % 2))]
    ]
    points = np.concatenate([*rings, [[0.0, 0.0, 0.0], [0.0, 0.0, layers]]])
    facets = []
    for z in range(layers):
        low, high = z * sides + np.arange(sides), (z + 1) * sides + np.arange(sides)
        if z % 2 == 0:  # the ring above is half a side ahead
            facets += [
                np.column_stack([low, np.roll(low, -1), high]),
                np.column_stack([high, np.roll(low, -1), np.roll(high, -1)]),
            ]
        else:
            facets += [
                np.column_stack([low, np.roll(high, -1), high]),
                np.column_stack([low, np.roll(low, -1), np.roll(high, -1)]),
            ]
    bottom, top = np.arange(sides), layers * sides + np.arange(sides)
    facets += [np.column_stack([np.roll(bottom, -1), bottom, np.full(sides, len(points) - 2)])]
    facets += [np.column_stack([top, np.roll(top, -1), np.full(sides, len(points) - 1)])]
    return points, np.concatenate(facets)


@pytest.mark.parametrize("sides", [7, 12, 40])
def test_a_cylinder_has_its_two_rims_however_coarse_its_mesh_is(sides: int) -> None:
    points, facets = prism(sides)
    edges = creases(points, facets)
    assert len(edges) == 2 * sides
    assert set(points[edges.ravel(), 2]) == {0.0, 3.0}


def roof(rise: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The upper side of a wedge: two planes that meet along y at x = 1, each of so many cells across."""
    x, y = (c.ravel() for c in np.meshgrid(np.linspace(0, 2, 2 * cells + 1), np.linspace(0, 1, 4), indexing="ij"))
    low = np.array([[4 * i + j, 4 * i + 4 + j] for i in range(2 * cells) for j in range(3)])
    facets = [np.column_stack([low[:, 0], low[:, 1], low[:, 1] + 1])]
    facets += [np.column_stack([low[:, 0], low[:, 1] + 1, low[:, 0] + 1])]
    return np.column_stack([x, y, rise * (1.0 - np.abs(x - 1.0))]), np.concatenate(facets)


@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize(("rise", "ridge"), [(0.0, 0), (0.01, 0), (0.1, 3), (0.4, 3)])
def test_two_flat_faces_have_an_edge_between_them(cells: int, rise: float, ridge: int) -> None:
    """Turned by 0, 1.1, 11.4 and 43.6 degrees; the border of the roof is drawn in all cases."""
    points, facets = roof(rise, cells)
    edges = creases(points, facets)
    assert len(edges) == 2 * (2 * cells + 3) + ridge
    assert np.sum((points[edges, 0] == 1.0).all(axis=1)) == ridge


def test_the_strips_of_a_swept_arc_have_no_edges_between_them() -> None:
    """Eight flat strips that turn by 10 degrees each."""
    points, facets = roof(0.0, 4)
    angle = np.radians(10.0 * np.round(points[:, 0] * 4))
    bent = np.column_stack([np.sin(angle), points[:, 1], np.cos(angle)])
    assert len(creases(bent, facets)) == 2 * (8 + 3)


def test_a_cube_has_twelve_edges_and_one_face_of_it_its_border() -> None:
    points = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    facets = np.array([[a, b, c] for face in faces for a, b, c in (face[:3], (face[0], *face[2:]))])
    for count, chosen in ((12, facets), (4, facets[:2])):
        edges = creases(points, chosen)
        assert len(edges) == count
        assert np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) == pytest.approx(np.ones(count))
