"""All ways on from a state at which several bonds are at ends of their pieces at once.

At the state each such unknown goes on along one of two segments, forward or backward; so does a bond with memory that
is where it has never been: outward along its law, or back along the secant. For each combination the rates are linear,
and a combination is a way on where they have the signs that it supposes. There may be none: with memory the graphs
change as the path goes, and no parity of ends holds.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .segments import Segment


@dataclass(frozen=True, kw_only=True)
class Way:
    """One way on.

    Attributes:
        cells: where the unknowns are along it.
        heading: whether the factor rises or falls, 1 or -1.
        moved: the displacements' rates, (n,).
        unstable: number of unstable directions along it.
        fresh: number of bonds with memory that go where they have never been.
    """

    cells: Cells
    heading: int
    moved: Array
    unstable: int
    fresh: int

    @property
    def leader(self) -> tuple[int, int]:
        """The unknown that goes farthest where its bonds have never been, or at all, and its direction, 1 or -1."""
        speeds = np.where(self.cells.outward != 0.0, 1.0, 1e-9) * np.abs(self.moved)
        first = int(np.argmax(speeds))
        return first, 1 if self.moved[first] > 0.0 else -1

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


@dataclass(frozen=True, kw_only=True)
class _Stand:
    """Where one unknown may go: number of the segment and coordinate, backward and forward."""

    chain: tuple[Segment, ...]
    backward: tuple[int, float]
    forward: tuple[int, float]

    @property
    def branches(self) -> bool:
        return self.backward != self.forward


def ways_on(problem: CondensedProblem, bonds: BondTable, cells: Cells, sizes: Array) -> list[Way]:
    """The ways on from a state; none where too many unknowns are at ends at once.

    Args:
        problem: the problem.
        bonds: the bonds; those that are where they have never been note that.
        cells: the state.
        sizes: what coordinates are measured by, (n,).
    """
    stands = [_stand(bonds, cells, i, bonds.thresholds.near_end * float(sizes[i])) for i in range(len(cells))]
    branching = [i for i, stand in enumerate(stands) if stand.branches]
    if len(branching) > bonds.thresholds.branching:
        return []
    patterns = itertools.product((-1.0, 1.0), repeat=len(branching))
    return [way for p in patterns for way in _ways(problem, stands, branching, np.array(p))]


def _stand(bonds: BondTable, cells: Cells, i: int, near: float) -> _Stand:
    chain, number, at = cells.chain(i), int(cells.numbers[i]), float(cells.tau[i])
    if cells.outward[i]:
        x, force = float(cells.x[i]), float(cells.force[i])
        bonds.remember(i, x, force)
        chain = bonds.chain(i)
        number = min(range(len(chain)), key=lambda k: chain[k].distance(x, force, bonds.problem.elastic.diagonal[i]))
        at = chain[number].coordinate(x, force)
    here, backward, forward = chain[number], (number, at), (number, at)
    if here.high - at <= near and number + 1 < len(chain):
        forward = number + 1, chain[number + 1].low
    if at - here.low <= near and number > 0:
        backward = number - 1, chain[number - 1].high
    return _Stand(chain=chain, backward=backward, forward=forward)


def _ways(problem: CondensedProblem, stands: list[_Stand], branching: list[int], pattern: Array) -> Iterator[Way]:
    """The ways of one combination of directions."""
    taken = [stand.forward for stand in stands]
    for i, direction in zip(branching, pattern, strict=True):
        taken[i] = stands[i].forward if direction > 0.0 else stands[i].backward
    numbers = np.array([number for number, _ in taken], dtype=np.int64)
    chains = [stand.chain for stand in stands]
    cells = Cells(problem.elastic, chains, numbers, np.array([at for _, at in taken]))
    try:
        rates = cells.inverse().solve(problem.force_rate)
    except np.linalg.LinAlgError:
        return
    for heading in (1, -1):
        if np.all(heading * rates[branching] * pattern > 0.0):
            moved = np.where(cells.moving, heading * rates, 0.0)
            fresh, unstable = int(np.count_nonzero(cells.outward)), cells.unstable_directions()
            yield Way(cells=cells, heading=heading, moved=moved, unstable=unstable, fresh=fresh)
