"""What happens first within a step of a curve: a site passes an end of its segment, turns back, or the factor turns.

Newton's method goes to the first event that a step has passed, with the condition of that event; where a rate is zero,
its root is found along the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.optimize import toms748

from ...typing import Array
from .equations import Equations, Place, Refused


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

    @property
    def size(self) -> float:
        """How far the fastest coordinate went."""
        return float(np.max(np.abs(self.after.y - self.before.y)))


class Events(Equations):
    """The equations of a curve, and the events within a step from the present point.

    Attributes:
        trend: the sign of the factor's rate since the last fold.
    """

    trend = 0

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
        beyond = abs(rest) / abs(y[-1] - start.y[-1]) if over and abs(rest) > self.limits.rounding else 0.0
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
        return self._returning(move, aim) or self._turning(move)

    def _shares(self, move: Move) -> Array:
        """The part of the step after which each site passed an end; 1 where it did not, (m,)."""
        sites, s0, s1 = self.sites, move.before.values.s, move.after.values.s
        found, way = np.ones(len(sites)), np.where(s1 != s0, s1 - s0, 1.0)
        allowed = sites.allowances(move.after.values, s1 - s0, move.size)
        above, below = s1 > np.maximum(sites.high + allowed, s0), s1 < np.minimum(sites.low - allowed, s0)
        for ends, beyond in ((sites.high, above), (sites.low, below)):
            found[beyond] = np.clip((ends[beyond] - s0[beyond]) / way[beyond], 0.0, 1.0 - 1e-12)
        return found

    def _moved(self, outcome: Outcome, site: int | None, y: Array) -> Move:
        if float(self.here.tangent @ (y - self.here.y)) < -self.limits.rounding:
            raise Refused
        move = Move(outcome=outcome, site=site, before=self.here, after=self._after(y))
        if outcome is Outcome.END and not self._arrives(move):
            raise Refused
        return move

    def _back_at(self, move: Move, site: int) -> Move:
        """Where a site passes the end at which it began: a bond that set out from it turned back on the way.

        Raises:
            Refused: it went inwards first, and came back within the step.
        """
        rate = self._rate_of(Outcome.TURNED, site)(self.here)
        beyond = move.after.values.s[site] - move.before.values.s[site]
        largest = float(np.max(np.abs(self.here.tangent)))
        if rate * beyond < 0.0 and abs(rate) > self.limits.undecided * largest and not self.sites.outward[site]:
            raise Refused
        sets_out = rate * self.sites.outward[site] > 0.0
        turned = self._up_to(move, Outcome.TURNED, site) if sets_out else None
        if turned is not None and turned.after.y is move.after.y:
            raise Refused  # it turns no earlier, and is beyond its end
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

    def _returning(self, move: Move, aim: float) -> Move | None:
        """The step up to where the factor is back at its aim, from which it set out; None: it is not."""
        began = self.here.y[-1] == aim / self.unit and move.outcome is not Outcome.FACTOR
        back = (move.after.y[-1] - self.here.y[-1]) * self.here.tangent[-1] < 0.0
        return self._up_to(move, Outcome.FACTOR, None) if began and back else None

    def _turning(self, move: Move) -> Move | None:
        """The step up to where the factor, or a bond with memory, turned on the way; None: none did."""
        if not self.sites.bent or move.outcome in (Outcome.FOLD, Outcome.TURNED):
            return None
        turned = self._turned(move.after)
        return None if turned is None else self._up_to(move, *turned)

    def _up_to(self, move: Move, outcome: Outcome, site: int | None) -> Move | None:
        """The step up to where a rate of the factor, now or in the mean, or of a site is 0; None: it is too short."""
        whole = float(self.here.tangent @ (move.after.y - self.here.y))
        if whole <= self.limits.shortest:
            return None
        rate = self._rate_of(outcome, site)
        if rate(self.here) * rate(move.after) >= 0.0:
            return self._moved(outcome, site, move.after.y)
        known = {0.0: self.here, whole: move.after}  # corrected anew, their rates may have other signs by rounding

        def rate_at(way: float) -> float:
            if way not in known:
                known[way] = self._at(way, known)
            found = rate(known[way])
            return found if abs(found) > self.limits.standing * float(np.max(np.abs(known[way].tangent))) else 0.0

        root = toms748(rate_at, 0.0, whole, xtol=1e-13 * whole, rtol=1e-13, k=1)
        rate_at(root)
        return self._moved(outcome, site, known[root].y)

    def _turned(self, after: Place) -> tuple[Outcome, int | None] | None:
        largest = float(np.max(np.abs(after.tangent)))
        if self.trend * after.tangent[-1] < -self.limits.undecided * largest:
            return Outcome.FOLD, None
        rates = self.sites.rates(after.y[:-1], after.tangent[:-1])
        clear = np.abs(rates) > self.limits.undecided * largest
        back = np.flatnonzero(self.sites.turning_back(after.values, rates) & clear)
        return (Outcome.TURNED, int(back[0])) if back.size else None

    def _rate_of(self, outcome: Outcome, site: int | None) -> Callable[[Place], float]:
        if outcome is Outcome.FACTOR:
            return self._mean_rate
        if outcome is Outcome.FOLD or site is None:
            return lambda place: float(place.tangent[-1])
        return lambda place: float(self.sites.rates(place.y[:-1], place.tangent[:-1])[site])

    def _mean_rate(self, place: Place) -> float:
        """How the factor changes on the way from here to a place of the same step."""
        way = float(self.here.tangent @ (place.y - self.here.y))
        return float((place.y[-1] - self.here.y[-1]) / way if way > 0.0 else self.here.tangent[-1])

    def _at(self, way: float, known: Mapping[float, Place]) -> Place:
        """The point of the curve in the plane across the present tangent at a distance, between those known."""
        low, high = max(w for w in known if w < way), min(w for w in known if w > way)
        share = (way - low) / (high - low)
        guess = (1.0 - share) * known[low].y + share * known[high].y
        return self._after(self.correct(guess, self.plane(way)))
