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

import numpy as np

from ...typing import Array
from .equations import Refused
from .events import Events, Move, Outcome
from .sites import Sites


class Curve(Events):
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
        shortest: the shortest step that is tried.
        disagreement: of the work along a step with the energies, 1 where it is as large as is allowed.
    """

    def __init__(
        self, constant: Array, rate: Array, sites: Sites, z: Array, factor: float, fineness: float = 1.0
    ) -> None:
        super().__init__(constant, rate, sites, z, factor)
        self._fineness, self.length, self.shortest = fineness, 0.1 * fineness, self.limits.shortest
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
        while self.length > self.shortest:
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
        far = self.limits.far * self._size
        if self.factor_rate == 0.0 and nearest > far and self._is_straight(far):
            return True
        return not np.isfinite(nearest) and bool(np.max(np.abs(self.here.values.s), initial=0.0) > far)

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
        there = np.abs(ends - s) <= sites.allowances(self.here.values, rates, largest)
        moves = np.abs(rates) > np.where(there & sites.bent, self.limits.undecided, self.limits.standing) * largest
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
        # what ends with the factor at its aim goes on from there, if at all
        if until <= way * (1.0 + 0.1 * self.limits.rounding):
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

    def settle(self) -> None:
        """Take out what rounding has left in the equations: sites pass their ends a little before or after them."""
        with suppress(Refused):
            self._settle_at(self.correct(self.here.y, self.plane(0.0)))

    def settle_at_factor(self) -> None:
        """The same with the factor as it is."""
        with suppress(Refused):
            standing = self.factor_rate == 0.0  # then it fixes no point of the curve
            y = self.correct(self.here.y, self.plane(0.0) if standing else self.at_factor(self.factor))
            self._settle_at(np.append(y[:-1], self.here.y[-1]))

    def _settle_at(self, y: Array) -> None:
        self.here = self._at_place(y, self.here.tangent, self.sites.values(y[:-1]))

    def _checked(self, move: Move, way: float) -> Move:
        """The step, if it did not leave the curve."""
        if not self.sites.bent:
            return move
        short = way < 1e-7
        if not short and float(self.here.tangent @ move.after.tangent) < self.limits.least_turn:
            raise Refused
        disagreement = self.disagreement(move)
        if not short and disagreement > 1.0:
            self.length *= max(0.3, 1.6 * disagreement**-0.2)  # halved as well where it is refused
            raise Refused
        agreed = move.size * 0.8 * max(disagreement, 1e-4) ** -0.2
        if move.outcome is not Outcome.STEP:  # an event that is near says nothing of the next step's length
            agreed = max(agreed, self.length)
        self.length = min(self._next, agreed)
        return move
