"""The kinds of followers there are, and which one a problem needs: the first that can follow its path."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection

from typing_extensions import override

from ..system.condensed_problem import CondensedProblem
from .arc_length.distances import CurvedDistances
from .arc_length.follower import ArcLengthFollower
from .bonds import is_piecewise_linear
from .exact import ExactFollower
from .state import Follower, PathOptions, PathState
from .straight_distances import StraightDistances

Distance = Callable[[PathState], float]
"""How far a state is from the graphs of its laws and bounds, relative to the forces."""


class FollowerKind(ABC):
    """A kind of follower, and how its states are certified on Γc. Subclasses are tried in the order of their making."""

    made: list[FollowerKind] = []  # noqa: RUF012

    def __init_subclass__(cls) -> None:
        FollowerKind.made.append(cls())

    @abstractmethod
    def follows(self, problem: CondensedProblem) -> bool:
        """Whether it can follow the paths of a problem."""

    @abstractmethod
    def follower(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None,
        interrupted: Callable[[], bool],
    ) -> Follower:
        """A follower.

        Args:
            problem: the problem.
            options: what path is wanted.
            resume: the state after which to go on; None: from the factor 0.
            interrupted: whether to stop, asked at each state.
        """

    @abstractmethod
    def distances(self, problem: CondensedProblem, remember: Collection[int]) -> Distance:
        """How far states are from the graphs.

        Args:
            problem: the problem.
            remember: numbers of the problem's bonds that remember.
        """


class ExactKind(FollowerKind):
    """Piecewise linear laws of one component each: exactly, from event to event."""

    @override
    def follows(self, problem: CondensedProblem) -> bool:
        return is_piecewise_linear(problem)

    @override
    def follower(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None,
        interrupted: Callable[[], bool],
    ) -> Follower:
        return ExactFollower(problem, options, resume, interrupted)

    @override
    def distances(self, problem: CondensedProblem, remember: Collection[int]) -> Distance:
        return StraightDistances(problem, remember)


class ArcLengthKind(FollowerKind):
    """Any other laws: predictor and corrector."""

    @override
    def follows(self, problem: CondensedProblem) -> bool:
        return True

    @override
    def follower(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None,
        interrupted: Callable[[], bool],
    ) -> Follower:
        return ArcLengthFollower(problem, options, resume, interrupted)

    @override
    def distances(self, problem: CondensedProblem, remember: Collection[int]) -> Distance:
        return CurvedDistances(problem, remember)


def kind_of(problem: CondensedProblem) -> FollowerKind:
    """The first kind that can follow the paths of a problem.

    Args:
        problem: the problem.
    """
    return next(kind for kind in FollowerKind.made if kind.follows(problem))
