"""The branch from a state on, and all ways on where several bonds are at ends of their pieces at once.

There each of these points goes on along one of two segments, forward or backward; so does a bond with memory that is
where it has never been: outward along its law, or back along the secant. For each combination the rates are linear,
and a combination is a way on where they have the signs that it supposes. There may be none: with memory the graphs
change as the path goes, and no parity of ends holds.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array
from .branch import Branch
from .curve import Curve
from .pivoting import StraightBranch
from .relations import ContactPoints
from .statuses import Kept
from .straight_state import StraightState


@dataclass(frozen=True, kw_only=True)
class Way:
    """One way on.

    Attributes:
        kept: where the points are along it.
        z: their coordinates, (n,).
        heading: whether the factor rises or falls, 1 or -1.
        moved: the displacements' rates, (n,).
        unstable: number of unstable directions along it.
        fresh: number of bonds with memory that go where they have never been.
        leader: the point that goes farthest where its bonds have never been, or at all, and its direction, 1 or -1.
    """

    kept: Kept
    z: Array
    heading: int
    moved: Array
    unstable: int
    fresh: int
    leader: tuple[int, int]

    def goes_back(self, came: Array) -> bool:
        """Whether it is the way by which the path came.

        Args:
            came: the last change of the displacements, (n,).
        """
        sizes = float(np.linalg.norm(came) * np.linalg.norm(self.moved))
        return sizes > 0.0 and float(came @ self.moved) < -(1.0 - 1e-9) * sizes


def chosen(ways: Sequence[Way], came: Array, wanted: float, *, stable: bool) -> Way | None:
    """The way on which most bonds go where they have never been; not the one by which the path came.

    Args:
        ways: those that there are.
        came: the last change of the displacements, (n,).
        wanted: whether the factor is to rise or to fall, 1 or -1.
        stable: whether it must be stable, and the factor change as wanted; where none is so, an unstable one, along
            which a jump begins.
    """
    fit = [way for way in ways if not way.goes_back(came)]
    if stable:
        lasting = [way for way in fit if way.unstable == 0 and way.heading == wanted]
        fit = lasting or [way for way in fit if way.unstable and np.any(way.moved)]
    return min(fit, key=lambda way: (-way.fresh, -way.heading * wanted)) if fit else None


def ways_on(branch: StraightBranch) -> list[Way]:
    """The ways on from a state; none where too many points are at ends at once.

    Bonds that are where they have never been note that, and the state is one of theirs from then on.

    Args:
        branch: it is at the state.
    """
    points, limits, sizes = branch.points, branch.points.thresholds, branch.sizes()
    ends = [_ends(branch.state, i, limits.none * float(sizes[i])) for i in range(len(points))]
    branching = [i for i, (backward, forward) in enumerate(ends) if backward != forward]
    if len(branching) > limits.branching:
        return []
    patterns = itertools.product((-1.0, 1.0), repeat=len(branching))
    kept, z = points.kept(), branch.z.copy()
    found = [way for pattern in patterns for way in _ways(branch, ends, branching, np.array(pattern))]
    points.restore(kept)
    branch.state.tau = z
    return found


_Ends = tuple[tuple[int, float], tuple[int, float]]
"""The segment and coordinate on which a point goes backward, and forward."""


def _ends(state: StraightState, i: int, near: float) -> _Ends:
    """The segment and coordinate on which a point goes backward, and forward."""
    points = state.points
    if points.outward[i]:
        x, force = float(state.values.x[i]), float(state.values.force[i])
        points.remember(i, x, force)
        chain, stiffness = points.chain(i), float(points.elastic.diagonal[i])
        number = min(range(len(chain)), key=lambda k: chain[k].distance(x, force, stiffness))
        state.enter(i, number, chain[number].coordinate(x, force))
    chain, number, at = points.chain(i), int(points.numbers[i]), float(state.tau[i])
    here, backward, forward = chain[number], (number, at), (number, at)
    if here.high - at <= near and number + 1 < len(chain):
        forward = number + 1, chain[number + 1].low
    if at - here.low <= near and number > 0:
        backward = number - 1, chain[number - 1].high
    return backward, forward


def _ways(branch: StraightBranch, ends: Sequence[_Ends], branching: list[int], pattern: Array) -> Iterator[Way]:
    """The ways of one combination of directions."""
    points, state = branch.points, StraightState(branch.points, branch.z)
    for i, direction in zip(branching, pattern, strict=True):
        state.enter(i, *ends[i][int(direction > 0.0)])
    try:
        rates = state.inverse().solve(branch.rate)
    except np.linalg.LinAlgError:
        return
    for heading in (1, -1):
        if np.all(heading * rates[branching] * pattern > 0.0):
            moved = np.where(points.moving, heading * rates, 0.0)
            first = int(np.argmax(np.where(points.outward != 0.0, 1.0, 1e-9) * np.abs(moved)))
            yield Way(
                kept=points.kept(),
                z=state.tau.copy(),
                heading=heading,
                moved=moved,
                unstable=points.unstable_directions(state.values),
                fresh=int(np.count_nonzero(points.outward)),
                leader=(first, 1 if moved[first] > 0.0 else -1),
            )


def branch_from(
    points: ContactPoints,
    constant: Array,
    rate: Array,
    z: Array,
    factor: float,
    inverse: CellInverse | None = None,
    heading: int = 1,
) -> Branch:
    """The branch from a state on: exactly from event to event, or by predictor and corrector where graphs are curved.

    Args:
        points: where all points are; changed.
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        z: their coordinates, (n,).
        factor: λ.
        inverse: of the straight equations, where it is known.
        heading: the direction in which the factor of a straight branch sets out, 1 or -1.
    """
    if points.straight:
        return StraightBranch(points, constant, rate, z, factor, inverse=inverse, heading=heading)
    return Curve(constant, rate, points, z.copy(), factor)
