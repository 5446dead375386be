"""A search that is told to stop does so within a long step, and what it then says holds."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import pytest
from test_lengths import random_problem
from test_stationary_points import FAST, problem_of

from hvi_fenicsx.equilibrium_search import convex_programme
from hvi_fenicsx.equilibrium_search.search import Found, Task, find, loaded_states

LENGTHS = random_problem(0, 6, 3, opening=True)
COMPONENTS = problem_of(FAST[0])[0]


def stopped(task: Task, solves: int) -> tuple[Found, int]:
    """What is found by a search that is told to stop after some linear systems, and how many it solved after that."""
    count, solve = [0], convex_programme.cho_solve

    def counted(*words: Any, **more: Any) -> Any:
        count[0] += 1
        return solve(*words, **more)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(convex_programme, "cho_solve", counted)
        found = find(dataclasses.replace(task, stop=lambda: count[0] >= solves))
    return found, max(count[0] - solves, 0)


@pytest.mark.parametrize("solves", [1, 3, 10, 30, 60, 100])
@pytest.mark.parametrize(
    "task",
    [
        Task(problem=LENGTHS, lowest=True),
        Task(problem=LENGTHS, has_potential=False),
        Task(problem=COMPONENTS, lowest=True),
    ],
    ids=["lowest, lengths", "some, lengths", "lowest, components"],
)
def test_a_search_stops_within_a_few_linear_systems_and_its_bound_holds(task: Task, solves: int) -> None:
    found, further = stopped(task, solves)
    assert further <= 3
    ends = itertools.islice(loaded_states(task.problem, lambda: False), 3)
    least = min(map(task.problem.energy, ends))
    assert found.lower_bound is None or found.lower_bound <= least + 1e-9 * abs(least)
