"""The maps of a part fill the picture's width, and neither cover each other nor leave it."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from hvi_fenicsx.report.pictures.map_layout import BAR, FOOT, GAP, layout
from hvi_fenicsx.report.pictures.style import HEADING, WIDTH


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("extent", [(1.0, 1.0), (0.1, 1.0), (1.2, 1.0), (3.0, 1.0), (1.0, 0.0)])
def test_maps_stand_apart_within_the_picture(extent: tuple[float, float], count: int) -> None:
    made = layout(np.array(extent), count)
    boxes = [
        shapely.box(x, y, x + made.width + BAR, y + made.height + 0.5 * GAP)
        for x, y in (made.corner(i) for i in range(count))
    ]
    everything = shapely.union_all(boxes)
    assert everything.area == pytest.approx(sum(box.area for box in boxes))
    assert shapely.box(0.5, FOOT, WIDTH, made.tall - HEADING).contains(everything)
    assert sum(made.leftmost(i) for i in range(count)) == made.rows
    assert sum(made.lowest(i) for i in range(count)) == min(count, made.columns)


def test_narrow_maps_stand_side_by_side_and_wide_ones_below_each_other() -> None:
    """Two or three square maps take most of the width; in one column they left more than half of it free."""
    assert [layout(np.array([1.0, 1.0]), count).columns for count in (1, 2, 3)] == [1, 2, 2]
    assert layout(np.array([2.0, 1.0]), 3).columns == 1
    square = layout(np.array([1.0, 1.0]), 3)
    assert square.corner(1)[0] + square.width + BAR > 0.85 * WIDTH
