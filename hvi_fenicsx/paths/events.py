"""What happens first within a step of a curve: a point passes an end of its segment, turns back, or the factor turns.

Newton's method goes to the first event that a step has passed, with the condition of that event; where a rate is zero,
its root is found along the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import toms748

from ..typing import Array
from .branch import Move, Refused, StepEnd
from .equations import CurveEquations, CurvePoint
from .relations import ContactPoints

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, kw_only=True)
class CurveStep(Move):
    """A step along a curve.

    Attributes:
        before: where it began.
        after: where it ended.
    """

    before: CurvePoint
    after: CurvePoint

    @property
    def size(self) -> float:
        """How far the fastest coordinate went."""
        return float(np.max(np.abs(self.after.y - self.before.y)))


def displacement_rate(points: ContactPoints, place: CurvePoint) -> Array:
    """How the displacements change along the tangent at a place of the present segments, (n,).

    Args:
        points: the points.
        place: the place.
    """
    return points.moved(place.values) @ place.tangent[:-1]


def driven_work(arc: CurveStep, points: ContactPoints, rate: Array, unit: float) -> float:
    """∫ f1ᵀx dλ along a step, both as cubic polynomials of the arc length.

    Args:
        arc: the step.
        points: the points.
        rate: f1, (n,).
        unit: of the factor.
    """
    length, ends, places = float(np.linalg.norm(arc.after.y - arc.before.y)), [0.0, 1.0], (arc.before, arc.after)
    rates = [length * float(rate @ displacement_rate(points, place)) for place in places]
    driven = CubicHermiteSpline(ends, [float(rate @ place.values.x) for place in places], rates)
    factors = [unit * float(place.y[-1]) for place in places]
    slopes = [unit * length * float(place.tangent[-1]) for place in places]
    t = 0.5 * (1.0 + _NODES)
    return float(0.5 * _WEIGHTS @ (driven(t) * CubicHermiteSpline(ends, factors, slopes)(t, nu=1)))


class Events(CurveEquations):
    """The equations of a curve, and the events within a step from the present point."""

    def _after(self, y: Array) -> CurvePoint:
        values, tangent = self.points.values(y[:-1]), self.here.tangent
        return self._at_place(y, self.tangent(values, tangent) if self.points.bent else tangent, values)

    def _earliest(self, move: CurveStep, aim: float) -> CurveStep:
        """The step up to the first event that it has passed."""
        for _ in range(20):
            found = self._passed(move, aim)
            if found is None:
                return move
            move = found
        raise Refused

    def _passed(self, move: CurveStep, aim: float) -> CurveStep | None:
        """A shorter step, to an event that was passed; None: there is none."""
        start, y = self.here, move.after.y
        shares = self._shares(move)
        rest = y[-1] - aim / self.unit
        over = rest * (start.y[-1] - aim / self.unit) < 0.0 and move.outcome is not StepEnd.FACTOR
        beyond = abs(rest) / abs(y[-1] - start.y[-1]) if over and abs(rest) > self.limits.reached else 0.0
        point = int(np.argmin(shares)) if shares.size else 0
        if over and abs(rest) > 1e-13 * (1.0 + abs(y[-1])) and 1.0 - beyond <= float(np.min(shares, initial=1.0)):
            guess = start.y + (1.0 - beyond) * (y - start.y)
            return self._moved(StepEnd.FACTOR, None, self.correct(guess, self.at_factor(aim)))
        if shares.size and shares[point] < 1.0:
            if shares[point] == 0.0:
                return self._back_at(move, point)
            high = move.after.values.s[point] > self.points.high[point]
            end = float((self.points.high if high else self.points.low)[point])
            guess = start.y + shares[point] * (y - start.y)
            return self._moved(StepEnd.END, point, self.correct(guess, self.at_end(point, end)))
        return self._returning(move, aim) or self._turning(move)

    def _shares(self, move: CurveStep) -> Array:
        """The part of the step after which each point passed an end; 1 where it did not, (m,)."""
        points, s0, s1 = self.points, move.before.values.s, move.after.values.s
        found, way = np.ones(len(points)), np.where(s1 != s0, s1 - s0, 1.0)
        allowed = points.allowances(move.after.values, s1 - s0, move.size)
        above, below = s1 > np.maximum(points.high + allowed, s0), s1 < np.minimum(points.low - allowed, s0)
        for ends, beyond in ((points.high, above), (points.low, below)):
            found[beyond] = np.clip((ends[beyond] - s0[beyond]) / way[beyond], 0.0, 1.0 - 1e-12)
        return found

    def _moved(self, outcome: StepEnd, point: int | None, y: Array) -> CurveStep:
        if float(self.here.tangent @ (y - self.here.y)) < -self.limits.reached:
            raise Refused
        move = CurveStep(outcome=outcome, point=point, before=self.here, after=self._after(y))
        if outcome is StepEnd.END and not self._arrives(move):
            raise Refused
        return move

    def _back_at(self, move: CurveStep, point: int) -> CurveStep:
        """Where a point passes the end at which it began: a bond that set out from it turned back on the way.

        Raises:
            Refused: it went inwards first, and came back within the step.
        """
        rate = self._rate_of(StepEnd.TURNED, point)(self.here)
        beyond = move.after.values.s[point] - move.before.values.s[point]
        largest = float(np.max(np.abs(self.here.tangent)))
        if rate * beyond < 0.0 and abs(rate) > self.limits.undecided * largest and not self.points.outward[point]:
            raise Refused
        sets_out = rate * self.points.outward[point] > 0.0
        turned = self._up_to(move, StepEnd.TURNED, point) if sets_out else None
        if turned is not None and turned.after.y is move.after.y:
            raise Refused  # it turns no earlier, and is beyond its end
        return turned or self._in_place(point)

    def _in_place(self, point: int) -> CurveStep:
        """No step: a slower point passed its end by what rounding allows, and goes on from there."""
        return CurveStep(outcome=StepEnd.END, point=point, before=self.here, after=self.here)

    def _arrives(self, move: CurveStep) -> bool:
        """Whether the point at an end of its segment goes outwards there, and does not come back to it."""
        k, after = move.point, move.after
        rate = float(self.rates_at(after)[k])
        middle_up = after.values.s[k] - self.points.low[k] > self.points.high[k] - after.values.s[k]
        return bool(rate > 0.0) == bool(middle_up)

    def _returning(self, move: CurveStep, aim: float) -> CurveStep | None:
        """The step up to where the factor is back at its aim, from which it set out; None: it is not."""
        began = self.here.y[-1] == aim / self.unit and move.outcome is not StepEnd.FACTOR
        back = (move.after.y[-1] - self.here.y[-1]) * self.here.tangent[-1] < 0.0
        return self._up_to(move, StepEnd.FACTOR, None) if began and back else None

    def _turning(self, move: CurveStep) -> CurveStep | None:
        """The step up to where the factor, or a bond with memory, turned on the way; None: none did."""
        if not self.points.bent or move.outcome in (StepEnd.FOLD, StepEnd.TURNED):
            return None
        turned = self._turned(move.after)
        return None if turned is None else self._up_to(move, *turned)

    def _up_to(self, move: CurveStep, outcome: StepEnd, point: int | None) -> CurveStep | None:
        """The step up to where a rate of the factor, now or in the mean, or of a point is 0; None: it is too short."""
        whole = float(self.here.tangent @ (move.after.y - self.here.y))
        if whole <= self.limits.standing:
            return None
        rate = self._rate_of(outcome, point)
        if rate(self.here) * rate(move.after) >= 0.0:
            return self._moved(outcome, point, move.after.y)
        known = {0.0: self.here, whole: move.after}  # corrected anew, their rates may have other signs by rounding

        def rate_at(way: float) -> float:
            if way not in known:
                known[way] = self._at(way, known)
            found = rate(known[way])
            return found if abs(found) > self.limits.standing * float(np.max(np.abs(known[way].tangent))) else 0.0

        root = toms748(rate_at, 0.0, whole, xtol=1e-13 * whole, rtol=1e-13, k=1)
        rate_at(root)
        return self._moved(outcome, point, known[root].y)

    def _turned(self, after: CurvePoint) -> tuple[StepEnd, int | None] | None:
        largest = float(np.max(np.abs(after.tangent)))
        if self.trend * after.tangent[-1] < -self.limits.undecided * largest:
            return StepEnd.FOLD, None
        rates = self.rates_at(after)
        clear = np.abs(rates) > self.limits.undecided * largest
        back = np.flatnonzero(self.points.turning_back(after.values, rates) & clear)
        return (StepEnd.TURNED, int(back[0])) if back.size else None

    def _rate_of(self, outcome: StepEnd, point: int | None) -> Callable[[CurvePoint], float]:
        if outcome is StepEnd.FACTOR:
            return self._mean_rate
        if outcome is StepEnd.FOLD or point is None:
            return lambda place: float(place.tangent[-1])
        return lambda place: float(self.rates_at(place)[point])

    def _mean_rate(self, place: CurvePoint) -> float:
        """How the factor changes on the way from here to a place of the same step."""
        way = float(self.here.tangent @ (place.y - self.here.y))
        return float((place.y[-1] - self.here.y[-1]) / way if way > 0.0 else self.here.tangent[-1])

    def _at(self, way: float, known: Mapping[float, CurvePoint]) -> CurvePoint:
        """The point of the curve in the plane across the present tangent at a distance, between those known."""
        low, high = max(w for w in known if w < way), min(w for w in known if w > way)
        share = (way - low) / (high - low)
        guess = (1.0 - share) * known[low].y + share * known[high].y
        return self._after(self.correct(guess, self.plane(way)))
