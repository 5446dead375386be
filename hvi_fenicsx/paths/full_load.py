"""The equilibrium that loading leads to: the path from no load to the whole one, all loads in proportion."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .follower import Follower
from .state import End, Follow, PathOptions, PathState, Watch
from .substitutions import without_fixed
from .thresholds import DEFAULT, FollowingThresholds
from .vertex_laws import is_straight


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """An equilibrium under a part of the load.

    Attributes:
        x: the unknowns, (n,).
        factor: of the load.
    """

    x: Array
    factor: float


@dataclass(frozen=True, kw_only=True)
class FullLoad:
    """Where loading leads.

    Attributes:
        x: the unknowns of an equilibrium under the whole load, (n,); None: there is none on the path.
        reason: how the path ended.
        borne: where there is none, the last state that is borne; None where that is not known.
    """

    x: Array | None
    reason: str
    borne: Loaded | None = None


def at_full_load(
    problem: CondensedProblem, most_events: int, watch: Watch | None = None, thresholds: FollowingThresholds = DEFAULT
) -> FullLoad | None:
    """The equilibrium to which a path leads. None where this says nothing: the path is lost, or does not begin.

    Args:
        problem: the problem; its factor scales all loads.
        most_events: events at most, of each path.
        watch: whether to stop.
        thresholds: the numbers that tune how it is followed.
    """
    fewer, kept = without_fixed(problem)
    options = PathOptions(most_events=most_events, thresholds=thresholds)
    found = (_event_by_event if is_straight(fewer) else _along_the_curve)(fewer, options, watch)
    if found is None:
        return None

    def whole(x: Array) -> Array:
        values = np.where(np.isfinite(problem.lower), problem.lower, 0.0)
        values[kept] = x
        return values

    borne = None if found.borne is None else replace(found.borne, x=whole(found.borne.x))
    return replace(found, x=None if found.x is None else whole(found.x), borne=borne)


def _event_by_event(problem: CondensedProblem, options: PathOptions, watch: Watch | None) -> FullLoad | None:
    """Where piecewise linear laws lead: as stable as it goes, or else along the whole curve of equilibria.

    Where a body comes off on the way, the curve is followed on, through the limit point, since its factor may rise to 1
    again.
    """
    follower, states = _followed(problem, Follow.STABLE, options, watch)
    if follower.end is End.ESCAPES and _begins(states):
        ended = FullLoad(x=None, reason=follower.reason, borne=_largest(states))
        follower, states = _followed(problem, Follow.EXACT, options, watch)
        if follower.end not in (End.REACHED, End.INTERRUPTED):
            return ended
    return _reached(follower, states)


def _along_the_curve(problem: CondensedProblem, options: PathOptions, watch: Watch | None) -> FullLoad | None:
    """Where other laws lead: along the curve of equilibria, since a jump takes longer than the whole curve."""
    follower, states = _followed(problem, Follow.EXACT, options, watch)
    if (follower.end is End.ESCAPES or follower.is_closed) and _begins(states):
        largest, stable = _largest(states), list(itertools.takewhile(lambda state: state.stable, states))
        first = len(stable) == len(states) or states[len(stable)].factor == largest.factor
        back = "to no load" if follower.end is End.ESCAPES else "and form a closed curve"
        reason = f"at the factor {largest.factor:.6g} the equilibria turn back {back}"
        return FullLoad(x=None, reason=reason, borne=largest if first else None)
    return _reached(follower, states)


def _begins(states: Sequence[PathState]) -> bool:
    """Whether some load is borne on a path, and none beyond the whole, at which a sound path ends.

    Where no load is borne on it, the whole one may be all the same, off the path.
    """
    return 0.0 < max((state.factor for state in states), default=0.0) <= 1.0


def _largest(states: Sequence[PathState]) -> Loaded:
    """The state of the largest factor."""
    state = max(states, key=lambda one: one.factor)
    return Loaded(x=state.x, factor=state.factor)


def _reached(follower: Follower, states: Sequence[PathState]) -> FullLoad | None:
    if follower.end is not End.REACHED or not states:
        return None
    return FullLoad(x=states[-1].x, reason="the whole load is reached")


def _followed(
    problem: CondensedProblem, follow: Follow, options: PathOptions, watch: Watch | None
) -> tuple[Follower, list[PathState]]:
    """The follower at the end of its path, and the states."""
    follower = Follower(problem, replace(options, follow=follow), watch=watch)
    return follower, list(follower.states())
