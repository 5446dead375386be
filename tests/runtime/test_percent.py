"""Percentages in words."""

from __future__ import annotations

import pytest

from hvi_fenicsx.runtime.terminal import percent


@pytest.mark.parametrize(
    ("share", "words"),
    [(4.1, "410 %"), (0.996, "100 %"), (0.24, "24 %"), (0.056, "5.6 %"), (5e-5, "0.005 %"), (0.0, "0 %")],
)
def test_no_percentage_has_a_power_of_ten(share: float, words: str) -> None:
    assert percent(share) == words
