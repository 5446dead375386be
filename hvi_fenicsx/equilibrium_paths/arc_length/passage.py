"""Sites pass from one segment of their graphs to the next, one or several at one point of the curve.

At such a point the equations are piecewise linear to first order. Where several sites are at ends of their segments,
the load is imagined to be perturbed by ε q with ε infinitesimal: each site then comes to its end at a way of its own of
the order ε, one after the other, until the curve leads away from all ends (as for the exact path, :mod:`..tracer`). The
site that passes goes on along its graph, and that gives the direction in which the curve goes on. The order of the
sites comes from where they are, so that it is the same on any number of ranks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...system.condensed_problem import CondensedProblem
from ...typing import Array, Mask
from ..segments import Kind, Segment, piece_at
from ..state import Event
from .curve import Curve
from .equations import Refused
from .events import Move, Outcome


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A site has passed.

    Attributes:
        site: which.
        before: the segment that it left.
        after: the one on which it goes on.
    """

    site: int
    before: Segment
    after: Segment

    @property
    def closes(self) -> bool:
        """Whether a contact closes."""
        return self.after.kind is Kind.BOUND

    @property
    def opens(self) -> bool:
        """Whether a contact opens."""
        return self.before.kind is Kind.BOUND


def event_of(passages: Sequence[Passage], *, folds: bool) -> Event:
    """The event of a state at which sites pass.

    Args:
        passages: at this state.
        folds: whether the factor turns there.
    """
    if folds:
        return Event.FOLD
    if any(p.closes for p in passages):
        return Event.CONTACT
    return Event.RELEASE if any(p.opens for p in passages) else Event.KINK


def order(problem: CondensedProblem, sites: list[int]) -> Array:
    """Numbers from 0.5 to 1.5 that look like random ones, from the vertices of unknowns, (m,).

    Args:
        problem: the problem.
        sites: the first unknown of each site.
    """
    scale = float(np.max(np.abs(problem.points), initial=0.0)) or 1.0
    points = np.round(problem.points[sites] / scale, 6)
    seen: dict[bytes, int] = {}
    found = np.empty(len(sites))
    for k in range(len(sites)):
        place = (points[k, :] + 0.0).tobytes()
        number = seen[place] = seen.get(place, 0) + 1
        mixed = np.sin(float(np.dot(points[k], (12.9898, 78.233, 37.719))) + 4.1 * number) * 43_758.5453
        found[k] = 0.5 + mixed - np.floor(mixed)
    return found


def advancing(curve: Curve, aim: float, lag: Array, step: Callable[[], None], most: int) -> Iterator[Move]:
    """The steps of a curve, from event to event; after each one that is an event the sites pass.

    Args:
        curve: the curve; it has a direction.
        aim: the factor at which a step ends.
        lag: an order of the sites, (m,).
        step: is called before each step and passage; it may raise an error to end them.
        most: steps at most.

    Raises:
        Refused: there is no end of passing.
    """
    for _ in range(most):
        step()
        move = curve.advance(aim)
        yield move
        if move.outcome in (Outcome.END, Outcome.TURNED):
            Crossing(curve, lag, step).run(move.site, turned=move.outcome is Outcome.TURNED)


