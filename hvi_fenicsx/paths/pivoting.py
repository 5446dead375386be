"""The equilibria of points on straight segments as a branch, followed from one end of a segment to the next.

Between two ends the equations are linear: n for n coordinates τ and the factor λ. One of these n + 1 variables drives,
the others form a basis whose inverse is kept. Where a coordinate reaches the end of its segment, the point goes on into
the next one in the same direction along its graph, and its new coordinate drives: a pivot exchanges one column of the
basis, and whether λ then rises or falls follows. No matrix is singular where λ stands still. (Complementary pivoting:
Lemke 1965; Eaves 1976; for elastic-plastic frames Maier 1970.)

Where several points reach ends at once, the load is imagined to be perturbed by ε q, with ε infinitesimal and q at
random: each coordinate then has a part of the order ε as well, which says who comes first (lexicographic order).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from typing_extensions import override

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, Integers
from .branch import Branch, Move, Passage, StepEnd
from .relations import ContactPoints
from .segments import Segment, SegmentKind, piece_at
from .state import Position
from .straight_state import FACTOR, Basis, StraightState
from .thresholds import ROUNDING


class StraightBranch(Branch):
    """The branch from one of its states on.

    Args:
        points: where all points are; changed.
        constant: f0, (n,).
        rate: f1, (n,).
        z: their coordinates, (n,).
        factor: λ.
        position: where the branch goes on; by default it sets out with the factor.
        inverse: of the equations, where it is known and the factor drives.
        heading: the direction in which the factor sets out, 1 or -1.

    Attributes:
        state: the coordinates.
        rate: f1, (n,).
        heading: the direction of the variable that drives, 1 or -1.
        small: parts of the order ε of the coordinates, (n,).
        rates: how all coordinates change with the driving variable, (n,).
        factor_rate: how the factor does.

    Raises:
        numpy.linalg.LinAlgError: the tangent is singular.
    """

    def __init__(
        self,
        points: ContactPoints,
        constant: Array,
        rate: Array,
        z: Array,
        factor: float,
        position: Position | None = None,
        inverse: CellInverse | None = None,
        heading: int = 1,
    ) -> None:
        self._thresholds, self._stiffness = points.thresholds, points.elastic
        self.points, self.state = points, StraightState(points, z)
        self._constant, self.rate, self._factor = constant, rate, factor
        self.heading, self.trend, self.unstable, self._driven = heading, 0, 0, 0.0
        self._leader = 0
        self._stiffest, self._live = _largest(self._stiffness.diagonal), _largest(rate)
        self._perturb()
        self.state.hold(rate)
        driver = FACTOR
        if position is not None:
            driver, self.heading, self.small = position.driver, position.heading, position.small.copy()
        if driver == FACTOR:
            driver = self._setting_out()
        self._basis = Basis(self.state, rate, driver, inverse)
        self._find_direction()
        self._told = self.values.x, factor

    def _setting_out(self) -> int:
        """What drives where the path sets out with the factor: along a motion that nothing resists, the body does."""
        driven = self.points.unresisted(self.values, self.rate).driven
        if not np.any(driven):
            return FACTOR
        first = int(np.argmax(np.abs(driven)))
        self.trend, self.heading = self.heading, self.heading * int(np.sign(driven[first]))
        return first

    @property
    @override
    def factor(self) -> float:
        return self._factor

    @property
    @override
    def rising(self) -> float:
        return 0.0 if self.stands else self.factor_rate

    @property
    @override
    def z(self) -> Array:
        return self.state.tau

    @property
    @override
    def directions(self) -> Array:
        return self.rates

    @override
    def leaving(self) -> Iterator[tuple[Array, int]]:
        k, inverse = self._leader, self.inverse() or self.state.inverse()
        rise, own = float(self.points.rise[k]), np.eye(1, len(self.z), self._leader)[0]
        if not rise:
            found = self.state.softest(inverse, own)
            yield found * (np.sign(found[k] * self.rates[k]) or 1.0), k
            return
        way = np.sign(self.rates[k]) * (rise if rise > 0.0 else 1.0)  # on a drop: it goes on, and all others follow
        pull = np.where(self.points.moving, -way * self.points.elastic.column(k), 0.0)
        yield np.where(self.points.moving, inverse.solve(pull), way * own), k

    @property
    @override
    def motion(self) -> Array:
        return np.where(self.points.moving, self.rates, 0.0)

    @override
    def position(self, leg: int) -> Position:
        numbers, small = self.points.numbers.copy(), self.small.copy()
        return Position(leg=leg, numbers=numbers, driver=self._basis.driver, heading=self.heading, small=small)

    @override
    def set_out(self, sign: float, check: Callable[[], None]) -> None:
        if (self.trend or self.factor_rate) * sign < 0.0:
            self.heading, self.trend = -self.heading, -self.trend
            self._find_direction()

    # -- the perturbation

    def _perturb(self) -> None:
        """Coordinates of the order ε, inside the segments where a coordinate is at an end; q follows from them."""
        random = np.random.default_rng(0)
        self.small = random.uniform(0.5, 1.5, len(self.z))
        self.small[self.z == self.points.high] *= -1.0
        self._lag = random.uniform(0.5, 1.5, len(self.z))
        self._behind = self._lag.copy()

    # -- linear algebra

    @override
    def inverse(self) -> CellInverse | None:
        return self._basis.inverse()

    def _find_direction(self) -> None:
        """How all variables change with the driving one."""
        self._basis.renew()
        rates, driver = -self.heading * self._basis.column, self._basis.driver
        if driver == FACTOR:
            self.factor_rate = float(self.heading)
        else:
            self.factor_rate = float(rates[driver])
            rates[driver] = self.heading
        held = self.state.held
        self.rates: Array = rates - held.T @ (held @ rates)
        self._stands = self._factor_stands()
        if not self._stands:
            self.trend = int(np.sign(self.factor_rate))

    def _residual(self) -> Array:
        values = self.values
        return np.asarray(self._stiffness @ values.x + values.force - self._constant - self._factor * self.rate)

    def _refine(self) -> None:
        """Take out what rounding has left in the equations, and find the direction."""
        residual = self._residual()
        self._find_direction()
        self._correct(self._basis.roughly(residual))

    def _correct(self, change: Array) -> None:
        """Take a change off, the driving variable held; if that is a slow one, to the nearest point of the branch."""
        if (driver := self._basis.driver) != FACTOR:
            scale = _largest(self.motion) or 1.0
            along, rate, own = self.motion / scale, self.factor_rate / scale, float(change[driver])
            change[driver] = 0.0
            slow = abs(self.rates[driver]) < self._thresholds.slow * scale
            way = float(along @ change) / (float(along @ along) or 1.0) if slow else 0.0
            change -= way * self.rates / scale
            self._factor -= own - way * rate
        self.state.tau -= change

    @override
    def balanced(self, factor: float) -> Array:
        left = self._residual() + (self._factor - factor) * self.rate
        return self.z - self.state.inverse().solve(left)

    # -- events

    @override
    def advance(self, aim: float) -> Move:
        chosen = self._first_end(aim)
        if chosen is None:
            return Move(outcome=StepEnd.AWAY)
        variable, length, small, tied = chosen
        self._go(length, small)
        if variable == FACTOR:
            self._factor = aim
        before, factor = self._told  # not the state from which it went: that was refined since
        self._told = self.values.x, self._factor
        self._driven = 0.5 * float(self.rate @ (before + self.values.x)) * (self._factor - factor)
        if variable == FACTOR:
            return Move(outcome=StepEnd.FACTOR)
        turns = self.rates[variable] * self.points.outward[variable] < 0.0
        return Move(outcome=StepEnd.TURNED if turns else StepEnd.END, point=variable, tied=tied)

    @override
    def driven(self, move: Move) -> float:
        return self._driven

    def _go(self, length: float, small: float) -> None:
        self.state.tau += length * self.rates
        self._factor += length * self.factor_rate
        self.small += small * self.rates
        inward = self.points.outward * self.rates < 0.0
        self._behind = np.where(inward, self._behind - small * np.abs(self.rates), self._lag)

    def _first_end(self, aim: float) -> tuple[int, float, float, int] | None:
        """Which variable reaches its end first, the way to there, that of the order ε, and how many tie."""
        numbers, slack, small, speed, allowed = self._ends()
        approaches = (aim - self._factor) * self.factor_rate > 0.0 and not self.stands
        if not numbers.size and not approaches:
            return None
        if approaches:
            until = (aim - self._factor) / self.factor_rate
            if until <= float(np.min((slack + allowed) / speed, initial=np.inf)):
                return FACTOR, max(until, 0.0), 0.0, 1
        ways = slack / speed
        near = np.flatnonzero(ways <= np.min((slack + allowed) / speed))
        first = near[np.argmin(small[near] / speed[near])]
        return int(numbers[first]), float(ways[first]), float(small[first] / speed[first]), len(near)

    def _ends(self) -> tuple[Integers, Array, Array, Array, Array]:
        """The variables that approach an end: numbers, distances, those of the order ε, speeds, what may be passed."""
        points, rates, tau = self.points, self.rates, self.z
        speed, size = np.abs(rates), self.sizes()
        inward = points.outward * rates < 0.0
        distance = np.where(rates > 0.0, points.high - tau, tau - points.low)
        small = np.where(rates > 0.0, -self.small, self.small)
        distance, small = np.where(inward, 0.0, distance), np.where(inward, self._behind, small)
        steep = self._steepness()
        rounding = self._thresholds.reached if self.stands else self._thresholds.standing
        moves = speed * steep > rounding * self._fastest(speed)
        at = np.flatnonzero(moves & np.isfinite(distance))
        slack, beyond = np.maximum(distance[at], 0.0), np.maximum(-distance[at], 0.0)
        return at, slack, small[at], speed[at], np.maximum(1e-11 * (size / steep)[at] - beyond, 0.0)

    def _steepness(self) -> Array:
        """The slopes of pieces over the largest stiffness, 1 at least, (n,): there a short way is a large force."""
        return np.asarray(np.maximum(np.abs(self.points.slope) / (self._stiffest or np.inf), 1.0))

    def _fastest(self, speed: Array) -> Array:
        """The greatest speed of the same kind, of displacements or of forces, (n,).

        Where a body moves as a whole, the forces' speeds are what rounding leaves of stiffness times displacement.
        """
        moving = self.points.moving
        kinds = [float(np.max(speed[kind], initial=0.0)) for kind in (moving, ~moving)]
        elastic = 0.1 * self._stiffest * kinds[0]
        return np.asarray(np.where(moving, kinds[0], max(kinds[1], elastic)))

    def sizes(self) -> Array:
        """What coordinates are measured by: displacements or forces, (n,)."""
        moving, lengths = self.points.moving, self.points.high - self.points.low
        lengths = np.where(np.isfinite(lengths), lengths, 0.0)
        kinds = [
            max(float(np.max(lengths[kind], initial=0.0)), float(np.max(np.abs(self.z[kind]), initial=0.0)))
            for kind in (moving, ~moving)
        ]
        return np.asarray(np.where(moving, kinds[0], kinds[1]))

    @override
    def pass_on(self, move: Move, check: Callable[[], None]) -> list[Passage]:
        assert move.point is not None
        i, before, trend, stood = move.point, self.points.segment(move.point), self.trend, self.stands
        forward, held = bool(self.rates[i] > 0.0), self.state.held
        if move.outcome is StepEnd.TURNED:
            self._turn_back(i, forward=forward)
        else:
            number = int(self.points.numbers[i]) + (1 if forward else -1)
            segment = self.points.chain(i)[number]
            self._enter(i, number, segment.low if forward else segment.high)
        after = self.points.segment(i)
        change = _change(before, after) if trend * self.trend < 0 else 0
        neutral = stood or self.stands or self.state.held is not held
        self.unstable = self.points.unstable_directions(self.values) if neutral else self.unstable + change
        if change > 0 or neutral:
            self._leader = i
        return [Passage(point=i, before=before, after=after)]

    def _turn_back(self, i: int, *, forward: bool) -> None:
        """On to the secant of where the bonds have been."""
        values = self.values
        force = float(self.points.bond_forces(values)[i])
        x = self.points.remember(i, float(values.x[i]), force)
        number = piece_at(self.points.chain(i), x, ROUNDING, forward=forward)
        self._enter(i, number, self.points.chain(i)[number].coordinate(x, force))

    def _enter(self, i: int, number: int, coordinate: float) -> None:
        """Let a point go on, in its present direction along its graph, on another segment."""
        direction = 1 if self.rates[i] > 0.0 else -1
        self.state.enter(i, number, coordinate)
        if self.state.hold(self.rate):  # other motions are held: set out anew with the factor, as it went
            self.heading = self.trend or 1
            self._basis = Basis(self.state, self.rate, self._setting_out())
        else:
            self.heading = self._heading_on(i, direction)
        self.small[i], self._behind[i] = 0.0, self._lag[i]
        self._refine()

    def _heading_on(self, i: int, direction: int) -> int:
        """Choose what drives from a point's new segment on; its direction for the point to go in a given one.

        The point itself drives, unless it is so slow that the variable that drives already keeps more digits.
        """
        if i == self._basis.driver:
            return direction
        if onward := self._basis.replace(i):
            return onward * self.heading
        self._basis.exchange(i)
        return direction

    @property
    @override
    def stands(self) -> bool:
        return self._stands

    def _factor_stands(self) -> bool:
        points, rates = self.points, self.rates
        forces = _largest(np.where(points.moving, points.slope, points.rise) * rates)
        size = self._stiffest * _largest(self.motion) + forces
        return abs(self.factor_rate) * self._live < self._thresholds.reached * size

    @override
    def beyond(self) -> Array:
        found = self._first_end(self._factor)
        length = self.points.scale / (_largest(self.rates) or 1.0) if found is None else found[1]
        return self.z + self._thresholds.near * length * self.rates

    @override
    def must_leave(self, aim: float) -> bool:
        """Unstable, and no other point is at the end of its segment already."""
        if self.unstable == 0:
            return False
        chosen = self._first_end(aim)
        numbers, slack, _, _, allowed = self._ends()
        return chosen is None or not np.any((slack <= allowed)[numbers == chosen[0]])


def _change(before: Segment, after: Segment) -> int:
    """How the number of unstable directions changes where the factor turns: by the sign of the pivot."""
    if before.kind is SegmentKind.PIECE and after.kind is SegmentKind.PIECE:
        return 1 if after.slope < before.slope else -1
    if before.kind is SegmentKind.PIECE:
        return 1 if _drops(after) else -1
    return -1 if _drops(before) else 1


def _drops(segment: Segment) -> bool:
    return segment.kind is SegmentKind.JUMP and segment.rise < 0.0


def _largest(values: Array) -> float:
    """The largest absolute value, 0 of none."""
    return float(np.abs(values).max(initial=0.0))
