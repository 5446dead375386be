"""What is told of a path: its largest factor, and numbers without rounding."""

from __future__ import annotations

from path_rows import path_row

from hvi_fenicsx.paths.load_path import LoadPath
from hvi_fenicsx.paths.state import End


def path(*factors: float, end: str = End.REACHED) -> LoadPath:
    """A path with these factors, and nothing else in its rows."""
    rows = tuple(map(path_row, factors))
    return LoadPath(dimension=2, scaled=("pull.traction",), rows=rows, end=end, reason="", examined=len(rows))


def test_events_at_a_factor_that_is_rounding_do_not_turn_the_path() -> None:
    found = path(0.0, -4e-18, 3e-14, 0.5, 1.0)
    assert found.peak == 4
    assert found.summary()["peak_factor"] == 1.0


def test_a_path_that_begins_downwards_has_its_largest_factor_there() -> None:
    assert path(0.0, -0.5, -1.0, 0.2).peak == 2


def test_an_end_at_zero_is_told_as_zero() -> None:
    assert path(0.0, 1.1, -1e-12, end=End.ESCAPES).ending == "then the body comes off, at 0"
