"""What happens first within a step of a curve: a point passes an end of its segment, turns back, or the factor turns.

Newton's method goes to the first event that a step has passed, with the condition of that event; where a rate is zero,
its root is found along the step.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import toms748

from ..typing import Array, magnitude
from .branch import Move, Passage, Refused, StepEnd, event_between
from .contact_points import ContactPoints
from .equations import CurveEquations, CurvePoint
from .segments import piece_at
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class CurveStep(Move):
    """A step along a curve.

    Attributes:
        before: where it began.
        after: where it ended.
        between: points on the way, where the work of the step is asked for.
    """

    before: CurvePoint
    after: CurvePoint
    between: tuple[CurvePoint, ...] = ()

    @property
    def size(self) -> float:
        """How far the fastest coordinate went."""
        return magnitude(self.after.y - self.before.y)


def displacement_rate(points: ContactPoints, place: CurvePoint) -> Array:
    """How the displacements change along the tangent at a place of the present segments, (n,).

    Args:
        points: the points.
        place: the place.
    """
    return points.moved(place.values) @ place.tangent[:-1]


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
        beyond = abs(rest) / abs(y[-1] - start.y[-1]) if over and abs(rest) > DEFAULT.reached else 0.0
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
        return self._turning(move)

    def _shares(self, move: CurveStep) -> Array:
        """The part of the step after which each point passed an end; 1 where it did not, (m,)."""
        points, s0, s1 = self.points, move.before.values.s, move.after.values.s
        found, way = np.ones(len(points)), np.where(s1 != s0, s1 - s0, 1.0)
        allowed = points.allowances(move.after.values, s1 - s0, move.size)
        allowed[self.stood & (np.abs(s1 - s0) <= DEFAULT.undecided * move.size)] = np.inf
        above, below = s1 > np.maximum(points.high + allowed, s0), s1 < np.minimum(points.low - allowed, s0)
        for ends, beyond in ((points.high, above), (points.low, below)):
            found[beyond] = np.clip((ends[beyond] - s0[beyond]) / way[beyond], 0.0, 1.0 - 1e-12)
        return found

    def _moved(self, outcome: StepEnd, point: int | None, y: Array) -> CurveStep:
        if float(self.here.tangent @ (y - self.here.y)) < -DEFAULT.reached:
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
        rate = self._rate_of(point)(self.here)
        beyond = move.after.values.s[point] - move.before.values.s[point]
        largest = magnitude(self.here.tangent)
        if rate * beyond < 0.0 and abs(rate) > DEFAULT.undecided * largest and not self.points.outward[point]:
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

    def _turning(self, move: CurveStep) -> CurveStep | None:
        """The step up to where the factor, or a bond with memory, turned on the way; None: none did."""
        if not self.points.bent or move.outcome in (StepEnd.FOLD, StepEnd.TURNED):
            return None
        turned = self._turned(move.after)
        return None if turned is None else self._up_to(move, *turned)

    def _up_to(self, move: CurveStep, outcome: StepEnd, point: int | None) -> CurveStep | None:
        """The step up to where a rate of the factor, now or in the mean, or of a point is 0; None: it is too short."""
        whole = float(self.here.tangent @ (move.after.y - self.here.y))
        if whole <= DEFAULT.standing:
            return None
        rate = self._rate_of(point)
        if rate(self.here) * rate(move.after) >= 0.0:
            return self._moved(outcome, point, move.after.y)
        known = {0.0: self.here, whole: move.after}  # corrected anew, their rates may have other signs by rounding

        def rate_at(way: float) -> float:
            if way not in known:
                known[way] = self._at(way, known)
            found = rate(known[way])
            return found if abs(found) > DEFAULT.standing * magnitude(known[way].tangent) else 0.0

        root = toms748(rate_at, 0.0, whole, xtol=1e-13 * whole, rtol=1e-13, k=1)
        rate_at(root)
        return self._moved(outcome, point, known[root].y)

    def _with_between(self, move: CurveStep) -> CurveStep:
        """The step with so many points between that it is a cubic polynomial from each to the next."""
        whole = float(self.here.tangent @ (move.after.y - self.here.y))
        known = {0.0: move.before, whole: move.after}
        if whole > DEFAULT.standing:
            self._divide(known, 0.0, whole)
        return replace(move, between=tuple(known[way] for way in sorted(known)[1:-1]))

    def _divide(self, known: dict[float, CurvePoint], low: float, high: float) -> None:
        """Halve a part of a step until cubic polynomials meet its middle."""
        middle, ends = 0.5 * (low + high), [known[low], known[high]]
        (y0, y1), (t0, t1) = [e.y for e in ends], [e.tangent / (self.here.tangent @ e.tangent) for e in ends]
        known[middle] = self._at(middle, known)
        off = magnitude(0.5 * (y0 + y1) + 0.125 * (high - low) * (t0 - t1) - known[middle].y)
        if off > DEFAULT.slow * magnitude(y1 - y0) and high - low > DEFAULT.small * max(known):
            self._divide(known, low, middle)
            self._divide(known, middle, high)

    def _turned(self, after: CurvePoint) -> tuple[StepEnd, int | None] | None:
        largest = magnitude(after.tangent)
        if self.trend * after.tangent[-1] < -DEFAULT.undecided * largest:
            return StepEnd.FOLD, None
        rates = self.rates_at(after)
        clear = np.abs(rates) > DEFAULT.undecided * largest
        back = np.flatnonzero(self.points.turning_back(after.values, rates) & clear)
        return (StepEnd.TURNED, int(back[0])) if back.size else None

    def _rate_of(self, point: int | None) -> Callable[[CurvePoint], float]:
        if point is None:
            return lambda place: float(place.tangent[-1])
        return lambda place: float(self.rates_at(place)[point])

    def _at(self, way: float, known: Mapping[float, CurvePoint]) -> CurvePoint:
        """The point of the curve in the plane across the present tangent at a distance, between those known."""
        low, high = max(w for w in known if w < way), min(w for w in known if w > way)
        share = (way - low) / (high - low)
        guess = (1.0 - share) * known[low].y + share * known[high].y
        return self._after(self.correct(guess, self.plane(way)))


class Crossing:
    """The passages at the present point of a curve, where points go on from one segment to the next.

    At such a point the equations are piecewise linear to first order. Where several points are at ends of their
    segments, the load is imagined to be perturbed by ε q with ε infinitesimal: each then comes to its end at a way
    of its own of the order ε, one after the other, until the curve leads away from all ends (as on straight
    segments, :mod:`.pivoting`). The point that passes goes on along its graph, and that gives the direction in
    which the curve goes on. The order of the points comes from where they are, so that it is the same on any number
    of ranks.

    Args:
        curve: the curve; its direction and its points' statuses are changed.
    """

    def __init__(self, curve: CurveEquations) -> None:
        self._curve, self._points = curve, curve.points
        self._lag = self._points.order  # the ways, of the order ε, of the points to their ends
        self._left: Array = self._lag.copy()
        self._cells: Counter[tuple[bytes, frozenset[int]]] = Counter()
        self._turned: set[int] = set()
        self._rests = np.zeros(len(self._lag), dtype=bool)
        self._arrived: int | None = None
        self.passages: list[Passage] = []

    def run(self, move: Move | None = None) -> list[Passage]:
        """Let all points pass that have to, the one that arrived first.

        Args:
            move: the step that took a point to its end, or in which it turned back.

        Raises:
            Refused: there is no end of passing.
        """
        try:
            return self._passed(move)
        except np.linalg.LinAlgError:
            raise Refused from None

    def _passed(self, move: Move | None) -> list[Passage]:
        if move is not None and move.point is not None:
            self._pass_arrived(move.point, turned=move.outcome is StepEnd.TURNED)
        for _ in range(DEFAULT.waits * (2 + len(self._points))):
            self._points.check()
            rates = self._rates()
            k = self._next(rates)
            if k is None:
                self._curve.stood = self._rests
                return self.passages
            self._pass(k, rates)
            self._count()
        raise Refused

    def _pass_arrived(self, k: int, *, turned: bool) -> None:
        """Let the point pass that is at its end already, or that turned back."""
        self._left[k], self._arrived = 0.0, k
        rates = self._rates()
        rates[k] = -1e-9 * self._points.outward[k] if turned else self._outwards(k)
        self._pass(k, rates)

    def _count(self) -> None:
        """Count the cells that the passages come to.

        Raises:
            Refused: they go round.
        """
        cell = self._points.numbers.tobytes(), frozenset(self._turned)
        self._cells[cell] += 1
        if self._cells[cell] > DEFAULT.corrections:
            raise Refused

    def _outwards(self, k: int) -> float:
        """The rate of a point that is at an end of its segment, out of it."""
        points, s = self._points, float(self._curve.here.values.s[k])
        rate = abs(float(self._curve.directions[k])) or np.finfo(float).tiny
        return rate if points.high[k] - s < s - points.low[k] else -rate

    def _rates(self) -> Array:
        """How fast the points go; 0 for those that stand but for rounding, (m,): a slow one that goes to and fro does.

        So does the one that arrived where its rate may have either sign: it was the step that took it out.
        """
        rates, allowed = self._curve.directions.copy(), np.full(len(self._points), DEFAULT.standing)
        if self._arrived is not None and self._points.bent:
            allowed[self._arrived] = DEFAULT.undecided
        rates[np.abs(rates) <= allowed * magnitude(self._curve.here.tangent)] = 0.0
        rates[self._rests] = 0.0
        return rates

    def _next(self, rates: Array) -> int | None:
        """The point that comes to its end first on a way of the order ε, or turns back; all go there. None: none does.

        Args:
            rates: how fast the points go, (m,).
        """
        points, values, speeds = self._points, self._curve.here.values, np.abs(rates)
        allowed = points.allowances(values, rates, magnitude(self._curve.here.tangent))
        low, high = values.s <= points.low + allowed, values.s >= points.high - allowed
        comes = ((rates < 0.0) & low) | ((rates > 0.0) & high) | points.turning_back(values, rates)
        if not np.any(comes):
            return None
        ways = np.divide(self._left, speeds, out=np.full(len(comes), np.inf), where=comes)
        k = int(np.argmin(ways))
        change, loads = ways[k] * speeds, rates * points.outward > 0.0
        self._left = np.where(comes, self._left - change, self._left + np.where(low | high, change, 0.0))
        self._left = np.where(loads & ~comes, self._lag, np.maximum(self._left, 0.0))
        self._left[k] = 0.0
        return k

    def _pass(self, k: int, rates: Array) -> None:
        """Into the next segment, and on in the same direction along the graph."""
        points, curve, before = self._points, self._curve, self._points.segment(k)
        forward, slow = bool(rates[k] > 0.0), self._is_slow(k)
        y = curve.here.y
        if forward * 2.0 - 1.0 == -points.outward[k] and not points.unmoved(curve.here.values)[k]:
            y = self._turned_back(k, forward=forward)
        else:
            points.enter_next(k, forward=forward)
        as_before = curve.place(y, curve.here.tangent, passed=k) and not slow
        curve.head(curve.row(k, y) if as_before else curve.here.tangent, 1.0 if forward or not as_before else -1.0)
        self._rests[k] = slow and any(point == k for point, _ in self.passages)
        self.passages.append((k, event_between(before, points.segment(k))))

    def _is_slow(self, k: int) -> bool:
        """Whether a point stands but for rounding: beside all others neither it nor its force moves.

        On a steep segment the force changes fast where the displacement hardly does.
        """
        values, stiffest = self._curve.here.values, float(np.max(np.diag(self._points.stiffness)))
        forces = (stiffest * np.abs(values.moves) + np.abs(values.rises)) * np.abs(self._curve.directions)
        return bool(forces[k] <= DEFAULT.slow * np.max(forces))

    def _turned_back(self, k: int, *, forward: bool) -> Array:
        """Coordinates and factor on the secant of where the bonds have been, (n + 1,)."""
        points, curve, values = self._points, self._curve, self._curve.here.values
        x, force = float(values.lengths[k]), float(values.tractions[k])
        points.remember(k, x, force)
        self._turned.add(k)
        points.enter(k, piece_at(points.chain(k), x, DEFAULT.standing, forward=forward))
        y = curve.here.y.copy()
        points.set(y, k, points.coordinate(k, x, force))
        return y
