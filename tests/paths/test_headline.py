"""The line that a strength test is read by: it says the same of a path whose factor goes down as of one that rises."""

from __future__ import annotations

import pytest
from path_rows import path_row

from hvi_fenicsx.paths.load_path import LoadPath
from hvi_fenicsx.paths.state import End


def path(sign: float, events: dict[str, float], end: str) -> LoadPath:
    rows = tuple(path_row(sign * factor, event) for event, factor in events.items())
    return LoadPath(dimension=2, scaled=("pull.traction",), rows=rows, end=end, reason="", examined=0)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["rising", "falling"])
@pytest.mark.parametrize(
    ("events", "end", "said"),
    [
        (
            {"start": 0.0, "fold": 2.0, "jump": 2.0, "end": 1.5},
            End.REACHED,
            "there the body jumps to the next",
        ),
        ({"start": 0.0, "fold": 2.0, "jump": 1.0, "end": 1.5}, End.REACHED, "the path ends where it was to end"),
        ({"start": 0.0, "fold": 2.0, "end": 2.0}, End.ESCAPES, "then the body comes off"),
    ],
    ids=["jump", "jump elsewhere", "off"],
)
def test_what_happens_at_the_largest_factor(sign: float, events: dict[str, float], end: str, said: str) -> None:
    found = path(sign, events, end)
    assert found.rows[found.peak].factor == sign * 2.0
    assert f"is borne: {sign * 2:g} (limit point, row 1); {said}" in found.headline
