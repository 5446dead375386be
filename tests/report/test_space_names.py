"""Words around a body in space: the name of a part is clear of its arrows, the axes are clear of the body."""

from __future__ import annotations

import numpy as np
import shapely

from hvi_fenicsx.report.pictures import load_labels, space_names
from hvi_fenicsx.report.pictures.plane_canvas import SIDE, TALLEST
from hvi_fenicsx.report.pictures.reach import Reach, largest_scale
from hvi_fenicsx.report.pictures.space_canvas import space_canvas
from hvi_fenicsx.report.pictures.vtk_view import best_view


def test_a_name_is_clear_of_the_arrows_on_its_part() -> None:
    """A plate that is pulled upwards, with an arrow in the very middle of its top."""
    x, y, z = (c.ravel() for c in np.meshgrid(np.linspace(0, 0.2, 5), np.linspace(0, 0.2, 5), [0.0, 0.1]))
    body = np.column_stack([x, y, z])
    top, low = body[z > 0], body[z == 0] - [0, 0, 0.2]
    arrows = [(top, np.broadcast_to([0.0, 0.0, 0.03], top.shape))]
    view = best_view([np.array([0.0, 0.0, 1.0])])
    pull, base = space_names.names(view, body, [("pull", top), ("base", low)], arrows)
    scale = largest_scale(load_labels.reaches(view, np.concatenate([body, low]), arrows), (SIDE, TALLEST))
    box = pull.reach.hull(scale)
    tails, tips = view.project(top), view.project(top + arrows[0][1])
    assert not any(box.intersects(shapely.LineString(line)) for line in zip(tails, tips, strict=True))
    assert shapely.MultiPoint(view.project(top)).convex_hull.contains(box)
    assert np.allclose(base.at, view.project(low).mean(axis=0))


def test_a_name_does_not_hide_a_small_part() -> None:
    """The top of a column on a wide plate, as wide as its name."""
    corners = np.array([[x, y, 0.0] for x in (0.0, 1.0) for y in (0.0, 1.0)])
    top = 0.12 * corners + [0.44, 0.44, 0.5]
    view = best_view([np.array([0.0, 0.0, 1.0])])
    (name,) = space_names.names(view, np.concatenate([corners, top]), [("pulled", top)], [])
    scale = largest_scale([Reach(view.project(np.concatenate([corners, top])))], (SIDE, TALLEST))
    assert not name.reach.hull(scale).intersects(shapely.MultiPoint(view.project(top)).convex_hull)
    assert np.linalg.norm(name.at - view.project(top).mean(axis=0)) < 1e-9


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
