"""A curve of equilibria, followed by predictor and corrector with arc length as its parameter.

The predictor goes along the tangent of the equations in coordinates and factor; the corrector is Newton's method in the
plane across it (Riks 1979; Wempner 1971), or with the condition of an event instead of the plane: that a coordinate is
at the end of its segment, or that the factor has a wanted value. The equations of one cell are smooth (:mod:`.sites`),
so Newton's method is semismooth across cells and converges quadratically within one. A step is refused and halved where
the corrector does not converge or goes far, where the tangent turns by more than some degrees, or where the work along
it is not what the energies say.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.optimize import brentq

from ...typing import Array
from .equations import ROUNDING, STANDING, UNDECIDED, Equations, Place, Refused
from .sites import Sites

_LARGEST_TURN = 0.9
"""Least cosine of the angle between the tangents at both ends of a step."""
_LEAST = 1e-11
"""The shortest step."""
_FAR = 1e4
"""A displacement that is infinite, in units of those where the body was."""


class Outcome(Enum):
    """What ended a step."""

    STEP = "nothing"
    END = "a site reached the end of its segment"
    TURNED = "a bond with memory turned back"
    FOLD = "the factor turned"
    FACTOR = "the factor reached its aim"
    AWAY = "nothing ends the curve"
    STUCK = "no step is short enough"


@dataclass(frozen=True, kw_only=True)
class Move:
    """A step.

    Attributes:
        outcome: what ended it.
        site: which site, where one did.
        before: where it began.
        after: where it ended.
    """

    outcome: Outcome
    site: int | None = None
    before: Place
    after: Place


class Curve(Equations):
    """The curve from one of its points on.

    Args:
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        sites: where all sites are; changed.
        z: their coordinates, (n,).
        factor: λ.
        fineness: of the steps; 0.1 for a tenth of their length.

    Attributes:
        length: of the next step.
        disagreement: of the work along a step with the energies, 1 where it is as large as is allowed.
        trend: the sign of the factor's rate since the last fold.
    """

    def __init__(
        self, constant: Array, rate: Array, sites: Sites, z: Array, factor: float, fineness: float = 1.0
    ) -> None:
        super().__init__(constant, rate, sites, z, factor)
        self._fineness, self.length, self.trend = fineness, 0.1 * fineness, 0
        self._next = self.length
        self.disagreement: Callable[[Move], float] = lambda move: 0.0
        self._size = self._extent()

    def _extent(self) -> float:
        values = self.here.values
        ends = np.concatenate([self.sites.low, self.sites.high, values.s])
        return float(np.max(np.abs(ends[np.isfinite(ends)]), initial=1.0))

    def advance(self, aim: float) -> Move:
        """One step: to the first event, or as far as is safe.

        Args:
            aim: the factor at which to stop.
        """
        if self._goes_on_for_ever(aim):
            return Move(outcome=Outcome.AWAY, before=self.here, after=self.here)
        while self.length > _LEAST:
            try:
                move = self._tried(aim)
            except (Refused, np.linalg.LinAlgError):
                self.length *= 0.5
                continue
            self.here = move.after
            if move.outcome is Outcome.FACTOR:
                self.here.y[-1] = aim / self.unit
            return move
        return Move(outcome=Outcome.STUCK, before=self.here, after=self.here)

    def _goes_on_for_ever(self, aim: float) -> bool:
        """Whether nothing ends the curve."""
        distances, _ = self._ends()
        nearest = min(float(np.min(distances, initial=np.inf)), self._until(aim))
        if not self.sites.bent:
            return not np.isfinite(nearest)
        if self.factor_rate == 0.0 and nearest > _FAR * self._size and self._is_straight(_FAR * self._size):
            return True
        return not np.isfinite(nearest) and bool(np.max(np.abs(self.here.values.s), initial=0.0) > _FAR * self._size)

    def _is_straight(self, way: float) -> bool:
        """Whether the equations stay satisfied so far along the tangent: a body slides on, and no force changes."""
        y = self.here.y + way * self.here.tangent
        load = self.sites.stiffness @ self.here.values.x + self.here.values.force
        size = 1.0 + float(np.max(np.abs(load / self.sites.forces), initial=0.0))
        allowed = 1e-9 * size + 4.0 * np.finfo(float).eps * way
        return bool(np.max(np.abs(self.residual(y, self.sites.values(y[:-1])))) <= allowed)

    def _ends(self) -> tuple[Array, Array]:
        """Along the tangent, the ways of all sites to the ends of their segments, and these ends, (m,) each."""
        sites, s = self.sites, self.here.values.s
        rates = self.sites.rates(self.here.y[:-1], self.here.tangent[:-1])
        largest = float(np.max(np.abs(self.here.tangent)))
        ends = np.where(rates > 0.0, sites.high, sites.low)
        there = np.abs(ends - s) <= ROUNDING * (1.0 + np.abs(s))
        moves = np.abs(rates) > np.where(there & sites.bent, UNDECIDED, STANDING) * largest
        found = np.full(len(sites), np.inf)
        found[moves] = np.maximum((ends - s)[moves] / rates[moves], 0.0)
        return found, ends

    def _until(self, aim: float) -> float:
        """The way to a factor."""
        rate, left = self.factor_rate, aim / self.unit - float(self.here.y[-1])
        return left / rate if rate * left > 0.0 else np.inf

    def _tried(self, aim: float) -> Move:
        """A step of the present length, or to what comes first."""
        start, tangent = self.here.y, self.here.tangent
        ways, ends = self._ends()
        first, until, safe = float(np.min(ways, initial=np.inf)), self._until(aim), self._safe()
        way = min(first, until, safe)
        if until <= way * (1.0 + 0.1 * ROUNDING):  # what ends with the factor at its aim goes on from there, if at all
            way = until
            outcome, site, condition = Outcome.FACTOR, None, self.at_factor(aim)
        elif way == first:
            site = int(np.argmin(ways))
            if way == 0.0:
                return self._in_place(site)
            outcome, condition = Outcome.END, self.at_end(site, float(ends[site]))
        else:
            outcome, site, condition = Outcome.STEP, None, self.plane(way)
        predicted = start + way * tangent
        y = self.correct(predicted, condition)
        self._refuse_far(predicted, y, way)
        return self._checked(self._earliest(self._moved(outcome, site, y), aim), way)

    def _safe(self) -> float:
        """The longest way that is safe."""
        largest = float(np.max(np.abs(self.here.tangent)))
        if not self.sites.bent:
            return np.inf
        rates = np.abs(self.sites.rates(self.here.y[:-1], self.here.tangent[:-1]))
        allowed = self._fineness * self.sites.reach(self.here.values)
        reach = np.min(allowed / np.maximum(rates, 1e-300), initial=np.inf)
        return float(min(self.length / largest, reach))

    def _refuse_far(self, predicted: Array, y: Array, way: float) -> None:
        """Refuse a step whose corrector went far beside its length; else adapt the length of the next one."""
        if not self.sites.bent:
            return
        off = float(np.max(np.abs(y - predicted)))
        size = way * float(np.max(np.abs(self.here.tangent)))
        if off > 0.3 * size + 1e-12 * float(np.max(np.abs(y))):
            raise Refused
        wanted = 0.05 * self._fineness
        grown = min(4.0, np.sqrt(wanted * size / off)) if off > 0.0 else 4.0
        self._next = max(size, self.length if grown > 1.0 else 0.0) * max(grown, 0.3)

    def _after(self, y: Array) -> Place:
        values, tangent = self.sites.values(y[:-1]), self.here.tangent
        return self._at_place(y, self.tangent(values, tangent) if self.sites.bent else tangent, values)

    def _earliest(self, move: Move, aim: float) -> Move:
        """The step up to the first event that it has passed."""
        for _ in range(20):
            found = self._passed(move, aim)
            if found is None:
                return move
            move = found
        raise Refused

    def _passed(self, move: Move, aim: float) -> Move | None:
        """A shorter step, to an event that was passed; None: there is none."""
        start, y = self.here, move.after.y
        shares = self._shares(move)
        rest = y[-1] - aim / self.unit
        over = rest * (start.y[-1] - aim / self.unit) < 0.0 and move.outcome is not Outcome.FACTOR
        beyond = abs(rest) / abs(y[-1] - start.y[-1]) if over and abs(rest) > ROUNDING else 0.0
        site = int(np.argmin(shares)) if shares.size else 0
        if over and abs(rest) > 1e-13 * (1.0 + abs(y[-1])) and 1.0 - beyond <= float(np.min(shares, initial=1.0)):
            guess = start.y + (1.0 - beyond) * (y - start.y)
            return self._moved(Outcome.FACTOR, None, self.correct(guess, self.at_factor(aim)))
        if shares.size and shares[site] < 1.0:
            if shares[site] == 0.0:
                return self._back_at(move, site)
            high = move.after.values.s[site] > self.sites.high[site]
            end = float((self.sites.high if high else self.sites.low)[site])
            guess = start.y + shares[site] * (y - start.y)
            return self._moved(Outcome.END, site, self.correct(guess, self.at_end(site, end)))
        return self._turning(move)

    def _shares(self, move: Move) -> Array:
        """The part of the step after which each site passed an end; 1 where it did not, (m,)."""
        sites, s0, s1 = self.sites, move.before.values.s, move.after.values.s
        found, way = np.ones(len(sites)), np.where(s1 != s0, s1 - s0, 1.0)
        allowed = ROUNDING * (1.0 + np.abs(s1))
        above, below = s1 > np.maximum(sites.high + allowed, s0), s1 < np.minimum(sites.low - allowed, s0)
        for ends, beyond in ((sites.high, above), (sites.low, below)):
            found[beyond] = np.clip((ends[beyond] - s0[beyond]) / way[beyond], 0.0, 1.0 - 1e-12)
        return found

    def _moved(self, outcome: Outcome, site: int | None, y: Array) -> Move:
        if float(self.here.tangent @ (y - self.here.y)) < -ROUNDING:
            raise Refused
        move = Move(outcome=outcome, site=site, before=self.here, after=self._after(y))
        if outcome is Outcome.END and not self._arrives(move):
            raise Refused
        return move

    def settle(self) -> None:
        """Take out what rounding has left in the equations: sites pass their ends a little before or after them."""
        with suppress(Refused):
            self._settle_at(self.correct(self.here.y, self.plane(0.0)))

    def settle_at_factor(self) -> None:
        """The same with the factor as it is."""
        with suppress(Refused):
            y = self.correct(self.here.y, self.at_factor(self.factor))
            self._settle_at(np.append(y[:-1], self.here.y[-1]))

    def _settle_at(self, y: Array) -> None:
        self.here = self._at_place(y, self.here.tangent, self.sites.values(y[:-1]))

    def _back_at(self, move: Move, site: int) -> Move:
        """Where a site passes the end at which it began: a bond that set out from it turned back on the way."""
        sets_out = self._rate_of(Outcome.TURNED, site)(self.here) * self.sites.outward[site] > 0.0
        turned = self._up_to(move, Outcome.TURNED, site) if sets_out else None
        return turned or self._in_place(site)

    def _in_place(self, site: int) -> Move:
        """No step: a site that is slower than others passed its end by what rounding allows, and goes on from there."""
        return Move(outcome=Outcome.END, site=site, before=self.here, after=self.here)

    def _arrives(self, move: Move) -> bool:
        """Whether the site at an end of its segment goes outwards there, and does not come back to it."""
        k, after = move.site, move.after
        rate = float(self.sites.rates(after.y[:-1], after.tangent[:-1])[k])
        middle_up = after.values.s[k] - self.sites.low[k] > self.sites.high[k] - after.values.s[k]
        return bool(rate > 0.0) == bool(middle_up)

    def _turning(self, move: Move) -> Move | None:
        """The step up to where the factor, or a bond with memory, turned on the way; None: none did."""
        if not self.sites.bent or move.outcome in (Outcome.FOLD, Outcome.TURNED):
            return None
        turned = self._turned(move.after)
        return None if turned is None else self._up_to(move, *turned)

    def _up_to(self, move: Move, outcome: Outcome, site: int | None) -> Move | None:
        """The step up to where a rate, of the factor or of a site, is zero; None: it is too short."""
        whole = float(self.here.tangent @ (move.after.y - self.here.y))
        if whole <= _LEAST:
            return None
        rate = self._rate_of(outcome, site)
        if rate(self.here) * rate(move.after) >= 0.0:
            return self._moved(outcome, site, move.after.y)
        ends = {0.0: self.here, whole: move.after}  # corrected anew, their rates may have other signs by rounding

        def rate_at(way: float) -> float:
            return rate(ends[way] if way in ends else self._at(way))

        root = brentq(rate_at, 0.0, whole, xtol=1e-13 * whole, rtol=1e-13, maxiter=100)
        return self._moved(outcome, site, self._at(float(root)).y)

    def _turned(self, after: Place) -> tuple[Outcome, int | None] | None:
        largest = float(np.max(np.abs(after.tangent)))
        if self.trend * after.tangent[-1] < -UNDECIDED * largest:
            return Outcome.FOLD, None
        rates = self.sites.rates(after.y[:-1], after.tangent[:-1]) * self.sites.outward
        back = np.flatnonzero(rates < -UNDECIDED * largest)
        return (Outcome.TURNED, int(back[0])) if back.size else None

    def _rate_of(self, outcome: Outcome, site: int | None) -> Callable[[Place], float]:
        if outcome is Outcome.FOLD or site is None:
            return lambda place: float(place.tangent[-1])
        return lambda place: float(self.sites.rates(place.y[:-1], place.tangent[:-1])[site])

    def _at(self, way: float) -> Place:
        """The point of the curve in the plane across the present tangent at a distance."""
        return self._after(self.correct(self.here.y + way * self.here.tangent, self.plane(way)))

    def _moved_by(self, move: Move) -> float:
        return float(np.max(np.abs(move.after.y - move.before.y)))

    def _checked(self, move: Move, way: float) -> Move:
        """The step, if it did not leave the curve."""
        if not self.sites.bent:
            return move
        short = way < 1e-7
        if not short and float(self.here.tangent @ move.after.tangent) < _LARGEST_TURN:
            raise Refused
        disagreement = self.disagreement(move)
        if not short and disagreement > 1.0:
            self.length *= max(0.3, 1.6 * disagreement**-0.2)  # halved as well where it is refused
            raise Refused
        agreed = self._moved_by(move) * 0.8 * max(disagreement, 1e-4) ** -0.2
        if move.outcome is not Outcome.STEP:  # an event that is near says nothing of the next step's length
            agreed = max(agreed, self.length)
        self.length = min(self._next, agreed)
        return move
