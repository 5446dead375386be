"""A curve of equilibria, followed by predictor and corrector with arc length as its parameter.

The predictor goes along the tangent of the equations in coordinates and factor; the corrector is Newton's method in the
plane across it (Riks 1979; Wempner 1971), or with the condition of an event instead of the plane: that a coordinate is
at the end of its segment, or that the factor has a wanted value. The equations on given segments are smooth
(:mod:`.contact_points`), so Newton's method converges quadratically there. A step is refused and halved where the
corrector does not converge or goes far, or where the tangent turns by more than some degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from typing_extensions import override

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, magnitude
from .branch import Branch, Move, Passage, Refused, StepEnd
from .contact_points import ContactPoints, FreeMotions
from .equations import CurvePoint
from .events import Crossing, CurveStep, Events, displacement_rate
from .pivoting import StraightBranch
from .state import Position
from .thresholds import DEFAULT


class CurvedBranch(Events):
    """The curve from one of its points on.

    Args:
        points: where all points are; changed.
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        z: their coordinates, (n,).
        factor: λ.

    Attributes:
        length: of the next step.
    """

    length = _next = 0.1
    _size = 0.0

    @override
    def advance(self, aim: float) -> CurveStep:
        if self._goes_on_for_ever(aim):
            return CurveStep(outcome=StepEnd.AWAY, before=self.here, after=self.here)
        while self.length > self.shortest:
            try:
                move = self._tried(aim)
            except (Refused, np.linalg.LinAlgError):
                self.length *= 0.5
                while self.length > max(self._size, self.shortest):  # it would be the same step
                    self.length *= 0.5
                continue
            self.here = move.after
            if move.outcome is StepEnd.FACTOR:
                self.here.y[-1] = aim / self.unit
            return move
        return CurveStep(outcome=StepEnd.STUCK, before=self.here, after=self.here)

    def _goes_on_for_ever(self, aim: float) -> bool:
        """Whether nothing ends the curve."""
        distances, _ = self._ends()
        nearest = min(float(np.min(distances, initial=np.inf)), self._until(aim))
        if not self.points.bent:
            return not np.isfinite(nearest)
        slides_on = self.rising == 0.0 and nearest > self._far and self._is_straight()
        return slides_on or (nearest == np.inf and magnitude(self.here.values.s) > self._far)

    def _is_straight(self) -> bool:
        """Whether the equations stay satisfied far along the tangent: a body slides on, and no force changes."""
        y = self.here.y + self._far * self.here.tangent
        values = self.here.values
        load = (self.points.stiffness @ values.x + values.force) / self.points.forces
        allowed = DEFAULT.none * (1.0 + magnitude(load)) + DEFAULT.digits * self._far
        return magnitude(self.residual(y, self.points.values(y[:-1]))) <= allowed

    def _ends(self) -> tuple[Array, Array]:
        """Along the tangent, the ways of all points to the ends of their segments, and these ends, (m,) each."""
        points, s = self.points, self.here.values.s
        rates = self.directions
        largest = magnitude(self.here.tangent)
        ends = np.where(rates > 0.0, points.high, points.low)
        there = np.abs(ends - s) <= points.allowances(self.here.values, rates, largest)
        rests = np.where((there & points.bent) | self.stood, DEFAULT.undecided, DEFAULT.standing)
        moves = np.abs(rates) > rests * largest
        found = np.full(len(points), np.inf)
        found[moves] = np.maximum((ends - s)[moves] / rates[moves], 0.0)
        return found, ends

    def _until(self, aim: float) -> float:
        """The way to a factor."""
        rate, left = self.rising, aim / self.unit - float(self.here.y[-1])
        return left / rate if rate * left > 0.0 else np.inf

    def _tried(self, aim: float) -> CurveStep:
        """A step of the present length, or to what comes first."""
        start, tangent = self.here.y, self.here.tangent
        ways, ends = self._ends()
        first, until, safe = float(np.min(ways, initial=np.inf)), self._until(aim), self._safe()
        way = min(first, until, safe)
        self._size = way * magnitude(tangent)
        # what ends with the factor at its aim goes on from there, if at all
        if until <= way * (1.0 + 0.1 * DEFAULT.reached):
            way = until
            outcome, point, condition = StepEnd.FACTOR, None, self.at_factor(aim)
        elif way == first:
            point = int(np.argmin(ways))
            if way == 0.0:
                return self._in_place(point)
            outcome, condition = StepEnd.END, self.at_end(point, float(ends[point]))
        else:
            outcome, point, condition = StepEnd.STEP, None, self.plane(way)
        predicted = start + way * tangent
        y = self.correct(predicted, condition)
        self._refuse_far(predicted, y, way)
        return self._checked(self._earliest(self._moved(outcome, point, y), aim), way)

    def _safe(self) -> float:
        """The longest way that is safe."""
        largest = magnitude(self.here.tangent)
        if not self.points.bent:
            return np.inf
        rates = np.abs(self.directions)
        reach = np.min(self.points.reach(self.here.values) / np.maximum(rates, 1e-300), initial=np.inf)
        return float(min(self.length / largest, reach))

    def _refuse_far(self, predicted: Array, y: Array, way: float) -> None:
        """Refuse a step whose corrector went far beside its length; else adapt the length of the next one."""
        if not self.points.bent:
            return
        off = magnitude(y - predicted)
        size = way * magnitude(self.here.tangent)
        if off > 0.3 * size + 1e-12 * magnitude(y):
            raise Refused
        grown = min(4.0, np.sqrt(0.05 * size / off)) if off > 0.0 else 4.0
        self._next = max(size, self.length if grown > 1.0 else 0.0) * max(grown, 0.3)

    @override
    def position(self, leg: int) -> Position:
        tangent = self.here.tangent
        driver = int(np.argmax(np.abs(tangent)))
        return Position(
            leg=leg,
            numbers=self.points.numbers.copy(),
            driver=driver,
            heading=1 if tangent[driver] > 0.0 else -1,
            z=self.z.copy(),
            step=self.length,
        )

    @override
    def resume(self, position: Position) -> None:
        self.head(np.eye(1, len(self.here.y), position.driver)[0], position.heading)
        self.watch_folds()
        self.length = position.step

    @override
    def set_out(self, sign: float) -> None:
        self.head_with_load(sign)
        Crossing(self).run()

    @override
    def watch_folds(self) -> None:
        self.trend = int(np.sign(self.rising)) or self.trend
        # points pass their ends a little before or after them: that leaves rounding
        with suppress(Refused, np.linalg.LinAlgError):
            y = np.append(self.correct(self.here.y, self.plane(0.0))[:-1], self.here.y[-1])
            self.here = self._at_place(y, self.here.tangent, self.points.values(y[:-1]))

    @override
    def pass_on(self, move: Move) -> list[Passage]:
        return Crossing(self).run(move)

    @override
    def note(self, move: Move) -> None:
        if move.outcome is StepEnd.FOLD:
            self.trend = -self.trend
            self.unstable = self._beyond(move)
            return
        if move.outcome in (StepEnd.END, StepEnd.TURNED):
            self.watch_folds()
        self.unstable = self.points.unstable_directions(self.here.values)

    def _beyond(self, move: Move) -> int:
        """The number of unstable directions after a fold: vᵀH v = λ' f1ᵀv along the curve changes its sign there."""
        assert isinstance(move, CurveStep)
        held = self.trend * float(self._rate @ displacement_rate(self.points, move.before))
        return max(self.unstable + (1 if held < 0.0 else -1), 0)

    @override
    def must_leave(self, aim: float) -> bool:
        """Unstable, or away from the factor: a bond that turns back makes the path stable, and turn."""
        return self.unstable > 0 or (aim - self.factor) * self.trend < 0.0

    @override
    def leaving(self) -> Iterator[tuple[Array, int]]:
        drops, motion, groups = self.points.on_drops(), self.motion, self.points.unknowns
        free = self.points.motions(self.here.values)
        if drops:
            found = [self._after_drops(drops, free), motion]
        else:
            lowest = free.ways.T @ np.linalg.eigh(free.matrix)[1][:, 0] if len(free.slopes) else np.zeros_like(motion)
            lowest *= np.sign(float(lowest @ motion)) or 1.0
            found = [lowest, motion, -lowest]
        for one in found:
            for k in drops or [int(np.argmax([magnitude(one[group]) for group in groups]))]:
                yield one, k

    def _after_drops(self, drops: list[int], free: FreeMotions) -> Array:
        """How a body moves when points on drops go on: these outwards, all others follow."""
        found, directions = np.zeros_like(self.z), self.directions
        for k in drops:
            found += (np.sign(directions[k]) or 1.0) * self.row(k, self.here.y)[:-1]
        return found - free.ways.T @ np.linalg.lstsq(free.matrix, free.ways @ (self.points.stiffness @ found))[0]

    @property
    @override
    def motion(self) -> Array:
        return displacement_rate(self.points, self.here)

    @override
    def balanced(self, factor: float) -> Array:
        return self.correct(self.here.y, self.at_factor(factor))[:-1]

    def _turns_back(self, after: CurvePoint) -> bool:
        """Whether the tangent there leads back in units of the laws: a long spring beside them hides a fold."""
        units = self.points.reach(after.values)
        rates = self.rates_at(after)
        return float(((after.values.s - self.here.values.s) / units) @ (rates / units)) < 0.0

    def _checked(self, move: CurveStep, way: float) -> CurveStep:
        """The step, if it did not leave the curve."""
        if not self.points.bent:
            return move
        turns = float(self.here.tangent @ move.after.tangent) < DEFAULT.least_turn or self._turns_back(move.after)
        if way >= 1e-7 and turns:
            raise Refused
        self.length = self._next
        return self._with_between(move) if self.divides else move


def branch_from(
    points: ContactPoints,
    constant: Array,
    rate: Array,
    z: Array,
    factor: float,
    inverse: CellInverse | None = None,
) -> Branch:
    """The branch from a state on: exactly from event to event, or by predictor and corrector where graphs are curved.

    Args:
        points: where all points are; changed.
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        z: their coordinates, (n,).
        factor: λ.
        inverse: of the straight equations, where it is known.
    """
    if points.straight:
        branch = StraightBranch(points, constant, rate, z, factor)
        branch.start(inverse)
        return branch
    return CurvedBranch(points, constant, rate, z, factor)
