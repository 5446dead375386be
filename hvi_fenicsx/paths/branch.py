"""A branch of equilibria, followed from one of its states on: what is asked of it, and what happens on its way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array
from .contact_points import ContactPoints, Values
from .segments import Segment
from .state import Event, Position
from .thresholds import DEFAULT


class StepEnd(Enum):
    """What ended a step."""

    STEP = "nothing"
    END = "a point reached the end of its segment"
    TURNED = "a bond with memory turned back"
    FOLD = "the factor turned"
    FACTOR = "the factor reached its aim"
    AWAY = "nothing ends the branch"
    STUCK = "no step is short enough"


@dataclass(frozen=True, kw_only=True)
class Move:
    """A step.

    Attributes:
        outcome: what ended it.
        point: which point, where one did.
    """

    outcome: StepEnd
    point: int | None = None


Passage = tuple[int, Event]
"""A point that has passed from one segment of its graph to the next, and what happened there."""


def event_between(before: Segment, after: Segment) -> Event:
    """What happens where a point passes: its contact closes or opens, or a law has another piece.

    Args:
        before: the segment that it leaves.
        after: the one on which it goes on.
    """
    if after.bound:
        return Event.CONTACT
    return Event.RELEASE if before.bound else Event.KINK


class Refused(Exception):
    """A step that is too long, or a state from which no way on was found."""


class Branch(ABC):
    """The equilibria S x + r = f0 + λ f1 from one of them on.

    Attributes:
        points: where all points are; changed.
        trend: the sign of the factor's rate where it last did not stand; 0 before that.
        unstable: number of directions in which the energy falls at constant loads.
        divides: whether its steps have points between, for the work along them.
        shortest: step on a curve.
    """

    divides, shortest = False, DEFAULT.standing
    points: ContactPoints
    trend: int
    unstable: int

    @property
    @abstractmethod
    def factor(self) -> float:
        """λ."""

    @property
    @abstractmethod
    def rising(self) -> float:
        """How the factor changes along the branch; 0 where it stands but for rounding."""

    @property
    @abstractmethod
    def stands(self) -> bool:
        """Whether the factor stands still, but for rounding, while points move."""

    @property
    @abstractmethod
    def z(self) -> Array:
        """The coordinates of all points along their graphs, (n,)."""

    @property
    @abstractmethod
    def directions(self) -> Array:
        """How fast the points go along their graphs, (m,)."""

    @property
    @abstractmethod
    def motion(self) -> Array:
        """How fast the displacements change along the branch, (n,)."""

    @abstractmethod
    def leaving(self) -> Iterator[tuple[Array, int]]:
        """Motions in which the energy may fall, (n,) each, and the point that leads it."""

    @property
    def values(self) -> Values:
        """Displacements and forces of all points."""
        return self.points.values(self.z)

    @abstractmethod
    def position(self, leg: int) -> Position:
        """Where on the branch the state is.

        Args:
            leg: of the load history that comes next.
        """

    @abstractmethod
    def resume(self, position: Position) -> None:
        """Go on as the branch went.

        Args:
            position: where it was.
        """

    @abstractmethod
    def set_out(self, sign: float) -> None:
        """Set out where the factor goes in a direction, and let the points pass that have to.

        Args:
            sign: 1 where the factor is to grow, -1 where it is to fall.

        Raises:
            Refused: there is no end of passing.
            numpy.linalg.LinAlgError: the factor stands along the branch.
        """

    @abstractmethod
    def advance(self, aim: float) -> Move:
        """One step: to the first event, or as far as is safe.

        Args:
            aim: the factor at which to stop.
        """

    @abstractmethod
    def pass_on(self, move: Move) -> list[Passage]:
        """Let the point go on that reached an end of its segment or turned back, and those that have to then.

        Args:
            move: the step in which it did.

        Raises:
            Refused: there is no end of passing.
        """

    def note(self, move: Move) -> None:  # noqa: B027
        """Note what a step, and the passages after it, make of trend and stability.

        Args:
            move: the step.
        """

    def watch_folds(self) -> None:  # noqa: B027
        """Report from here on where the factor turns."""

    @abstractmethod
    def must_leave(self, aim: float) -> bool:
        """Whether no stable way goes on along the branch.

        Args:
            aim: the factor that is wanted.
        """

    @abstractmethod
    def balanced(self, factor: float) -> Array:
        """The coordinates in equilibrium at a factor nearby, on the segments as they are, (n,).

        Args:
            factor: λ.

        Raises:
            Refused: there are none.
            numpy.linalg.LinAlgError: the equations are singular.
        """

    def inverse(self) -> CellInverse | None:
        """The inverse of the equations, where it is known."""
        return None


def advancing(branch: Branch, aim: float, most: int) -> Iterator[Move]:
    """The steps of a branch, from event to event; at each one that is an event the points have passed.

    Args:
        branch: the branch; it has a direction.
        aim: the factor at which a step ends.
        most: steps at most.

    Raises:
        Refused: there is no end of passing.
    """
    for _ in range(most):
        branch.points.check()
        move = branch.advance(aim)
        if move.outcome in (StepEnd.END, StepEnd.TURNED):
            branch.pass_on(move)
        yield move
