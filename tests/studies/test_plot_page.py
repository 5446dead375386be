"""The page of a study's pictures."""

from __future__ import annotations

import pytest

from hvi_fenicsx.report.pictures.style import HEADING, area, figure
from hvi_fenicsx.studies import plot_page


@pytest.mark.parametrize("smoothings", [1, 6])
def test_the_legend_is_inside_the_picture_and_below_its_heading(smoothings: int) -> None:
    """All that a plan may have: the law, four smoothings and one of the user's, degrees, methods, the scene."""
    names = ["exact law", "quadratic", "chks", "log_exp", "paper", "one_of_the_users_own"][:smoothings]
    found = [("o", "k", name) for name in names]
    found += [("s", "k", "degree 2"), ("D", "k", "another method"), ("*", "k", "the scene's own")]
    fig = figure(HEADING + plot_page.GAP + plot_page.PANEL + plot_page.FOOT)
    axes = area(fig, 1.15, plot_page.FOOT, 6.5, plot_page.PANEL)
    axes.set_title("error in the energy norm", loc="left", size=13)
    plot_page.legend(axes, found)
    fig.canvas.draw()
    legend = axes.get_legend()
    assert legend is not None
    box = legend.get_window_extent()
    assert 0.0 <= box.x0 <= box.x1 <= fig.bbox.width
    assert box.y1 <= fig.bbox.height - (HEADING - 0.2) * fig.dpi
    assert not any(box.overlaps(text.get_window_extent()) for text in (axes.title, axes._left_title))  # type: ignore[attr-defined]
