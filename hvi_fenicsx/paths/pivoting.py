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

from collections.abc import Iterator

import numpy as np
from typing_extensions import override

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, Integers, magnitude
from .branch import Move, Passage, StepEnd, event_between
from .segments import piece_at
from .state import Position
from .straight_equations import FACTOR, StraightEquations
from .thresholds import DEFAULT, ROUNDING


class StraightBranch(StraightEquations):
    """The branch from one of its states on.

    Args:
        points: where all points are; changed.
        constant: f0, (n,).
        rate: f1, (n,).
        z: their coordinates, (n,).
        factor: λ.

    Attributes:
        heading: the direction of the variable that drives, 1 or -1.
        small: parts of the order ε of the coordinates, (n,).
        rates: how all variables change with the driving one, (n + 1,).
    """

    def start(self, inverse: CellInverse | None) -> None:
        """Set out with the factor.

        Args:
            inverse: of the equations, where it is known.

        Raises:
            numpy.linalg.LinAlgError: the tangent is singular.
        """
        self.heading, self.trend, self.unstable, self._leader = 1, 0, 0, 0
        self._stiffest, self._live = magnitude(self._stiffness.diagonal), magnitude(self.rate)
        random, z, sizes = np.random.default_rng(0), self.z, np.abs(self.values.x)
        # coordinates of the order ε, inside the segments where a coordinate is at an end; q follows from them; they go
        # by the size of displacements, whatever the numbers of points and however the scene is mirrored
        place = np.argsort(np.argsort(sizes, kind="stable"))
        self.small = random.uniform(0.5, 1.5, len(z))[place] * np.where(z == self.points.high, -1.0, 1.0)
        self._lag = random.uniform(0.5, 1.5, len(z))[place]
        self._behind = self._lag.copy()
        self._begin(FACTOR, inverse)

    def _begin(self, driver: int, inverse: CellInverse | None = None) -> None:
        """Set out with a variable that drives."""
        self.drive(self._setting_out() if driver == FACTOR else driver, inverse)
        self._find_direction()

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
    def rising(self) -> float:
        return 0.0 if self.stands else float(self.rates[FACTOR])

    @property
    @override
    def directions(self) -> Array:
        return self.rates[:-1]

    @override
    def leaving(self) -> Iterator[tuple[Array, int]]:
        k, found = self._leader, self.motion
        if self.points.rise[k]:  # on a drop: it goes on, and all others follow
            way = np.sign(self.rates[k])
            pull = np.where(self.points.moving, -way * self.points.elastic.column(k), 0.0)
            found = np.where(self.points.moving, (self.inverse() or self.factorised()).solve(pull), 0.0)
            found[k] = way
        yield found, k

    @property
    @override
    def motion(self) -> Array:
        return np.where(self.points.moving, self.directions, 0.0)

    @override
    def position(self, leg: int) -> Position:
        return Position(
            leg=leg,
            numbers=self.points.numbers.copy(),
            driver=self.driver,
            heading=self.heading,
            z=self.z.copy(),
            small=self.small.copy(),
        )

    @override
    def resume(self, position: Position) -> None:
        self.heading, self.small, self.trend = position.heading, np.array(position.small), 0
        self._begin(position.driver)

    @override
    def set_out(self, sign: float) -> None:
        if (self.trend or self.rates[FACTOR]) * sign < 0.0:
            self.heading, self.trend = -self.heading, -self.trend
            self._find_direction()

    # -- linear algebra

    def _find_direction(self) -> None:
        """How all variables change with the driving one."""
        self.renew()
        self.rates: Array = self.variables(-self.heading * self.column)
        self.rates[self.driver] = self.heading
        self.rates[:-1] -= self.held.T @ (self.held @ self.directions)
        self._stands = self._is_standing()
        if not self.stands:
            self.trend = int(np.sign(self.rates[FACTOR]))

    def _refine(self) -> None:
        """Take out what rounding has left in the equations, and find the direction."""
        residual = self.residual()
        self._find_direction()
        self._correct(self.variables(self.solved(residual)))

    def _correct(self, change: Array) -> None:
        """Take a change off, the driving variable held; if that is a slow one, to the nearest point of the branch."""
        scale = magnitude(self.motion) or 1.0
        if self.driver != FACTOR and abs(self.rates[self.driver]) < DEFAULT.slow * scale:
            along = self.motion / scale
            way = float(along @ change[:-1]) / (float(along @ along) or 1.0)
            change -= way * self.rates / scale
        self.y -= change

    @override
    def balanced(self, factor: float) -> Array:
        left = self.residual() + (self.factor - factor) * self.rate
        return self.z - self.factorised().solve(left)

    # -- events

    @override
    def advance(self, aim: float) -> Move:
        chosen = self._first_end(aim)
        if chosen is None:
            return Move(outcome=StepEnd.AWAY)
        variable, length, small = chosen
        self.y += length * self.rates
        self.small += small * self.directions
        inward = self.points.outward * self.directions < 0.0
        self._behind = np.where(inward, self._behind - small * np.abs(self.directions), self._lag)
        if variable == FACTOR:
            self.y[FACTOR] = aim
            return Move(outcome=StepEnd.FACTOR)
        return Move(outcome=StepEnd.TURNED if inward[variable] else StepEnd.END, point=variable)

    def _first_end(self, aim: float) -> tuple[int, float, float] | None:
        """Which variable reaches its end first, the way to there, and that of the order ε."""
        numbers, slack, small, speed, allowed = self._ends()
        left, rate = aim - self.factor, self.rising
        if not numbers.size and not left * rate > 0.0:
            return None
        if left * rate > 0.0:
            until = left / rate
            if until <= float(np.min((slack + allowed) / speed, initial=np.inf)):
                return FACTOR, until, 0.0
        ways = slack / speed
        near = np.flatnonzero(ways <= np.min((slack + allowed) / speed))
        first = near[np.argmin(small[near] / speed[near])]
        return int(numbers[first]), float(ways[first]), float(small[first] / speed[first])

    def _ends(self) -> tuple[Integers, Array, Array, Array, Array]:
        """The variables that approach an end: numbers, distances, those of the order ε, speeds, what may be passed."""
        points, rates, tau = self.points, self.directions, self.z
        speed = np.abs(rates)
        inward = points.outward * rates < 0.0
        distance = np.where(rates > 0.0, points.high - tau, tau - points.low)
        small = np.where(rates > 0.0, -self.small, self.small)
        distance, small = np.where(inward, 0.0, distance), np.where(inward, self._behind, small)
        # a short way on a steep piece is a large force; where a body moves as a whole, the speeds of forces are what
        # rounding leaves of stiffness times displacement
        steep = np.maximum(np.abs(points.slope) / (self._stiffest or np.inf), 1.0)
        fastest, force = self._by_kind(speed)
        rounding = DEFAULT.reached if self.stands else DEFAULT.standing
        speeds = np.where(points.moving, fastest, max(force, 0.1 * self._stiffest * fastest))
        moves = speed * steep > rounding * speeds
        lengths = points.high - points.low
        size = np.where(
            points.moving, *self._by_kind(np.maximum(np.where(lengths < np.inf, lengths, 0.0), np.abs(tau)))
        )
        at = np.flatnonzero(moves & np.isfinite(distance))
        slack, beyond = np.maximum(distance[at], 0.0), np.maximum(-distance[at], 0.0)
        return at, slack, small[at], speed[at], np.maximum(1e-11 * (size / steep)[at] - beyond, 0.0)

    def _by_kind(self, values: Array) -> tuple[float, float]:
        """The largest value of coordinates that are displacements, and of forces."""
        return magnitude(values[self.points.moving]), magnitude(values[~self.points.moving])

    @override
    def pass_on(self, move: Move) -> list[Passage]:
        assert move.point is not None
        i, before, trend, stood = move.point, self.points.segment(move.point), self.trend, self.stands
        forward, held = bool(self.rates[i] > 0.0), self.held
        if move.outcome is StepEnd.TURNED:
            self._turn_back(i, forward=forward)
        else:
            number = int(self.points.numbers[i]) + (1 if forward else -1)
            segment = self.points.chain(i)[number]
            self._enter(i, number, segment.low if forward else segment.high)
        after = self.points.segment(i)
        softens = 1 if after.hold < before.hold else -1
        change = softens if trend * self.trend < 0 else 0  # by the sign of the pivot
        neutral = stood or self.stands or self.held is not held
        self.unstable = self.points.unstable_directions(self.values) if neutral else self.unstable + change
        if change > 0 or neutral:
            self._leader = i
        return [(i, event_between(before, after))]

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
        self.points.enter(i, number)
        self.y[i] = coordinate
        if self.hold():  # other motions are held: set out anew with the factor, as it went
            self.heading = self.trend or 1
            self._begin(FACTOR)
        else:
            self.heading = self._heading_on(i, direction)
        self.small[i], self._behind[i] = 0.0, self._lag[i]
        self._refine()

    def _heading_on(self, i: int, direction: int) -> int:
        """Choose what drives from a point's new segment on; its direction for the point to go in a given one.

        The point itself drives, unless it is so slow that the variable that drives already keeps more digits.
        """
        if i == self.driver:
            return direction
        if onward := self.replace(i):
            return onward * self.heading
        self.exchange(i)
        return direction

    @property
    @override
    def stands(self) -> bool:
        return self._stands

    def _is_standing(self) -> bool:
        points = self.points
        forces = magnitude(np.where(points.moving, points.slope, points.rise) * self.directions)
        size = self._stiffest * magnitude(self.motion) + forces
        return abs(self.rates[FACTOR]) * self._live < DEFAULT.reached * size

    @override
    def must_leave(self, aim: float) -> bool:
        """Unstable, and no other point is at the end of its segment already."""
        if self.unstable == 0:
            return False
        chosen = self._first_end(aim)
        numbers, slack, _, _, allowed = self._ends()
        return chosen is None or not np.any((slack <= allowed)[numbers == chosen[0]])
