"""The equilibrium that loading leads to: the path from no load to the whole one, all loads in proportion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..system.condensed_problem import CondensedProblem
from ..typing import Array
from .eliminated import without_fixed
from .exact import ExactFollower
from .state import End, Follow, PathOptions, PathState


@dataclass(frozen=True, kw_only=True)
class FullLoad:
    """Where loading leads.

    Attributes:
        x: the unknowns of an equilibrium under the whole load, (n,); None: there is none on the path.
        reason: how the path ended.
    """

    x: Array | None
    reason: str


def at_full_load(problem: CondensedProblem, most_events: int) -> FullLoad | None:
    """The equilibrium to which a stable path leads, or else the whole curve of equilibria.

    Where a body comes off on the way, an exact path is followed on, through the limit point, since its factor may rise
    to 1 again. None where this says nothing: the path is lost, or does not begin since nothing holds the body at rest.

    Args:
        problem: the problem, of piecewise linear laws; its factor scales all loads.
        most_events: events at most, of each path.
    """
    fewer, kept = without_fixed(problem)
    follower, last = _followed(fewer, Follow.STABLE, most_events)
    if follower.end is End.ESCAPES and last is not None:
        reason = follower.reason
        follower, last = _followed(fewer, Follow.EXACT, most_events)
        if follower.end is not End.REACHED:
            return FullLoad(x=None, reason=reason)
    if follower.end is not End.REACHED or last is None:
        return None
    found = np.where(np.isfinite(problem.lower), problem.lower, 0.0)
    found[kept] = last.x
    return FullLoad(x=found, reason="the whole load is reached")


def _followed(problem: CondensedProblem, follow: Follow, most_events: int) -> tuple[ExactFollower, PathState | None]:
    """The follower at the end of its path, and the last state there."""
    follower, last = ExactFollower(problem, PathOptions(follow=follow, most_events=most_events)), None
    for state in follower.states():
        last = state
    return follower, last
