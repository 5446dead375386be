"""A search that is stopped says what it leaves open."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from test_stationary_points import FAST, oracle, problem_of

from hvi_fenicsx.equilibrium_search import search
from hvi_fenicsx.equilibrium_search.lowest import LowestSearch
from hvi_fenicsx.equilibrium_search.search import Task, find
from hvi_fenicsx.equilibrium_search.thresholds import LIMITS


def test_a_search_that_is_stopped_has_what_was_found_without_proof_and_a_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """It stops when the first cells are looked at and the lowest energy is bounded."""
    problem, unit = problem_of(FAST[0])
    least = oracle(FAST[0]).stationary()[0].energy / unit
    begun: list[int] = []
    run = LowestSearch.run
    monkeypatch.setattr(search, "LIMITS", dataclasses.replace(LIMITS, first_boxes=1))
    monkeypatch.setattr(LowestSearch, "run", lambda *words: (run(*words), begun.append(1)))
    one = find(Task(problem=problem, stop=lambda: bool(begun)))
    assert (one.proven, one.complete) == (False, False)
    assert one.left
    assert one.lower_bound is not None
    assert one.lower_bound <= least * (1.0 - 1e-12 * np.sign(least))
    assert one.gap == pytest.approx((one.points[0].energy - one.lower_bound) / abs(one.points[0].energy))
