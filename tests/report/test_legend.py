"""The legend at the foot of a picture, and its heading."""

from __future__ import annotations

import pytest
from matplotlib.lines import Line2D

from hvi_fenicsx.report.pictures.legend import FOOT, legend
from hvi_fenicsx.report.pictures.style import figure, titled


@pytest.mark.parametrize("lines", [1, 5, 7, 9])
def test_a_legend_of_many_lines_stays_in_the_foot(lines: int) -> None:
    fig = figure(5.0)
    legend(fig, [Line2D([], [], label=f"mark {line}") for line in range(lines)])
    fig.canvas.draw()
    box = fig.legends[0].get_window_extent()
    assert box.y0 >= 0.0
    assert box.y1 <= FOOT * fig.dpi


def test_the_words_of_a_heading_do_not_meet() -> None:
    fig = figure(5.0)
    facts = "deformed body · 1 234 567 unknowns · state: metastable · smoothing: quadratic"
    titled(fig, "A title", facts, "✗ borne up to factor 0.5124")
    fig.canvas.draw()
    _, left, right = (text.get_window_extent() for text in fig.texts)
    assert left.x1 < right.x0 <= fig.bbox.width
    assert fig.texts[1].get_size() > 8.0
