"""The legend at the foot of a picture."""

from __future__ import annotations

import pytest
from matplotlib.lines import Line2D

from hvi_fenicsx.report.pictures.legend import FOOT, legend
from hvi_fenicsx.report.pictures.style import figure


@pytest.mark.parametrize("lines", [1, 5, 7, 9])
def test_a_legend_of_many_lines_stays_in_the_foot(lines: int) -> None:
    fig = figure(5.0)
    legend(fig, [Line2D([], [], label=f"mark {line}") for line in range(lines)])
    fig.canvas.draw()
    box = fig.legends[0].get_window_extent()
    assert box.y0 >= 0.0
    assert box.y1 <= FOOT * fig.dpi
