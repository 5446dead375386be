"""The kinds of followers there are, and which one a problem needs: the first that can follow its path."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from typing import Protocol

from typing_extensions import override

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .arc_length.curved_graphs import CurvedGraphs
from .arc_length.distances import CurvedDistances
from .arc_length.follower import ArcLengthFollower
from .bonds import is_piecewise_linear
from .exact import ExactFollower
from .programme import Follower
from .state import PathState
from .straight_distances import StraightDistances
from .straight_graphs import StraightGraphs


class Distances(Protocol):
    """How far states are from the graphs of their laws and bounds, relative to the forces.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
    """

    def __init__(self, problem: CondensedProblem, remember: Collection[int]) -> None: ...

    def __call__(self, state: PathState, carried: Array | None = None) -> float:
        """The distance of a state, of given forces of laws and bounds or of what the body leaves them."""


class Graphs(Protocol):
    """A state along the graphs on which its laws and bounds are.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
        state: the state.

    Attributes:
        x: displacements, (n,).
        force: of laws and bounds, (n,).
    """

    x: Array
    force: Array

    def __init__(self, problem: CondensedProblem, remember: Collection[int], state: PathState) -> None: ...

    def take(self, load: Array) -> None:
        """Move along the graphs until a small load more is carried, (n,)."""


class FollowerKind(ABC):
    """A kind of follower, and how its states are certified on Γc. Subclasses are tried in the order of their making.

    Attributes:
        follower: makes a follower.
        distances: makes the distances of its states.
        graphs: makes a state along its graphs.
    """

    made: list[FollowerKind] = []  # noqa: RUF012
    follower: type[Follower]
    distances: type[Distances]
    graphs: type[Graphs]

    def __init_subclass__(cls) -> None:
        FollowerKind.made.append(cls())

    @abstractmethod
    def follows(self, problem: CondensedProblem) -> bool:
        """Whether it can follow the paths of a problem."""


class ExactKind(FollowerKind):
    """Piecewise linear laws of one component each: exactly, from event to event."""

    follower = ExactFollower
    distances = StraightDistances
    graphs = StraightGraphs

    @override
    def follows(self, problem: CondensedProblem) -> bool:
        return is_piecewise_linear(problem)


class ArcLengthKind(FollowerKind):
    """Any other laws: predictor and corrector."""

    follower = ArcLengthFollower
    distances = CurvedDistances
    graphs = CurvedGraphs

    @override
    def follows(self, problem: CondensedProblem) -> bool:
        return True


def kind_of(problem: CondensedProblem) -> FollowerKind:
    """The first kind that can follow the paths of a problem.

    Args:
        problem: the problem.
    """
    return next(kind for kind in FollowerKind.made if kind.follows(problem))
