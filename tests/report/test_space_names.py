"""Words around a body in space: the name of a part is on it, clear of its arrows; the axes are clear of the body."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.spatial import Delaunay

from hvi_fenicsx.report.pictures import load_labels, space_names, vtk_loads
from hvi_fenicsx.report.pictures.plane_canvas import SIDE, TALLEST
from hvi_fenicsx.report.pictures.reach import Reach, largest_scale
from hvi_fenicsx.report.pictures.seen import Surface, seen
from hvi_fenicsx.report.pictures.space_canvas import space_canvas
from hvi_fenicsx.report.pictures.vtk_view import best_view
from hvi_fenicsx.typing import Array

VIEW = best_view([np.array([0.0, 0.0, 1.0])])


def level(points: Array) -> Surface:
    """Points at one height as a surface that looks upwards."""
    return Surface(points=points, facets=Delaunay(points[:, :2]).simplices)


def ring(inner: float, outer: float, heights: tuple[float, float], around: int = 24) -> Surface:
    """Between two circles: a plate with a hole, seen from above, or the inside of a bore where they are as wide."""
    angles = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(around)])
    points = np.concatenate([r * circle + [0.0, 0.0, z] for r, z in zip((inner, outer), heights, strict=True)])
    first = np.arange(around)
    other = np.roll(first, -1)
    facets = [[first, first + around, other], [other, first + around, other + around]]
    return Surface(points=points, facets=np.concatenate([np.stack(each, axis=1) for each in facets]))


def test_a_name_is_clear_of_the_arrows_on_its_part() -> None:
    """A plate that is pulled upwards, with an arrow in the very middle of its top."""
    x, y, z = (c.ravel() for c in np.meshgrid(np.linspace(0, 0.2, 5), np.linspace(0, 0.2, 5), [0.0, 0.1]))
    body = np.column_stack([x, y, z])
    top, low = body[z > 0], body[z == 0] - [0, 0, 0.2]
    arrows = [(top, np.broadcast_to([0.0, 0.0, 0.03], top.shape))]
    view, parts = VIEW, [("pull", level(top)), ("base", level(low))]
    pull, base = space_names.names(view, level(top), parts, arrows)
    scale = largest_scale(load_labels.reaches(view, np.concatenate([body, low]), arrows), (SIDE, TALLEST))
    box = pull.reach.hull(scale)
    tails, tips = view.project(top), view.project(top + arrows[0][1])
    assert not any(box.intersects(shapely.LineString(line)) for line in zip(tails, tips, strict=True))
    assert box.difference(shapely.MultiPoint(view.project(top)).convex_hull).area < 0.01 * box.area
    assert np.allclose(base.at, view.project(low).mean(axis=0), atol=1e-3)


def test_a_name_does_not_hide_a_small_part() -> None:
    """The top of a column on a wide plate, as wide as its name."""
    corners = np.array([[x, y, 0.0] for x in (0.0, 1.0) for y in (0.0, 1.0)])
    top = 0.12 * corners + [0.44, 0.44, 0.5]
    view = VIEW
    (name,) = space_names.names(view, level(corners), [("pulled", level(top))], [])
    scale = largest_scale([Reach(view.project(np.concatenate([corners, top])))], (SIDE, TALLEST))
    assert not name.reach.hull(scale).intersects(shapely.MultiPoint(view.project(top)).convex_hull)
    assert np.linalg.norm(name.at - view.project(top).mean(axis=0)) < 3e-3


def test_names_of_a_bored_plate_are_where_its_face_and_its_bore_are_seen() -> None:
    """The middle of the face is in the bore, and that of the bore is where nothing is."""
    face, bore = ring(0.3, 1.0, (0.0, 0.0)), ring(0.3, 0.3, (-0.4, 0.0))
    body = Surface(points=np.concatenate([face.points, bore.points]),
                   facets=np.concatenate([face.facets, bore.facets + len(face.points)]))  # fmt: skip
    names = space_names.names(VIEW, body, [("face", face), ("bore", bore)], [])
    scale = largest_scale([Reach(VIEW.project(body.points))], (SIDE, TALLEST))
    for name, own in zip(names, (face, bore), strict=True):
        facing = [f for f in shapely.polygons(VIEW.project(own.points)[own.facets]) if f.exterior.is_ccw]
        hidden = VIEW.project(face.points)[face.facets] if own is bore else np.empty((0, 3, 2))
        shown = shapely.union_all(facing) - shapely.union_all(shapely.polygons(hidden))
        box = name.reach.hull(scale)
        assert box.intersection(shown).area > 0.99 * box.area, name.words


def test_of_a_surface_that_nothing_shows_the_place_is_known() -> None:
    """The underside of a plate, whose facets look away."""
    top = level(np.array([[x, y, 0.0] for x in (0.0, 1.0) for y in (0.0, 1.0)]))
    below = Surface(points=top.points - [0.0, 0.0, 0.1], facets=top.facets[:, ::-1])
    upper, lower = seen(VIEW, [top, below])
    area = abs(float(shapely.MultiPoint(VIEW.project(top.points)).convex_hull.area))
    assert [upper.area, lower.area] == pytest.approx([area, area], rel=0.01)
    box = np.array([[*upper.low, *(upper.low + 0.5)], [*upper.low - 9.0, *(upper.low + 9.0)]])
    assert lower.within(box)[1] == pytest.approx(lower.area)


def test_the_axes_are_in_a_corner_that_is_empty() -> None:
    """Beside a box and a plate under it, which fill the lower left corner of the picture."""
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    view = best_view([])
    body = view.project(corners)
    plate = np.array([body.min(axis=0), body.min(axis=0) + [0.8, 0.5]])
    fig, axes = space_canvas(view, [Reach(body), Reach(plate)])
    fig.canvas.draw()
    letters = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_text()}
    assert set(letters) == {"x", "y", "z"}
    drawn = [shapely.MultiPoint(axes.transData.transform(points)).convex_hull for points in (body, plate)]
    drawn[1] = drawn[1].envelope
    for box in letters.values():
        assert 0.0 <= box.x0 <= box.x1 <= fig.bbox.width
        assert not any(shapely.box(*box.extents).intersects(shape) for shape in drawn)
    place = {name: np.array([box.x0 + box.x1, box.y0 + box.y1]) / 2 for name, box in letters.items()}
    assert place["z"][1] > place["x"][1]
    assert place["x"][0] > place["z"][0]


@pytest.mark.parametrize(("width", "across"), [(0.06, [0.03]), (0.6, [0.0, 0.3, 0.6])])
def test_a_narrow_face_has_one_row_of_arrows_in_its_middle(width: float, across: list[float]) -> None:
    x, y = (c.ravel() for c in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, width, 5)))
    points = np.column_stack([x, y, np.zeros_like(x)])
    chosen = points[vtk_loads._sparse(points, 1.0)]
    assert np.unique(np.round(chosen[:, 1], 9)) == pytest.approx(across)
    assert np.unique(chosen[:, 0]) == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
