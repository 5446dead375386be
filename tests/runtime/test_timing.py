"""Time by phase: of any clock, and of processor time where a benchmark puts it into the place of wall time."""

from __future__ import annotations

import itertools
import time

import pytest

from hvi_fenicsx.runtime.timing import Timer


def test_inner_phases_do_not_count_for_outer_ones() -> None:
    timer = Timer(itertools.count().__next__)
    with timer("solve"), timer("setup"):
        pass
    assert timer.seconds["setup"] == 1
    assert timer.seconds["solve"] == 2


def test_a_timer_takes_the_clock_that_is_there_when_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Benchmarks put processor time there (``--cpu``)."""
    monkeypatch.setattr(time, "perf_counter", itertools.count(100).__next__)
    timer = Timer()
    assert timer.total == 1
