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


def at_full_load(
    problem: CondensedProblem, options: PathOptions, interrupted: Callable[[], bool] = lambda: False
) -> FullLoad | None:
    """The equilibrium to which a path leads. None where this says nothing: the path is lost, or does not begin.

    With piecewise linear laws it goes as stable as it can. Where a body comes off on the way, and with other laws,
    whose jumps take longer than the whole curve, it goes along the curve, whose factor may rise to 1 again.

    Args:
        problem: the problem; its factor scales all loads.
        options: how many events at most each path may have.
        interrupted: whether to stop.
    """
    ended = None
    for follow in (Follow.STABLE, Follow.EXACT) if is_straight(problem) else (Follow.EXACT,):
        follower = Follower(problem, replace(options, follow=follow), interrupted=interrupted)
        states = list(follower.states())
        if follower.end is End.REACHED and states:
            return FullLoad(x=states[-1].x, reason="the whole load is reached")
        # Where no load is borne on it, or some beyond the whole, the whole one may be borne all the same, off the path.
        begins = 0.0 < max((state.factor for state in states), default=0.0) <= 1.0
        off = follower.end is End.ESCAPES or (follower.is_closed and follow is Follow.EXACT)
        if follower.end is End.INTERRUPTED or (ended is None and not (off and begins)):
            return None
        ended = ended or _off(follower, states, follow)
    return ended


def _off(follower: Follower, states: Sequence[PathState], follow: Follow) -> FullLoad:
    """Where a body comes off or the curve turns back: the largest load, where no unstable state comes before it."""
    largest, stable = max(states, key=lambda one: one.factor), list(itertools.takewhile(lambda s: s.stable, states))
    if follow is Follow.STABLE:
        return FullLoad(x=None, reason=follower.reason, borne=largest)
    first = len(stable) == len(states) or states[len(stable)].factor == largest.factor
    back = "to no load" if follower.end is End.ESCAPES else "and form a closed curve"
    reason = f"at the factor {largest.factor:.6g} the equilibria turn back {back}"
    return FullLoad(x=None, reason=reason, borne=largest if first else None)
