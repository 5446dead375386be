"""The equilibrium that loading leads to: the path from no load to the whole one, all loads in proportion."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .follower import Follower
from .state import End, Follow, PathOptions, PathState
from .vertex_laws import is_straight


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
    borne: PathState | None = None


_Follow = Callable[[Follow], "tuple[Follower, list[PathState]]"]


def at_full_load(
    problem: CondensedProblem, options: PathOptions, interrupted: Callable[[], bool] = lambda: False
) -> FullLoad | None:
    """The equilibrium to which a path leads. None where this says nothing: the path is lost, or does not begin.

    Args:
        problem: the problem; its factor scales all loads.
        options: how many events at most each path may have, and what tunes it.
        interrupted: whether to stop.
    """

    def followed(follow: Follow) -> tuple[Follower, list[PathState]]:
        follower = Follower(problem, replace(options, follow=follow), interrupted=interrupted)
        return follower, list(follower.states())

    return (_event_by_event if is_straight(problem) else _along_the_curve)(followed)


def _event_by_event(followed: _Follow) -> FullLoad | None:
    """Where piecewise linear laws lead: as stable as it goes, or else along the whole curve of equilibria.

    Where a body comes off on the way, the curve is followed on, through the limit point, since its factor may rise to 1
    again.
    """
    follower, states = followed(Follow.STABLE)
    if follower.end is End.ESCAPES and _begins(states):
        ended = FullLoad(x=None, reason=follower.reason, borne=_largest(states))
        follower, states = followed(Follow.EXACT)
        if follower.end not in (End.REACHED, End.INTERRUPTED):
            return ended
    return _reached(follower, states)


def _along_the_curve(followed: _Follow) -> FullLoad | None:
    """Where other laws lead: along the curve of equilibria, since a jump takes longer than the whole curve."""
    follower, states = followed(Follow.EXACT)
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


def _largest(states: Sequence[PathState]) -> PathState:
    """The state of the largest factor."""
    return max(states, key=lambda one: one.factor)


def _reached(follower: Follower, states: Sequence[PathState]) -> FullLoad | None:
    if follower.end is not End.REACHED or not states:
        return None
    return FullLoad(x=states[-1].x, reason="the whole load is reached")
