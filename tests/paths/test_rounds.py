"""Events of a path that stays where it is are counted, so that it ends; those of one that moves are not."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.paths.cycles import Cycle, Cycles
from hvi_fenicsx.paths.state import Event, PathState, Position


def state(x: float, factor: float, number: int) -> PathState:
    """An event of a path with one unknown, on one of its segments."""
    at = Position(numbers=np.array([number]), driver=0, heading=1, small=np.zeros(1), leg=0)
    return PathState(
        factor=factor,
        event=Event.CONTACT,
        place=None,
        x=np.array([x]),
        energy=0.0,
        work=0.0,
        dissipated=0.0,
        unstable=0,
        memory=None,
        position=at,
    )


@pytest.mark.parametrize(("moves", "loads", "standing"), [(0.0, 0.0, 10), (0.1, 0.0, 0), (0.0, 0.1, 0)])
def test_events_at_one_place_and_factor_are_counted(moves: float, loads: float, standing: int) -> None:
    """Each on another segment, so that none comes back to an earlier one."""
    rounds = Cycles(np.zeros(1), 1e-9)
    found = [rounds.note(state(moves * k, loads * k, k)) for k in range(11)]
    assert found == [None] * 11
    assert rounds.standing == standing


def test_a_cell_met_again_at_its_place_is_told() -> None:
    rounds = Cycles(np.zeros(1), 1e-9)
    assert [rounds.note(state(1.0, 0.5, k % 2)) for k in range(3)] == [None, None, Cycle.BLOCKED]
