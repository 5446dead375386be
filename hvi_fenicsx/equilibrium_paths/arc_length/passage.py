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

from ...reduced.condensed_problem import CondensedProblem
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
            Crossing(curve, lag, step).run(move)


def set_out(curve: Curve, sign: float, lag: Array, step: Callable[[], None]) -> None:
    """Let a curve set out along its factor, and the sites pass that have to.

    Args:
        curve: the curve.
        sign: 1 where the factor is to grow, -1 where it is to fall.
        lag: an order of the sites, (m,).
        step: is called before each passage; it may raise an error to end them.

    Raises:
        Refused: there is no end of passing.
        numpy.linalg.LinAlgError: the factor stands along the curve.
    """
    curve.set_out(sign)
    Crossing(curve, lag, step).run()


@dataclass(frozen=True, kw_only=True)
class _Approach:
    """Which sites come to ends of their segments along the present direction.

    Attributes:
        rates: how fast the sites go, (m,).
        near: which of them are at an end, (m,).
        comes: which of them are at an end that they approach, or turn back, (m,).
    """

    rates: Array
    near: Mask
    comes: Mask


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

    def run(self, move: Move | None = None) -> list[Passage]:
        """Let all sites pass that have to, the one that arrived first.

        Args:
            move: the step that took a site to its end, or in which it turned back.

        Raises:
            Refused: there is no end of passing.
        """
        if move is not None and move.site is not None:
            self._pass_arrived(move.site, turned=move.outcome is Outcome.TURNED)
        for _ in range(50 + 20 * len(self._sites)):
            self._check()
            approach = self._approach()
            ways = self._ways(approach)
            k = int(np.argmin(ways)) if len(ways) else 0
            if not len(ways) or not np.isfinite(ways[k]):
                return self.passages
            self._go(approach, float(ways[k]))
            self._left[k] = 0.0
            self._pass(k, approach.rates)
            self._count()
        raise Refused

    def _pass_arrived(self, k: int, *, turned: bool) -> None:
        """Let the site pass that is at its end already, or that turned back."""
        self._left[k], self._arrived = 0.0, k
        rates = self._rates()
        rates[k] = -1e-9 * self._sites.outward[k] if turned else self._outwards(k)
        self._pass(k, rates)

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

    def _approach(self) -> _Approach:
        sites, values, rates = self._sites, self._curve.here.values, self._rates()
        allowed = sites.allowances(values, rates, float(np.max(np.abs(self._curve.here.tangent))))
        low, high = values.s <= sites.low + allowed, values.s >= sites.high - allowed
        comes = ((rates < 0.0) & low) | ((rates > 0.0) & high) | sites.turning_back(values, rates)
        return _Approach(rates=rates, near=low | high, comes=comes)

    def _ways(self, approach: _Approach) -> Array:
        """The ways to the ends that the sites approach; infinite where they approach none, (m,)."""
        comes = approach.comes
        found = np.full(len(comes), np.inf)
        found[comes] = self._left[comes] / np.abs(approach.rates[comes])
        return found

    def _go(self, approach: _Approach, way: float) -> None:
        """A way of the order ε along the present direction."""
        comes, change = approach.comes, way * np.abs(approach.rates)
        loads = approach.rates * self._sites.outward > 0.0
        self._left = np.where(comes, self._left - change, self._left + np.where(approach.near, change, 0.0))
        self._left = np.where(loads & ~comes, self._lag, np.maximum(self._left, 0.0))

    def _pass(self, k: int, rates: Array) -> None:
        """Into the next segment, and on in the same direction along the graph."""
        sites, curve, before = self._sites, self._curve, self._sites.segment(k)
        forward, slow = bool(rates[k] > 0.0), self._is_slow(k)
        y = curve.here.y
        if forward * 2.0 - 1.0 == -sites.outward[k] and not sites.unmoved(curve.here.values)[k]:
            y = self._turned_back(k, forward=forward)
        else:
            sites.enter_next(k, forward=forward)
        as_before = curve.place(y, curve.here.tangent, passed=k) and not slow
        curve.head(curve.row(k) if as_before else curve.here.tangent, 1.0 if forward or not as_before else -1.0)
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
