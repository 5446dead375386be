"""The picture of a load path: its legend is read beside the heading and inside the picture, however much it names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hvi_fenicsx.report.pictures.path import make
from hvi_fenicsx.report.searches import PathResult

EVENTS = ("start", "kink", "fold", "jump", "turn", "fold", "end")


def result(events: tuple[str, ...], stable: tuple[float, ...], end: str) -> PathResult:
    force = 220.6e3 * np.array([0.0, 0.7, 1.0, 1.0, 0.6, 0.2, 0.1])
    columns = {"stable": np.array(stable), "pull.fx": force, "pull.fy": 0 * force}
    columns |= {"pull.ux": 1e-4 * np.arange(7.0), "pull.uy": np.zeros(7)}
    peak = {"pull": {"force": [220.6e3, 0.0]}}
    path = {"peak_factor": 1.10313, "events": 31, "folds": 2, "uncertified": 0, "end": end}
    summary = {"path": {**path, "scaled": ["pull.traction"], "peak_forces": peak}}
    title = {"title": "A bar, glued along its length and pulled at one end"}
    return PathResult(folder=Path(), scene=title, summary=summary, columns=columns, events=events)


@pytest.mark.parametrize(
    ("events", "stable", "end", "entries"),
    [
        (("start", *["kink"] * 5, "end"), (1,) * 7, "reached", 3),
        (EVENTS, (1,) * 7, "reached", 5),
        (EVENTS, (1, 1, 0, 1, 1, 0, 0), "escapes", 7),
        (("start", *["free"] * 5, "end"), (1,) * 7, "reached", 2),
    ],
)
def test_the_legend_is_inside_the_picture_and_below_its_heading(
    events: tuple[str, ...], stable: tuple[float, ...], end: str, entries: int
) -> None:
    fig = make(result(events, stable, end))
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    legend = fig.axes[0].get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == entries
    box = legend.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= fig.bbox.width
    assert not any(box.overlaps(text.get_window_extent()) for text in fig.texts)
    assert box.y0 >= fig.axes[0].get_window_extent().y1 - 1.0


def beside(force: tuple[float, float], way: float) -> PathResult:
    """The same path with another part that is driven: a constant force on it, and how far it goes."""
    given = result(("start", *["kink"] * 5, "end"), (1,) * 7, "reached")
    columns = dict(given.columns) | {"factor": np.arange(7.0), "press.ux": np.zeros(7)}
    columns |= {"press.uy": way * np.arange(7.0), "press.fx": np.full(7, force[0]), "press.fy": np.full(7, force[1])}
    path = given.path
    peaks = path["peak_forces"] | {"press": {"force": list(force)}}
    path = path | {"peak_forces": peaks, "scaled": ["pull.traction", "press.traction"]}
    return replace(given, columns=columns, summary={"path": path})


def test_the_part_is_drawn_whose_force_goes_the_longest_way() -> None:
    assert beside((0.0, -1e6), -1e-7).driven == "pull"
    assert beside((0.0, -1e6), -1e-3).driven == "press"


def test_under_a_moment_the_factor_is_drawn_over_the_displacement() -> None:
    """No force acts on the part that moves, and the part that is held does not move."""
    given = beside((0.0, 0.0), 2e-3)
    columns = dict(given.columns) | {"pull.ux": np.zeros(7)}
    shown = replace(given, columns=columns)
    assert shown.driven == "press"
    axes = make(shown).axes[0]
    assert axes.get_ylabel() == "load factor"
    drawn = axes.get_lines()[0].get_xydata()
    assert np.nanmax(np.asarray(drawn), axis=0) == pytest.approx([12.0, 6.0])  # mm; the factor


def test_the_largest_force_is_seen_where_the_body_comes_off_under_it() -> None:
    """Both marks stand at the last point, apart from each other; a stretch that has no length is no line."""
    given = result(("start", *["kink"] * 5, "end"), (1, 1, 1, 1, 1, 0, 0), "escapes")
    columns = dict(given.columns) | {"pull.fx": 1e3 * np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0])}
    columns |= {"pull.ux": 1e-4 * np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0])}
    fig = make(replace(given, columns=columns))
    FigureCanvasAgg(fig).draw()
    lines = {str(line.get_label()).split()[0]: line for line in fig.axes[0].get_lines()}
    assert "unstable" not in lines
    peak, end = lines["peak"], lines["escapes"]
    assert peak.get_xydata() == pytest.approx(end.get_xydata())
    assert not peak.get_window_extent().overlaps(end.get_window_extent())
    assert peak.get_window_extent().y1 <= fig.axes[0].get_window_extent().y1
