"""Jumps that are asked to stop: the path ends with the state before, and goes on there."""

from __future__ import annotations

from typing import Any

import pytest
from condensed import graph
from curved_follower import CurvedFollower
from test_curved_paths import DROP, line
from test_exact_paths import bar, spring

from hvi_fenicsx.paths.follower import Follower
from hvi_fenicsx.paths.state import End, Event, PathOptions


class Asked:
    """Asks a path to stop when it is asked whether to for the n-th time; by default never."""

    def __init__(self, last: int = 0) -> None:
        self.times, self.last = 0, last

    def __call__(self) -> bool:
        self.times += 1
        return self.times == self.last


SCENES = {"spring": (spring(), 3.0), "drops": (line(graph(DROP), 4), 9.0), "bar that comes off": (bar(50.0, 12), 1e3)}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("most", [1, 2])
@pytest.mark.parametrize("kind", [Follower, CurvedFollower])
def test_a_jump_that_is_stopped_leaves_the_state_before_it(kind: Any, most: int, name: str) -> None:
    given, aim = SCENES[name]
    options = PathOptions(programme=(aim,))
    asked = Asked()
    whole, times = zip(*((state, asked.times) for state in kind(given, options, None, asked).states()), strict=True)
    first = next(number for number, state in enumerate(whole) if state.event in (Event.JUMP, Event.END))
    follower = kind(given, options, None, Asked(times[first - 1] + 1 + most))
    states = list(follower.states())
    assert follower.end is End.INTERRUPTED
    assert [s.factor for s in states] == [s.factor for s in whole[:first]]
    rest = list(kind(given, options, states[-1]).states())
    assert [s.event for s in rest] == [s.event for s in whole[first:]]
    assert [s.factor for s in rest] == pytest.approx([s.factor for s in whole[first:]], abs=1e-9)
    assert rest[-1].x == pytest.approx(whole[-1].x, abs=1e-9)


def test_a_path_is_stopped_before_the_first_site_passes() -> None:
    """Many points of a large body pass one after the other where it sets out, each with a tangent of its own."""
    asked = []
    follower = CurvedFollower(line(graph(DROP), 4), PathOptions(), None, lambda: not asked.append(1))
    assert [s.event for s in follower.states()] == [Event.START]
    assert follower.end is End.INTERRUPTED
    assert len(asked) == 1
    assert follower.factor == 0.0