class Crossing:
    """The passages at the present point of a curve.

    Args:
        curve: the curve; its direction and cell are changed.
        lag: the ways, of the order ε, of the sites to their ends, (m,).
        check: is called before each passage; it may raise an error to end them.
    """

    def __init__(self, curve: Curve, lag: Array, check: Callable[[], None]) -> None:
        self._curve, self._sites, self._check, self._limits = curve, curve.sites, check, curve.limits
        self._lag, self._left = lag, lag.copy()
        self._cells: Counter[tuple[bytes, frozenset[int]]] = Counter()
        self._turned: set[int] = set()
        self._rests = np.zeros(len(lag), dtype=bool)
        self._arrived: int | None = None
        self.passages: list[Passage] = []

    def run(self, arrived: int | None = None, *, turned: bool = False) -> list[Passage]:
        """Let all sites pass that have to, those that arrived first.

        Args:
            arrived: the site that is at its end already, or that turned back.
            turned: whether it turned back.

        Raises:
            Refused: there is no end of passing.
        """
        if arrived is not None:
            self._left[arrived], self._arrived = 0.0, arrived
            rates = self._rates()
            rates[arrived] = self._outwards(arrived)
            if turned:
                rates[arrived] = -1e-9 * self._sites.outward[arrived]
            self._pass(arrived, rates)
        for _ in range(50 + 20 * len(self._sites)):
            self._check()
            rates = self._rates()
            ways = self._ways(rates)
            k = int(np.argmin(ways)) if len(ways) else 0
            if not len(ways) or not np.isfinite(ways[k]):
                return self.passages
            self._go(rates, float(ways[k]))
            self._left[k] = 0.0
            self._pass(k, rates)
            self._count()
        raise Refused

    def _count(self) -> None:
        """Count the cells that the passages come to.

        Raises:
            Refused: they go round.
        """
        cell = self._sites.numbers.tobytes(), frozenset(self._turned)
        self._cells[cell] += 1
        if self._cells[cell] > self._limits.rounds:
            raise Refused

    def _outwards(self, k: int) -> float:
        """The rate of a site that is at an end of its segment, out of it."""
        sites, s = self._sites, float(self._curve.here.values.s[k])
        rate = abs(float(self._all_rates()[k])) or np.finfo(float).tiny
        return rate if sites.high[k] - s < s - sites.low[k] else -rate

    def _all_rates(self) -> Array:
        here = self._curve.here
        return self._sites.rates(here.y[:-1], here.tangent[:-1])

    def _rates(self) -> Array:
        """How fast the sites go; 0 for those that stand but for rounding, (m,): a slow one that goes to and fro does.

        So does the one that arrived where its rate may have either sign: it was the step that took it out.
        """
        rates, allowed = self._all_rates(), np.full(len(self._sites), self._limits.standing)
        if self._arrived is not None and self._sites.bent:
            allowed[self._arrived] = self._limits.undecided
        rates[np.abs(rates) <= allowed * np.max(np.abs(self._curve.here.tangent))] = 0.0
        rates[self._rests] = 0.0
        return rates

    def _near(self) -> tuple[Mask, Mask]:
        """Which sites are at the low end, and which at the high end of their segments."""
        sites, s = self._sites, self._curve.here.values.s
        allowed = self._limits.rounding * (1.0 + np.abs(s))
        return s <= sites.low + allowed, s >= sites.high - allowed

    def _ways(self, rates: Array) -> Array:
        """The ways to the ends that the sites approach; infinite where they approach none, (m,)."""
        comes = self._comes(rates)
        found = np.full(len(rates), np.inf)
        found[comes] = self._left[comes] / np.abs(rates[comes])
        return found

    def _comes(self, rates: Array) -> Mask:
        """Which sites are at an end that they approach, or turn back, (m,)."""
        low, high = self._near()
        back = self._sites.turning_back(self._curve.here.values, rates)
        return ((rates < 0.0) & low) | ((rates > 0.0) & high) | back

    def _go(self, rates: Array, way: float) -> None:
        (low, high), comes = self._near(), self._comes(rates)
        loads = rates * self._sites.outward > 0.0
        change = way * np.abs(rates)
        self._left = np.where(comes, self._left - change, self._left + np.where(low | high, change, 0.0))
        self._left = np.where(loads & ~comes, self._lag, np.maximum(self._left, 0.0))

    def _pass(self, k: int, rates: Array) -> None:
        """Into the next segment, and on in the same direction along the graph."""
        sites, curve, before = self._sites, self._curve, self._sites.segment(k)
        forward, slow = bool(rates[k] > 0.0), self._is_slow(k)
        y = curve.here.y
        if forward * 2.0 - 1.0 == -sites.outward[k] and not sites.unmoved(curve.here.values)[k]:
            y = self._turned_back(k, forward=forward)
        else:
            sites.enter(k, int(sites.numbers[k]) + (1 if forward else -1))
        curve.place(y, curve.here.tangent, passed=k)
        row = curve.here.tangent if slow else curve.row(k)
        sign = 1.0 if slow or forward else -1.0
        curve.head(curve.tangent(curve.here.values, row, sign))
        self._rests[k] = slow and any(passage.site == k for passage in self.passages)
        self.passages.append(Passage(site=k, before=before, after=sites.segment(k)))

    def _is_slow(self, k: int) -> bool:
        """Whether a site stands but for rounding: beside all others neither it nor its force moves.

        On a steep segment the force changes fast where the displacement hardly does.
        """
        values, stiffest = self._curve.here.values, float(np.max(np.diag(self._sites.stiffness)))
        forces = (stiffest * np.abs(values.moves) + np.abs(values.rises)) * np.abs(self._all_rates())
        return bool(forces[k] <= self._limits.slow_force * np.max(forces))

    def _turned_back(self, k: int, *, forward: bool) -> Array:
        """Coordinates and factor on the secant of where the bonds have been, (n + 1,)."""
        sites, curve, values = self._sites, self._curve, self._curve.here.values
        x, force = float(values.lengths[k]), float(values.tractions[k])
        sites.remember(k, x, force)
        self._turned.add(k)
        sites.enter(k, piece_at(sites.chain(k), x, self._limits.at_end, forward=forward))
        y = curve.here.y.copy()
        sites.set(y, k, sites.coordinate(k, x, force))
        return y
