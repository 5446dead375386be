"""Points pass from one segment of their graphs to the next, one or several at one point of the curve.

At such a point the equations are piecewise linear to first order. Where several points are at ends of their segments,
the load is imagined to be perturbed by ε q with ε infinitesimal: each then comes to its end at a way of its own of the
order ε, one after the other, until the curve leads away from all ends (as on straight segments, :mod:`.pivoting`). The
point that passes goes on along its graph, and that gives the direction in which the curve goes on. The order of the
points comes from where they are, so that it is the same on any number of ranks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from ..typing import Array
from .branch import Move, Passage, Refused, StepEnd
from .equations import CurveEquations
from .segments import piece_at


class Crossing:
    """The passages at the present point of a curve.

    Args:
        curve: the curve; its direction and its points' statuses are changed.
        check: is called before each passage; it may raise an error to end them.
    """

    def __init__(self, curve: CurveEquations, check: Callable[[], None]) -> None:
        self._curve, self._points, self._check, self._limits = curve, curve.points, check, curve.limits
        self._lag = self._points.order  # the ways, of the order ε, of the points to their ends
        self._left = self._lag.copy()
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
        for _ in range(self._limits.waits * (2 + len(self._points))):
            self._check()
            rates = self._rates()
            k = self._next(rates)
            if k is None:
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
        if self._cells[cell] > self._limits.corrections:
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
        rates, allowed = self._curve.directions.copy(), np.full(len(self._points), self._limits.standing)
        if self._arrived is not None and self._points.bent:
            allowed[self._arrived] = self._limits.undecided
        rates[np.abs(rates) <= allowed * np.max(np.abs(self._curve.here.tangent))] = 0.0
        rates[self._rests] = 0.0
        return rates

    def _next(self, rates: Array) -> int | None:
        """The point that comes to its end first on a way of the order ε, or turns back; all go there. None: none does.

        Args:
            rates: how fast the points go, (m,).
        """
        points, values, speeds = self._points, self._curve.here.values, np.abs(rates)
        allowed = points.allowances(values, rates, float(np.max(np.abs(self._curve.here.tangent))))
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
        curve.head(curve.row(k) if as_before else curve.here.tangent, 1.0 if forward or not as_before else -1.0)
        self._rests[k] = slow and any(passage.point == k for passage in self.passages)
        self.passages.append(Passage(point=k, before=before, after=points.segment(k)))

    def _is_slow(self, k: int) -> bool:
        """Whether a point stands but for rounding: beside all others neither it nor its force moves.

        On a steep segment the force changes fast where the displacement hardly does.
        """
        values, stiffest = self._curve.here.values, float(np.max(np.diag(self._points.stiffness)))
        forces = (stiffest * np.abs(values.moves) + np.abs(values.rises)) * np.abs(self._curve.directions)
        return bool(forces[k] <= self._limits.slow * np.max(forces))

    def _turned_back(self, k: int, *, forward: bool) -> Array:
        """Coordinates and factor on the secant of where the bonds have been, (n + 1,)."""
        points, curve, values = self._points, self._curve, self._curve.here.values
        x, force = float(values.lengths[k]), float(values.tractions[k])
        points.remember(k, x, force)
        self._turned.add(k)
        points.enter(k, piece_at(points.chain(k), x, self._limits.standing, forward=forward))
        y = curve.here.y.copy()
        points.set(y, k, points.coordinate(k, x, force))
        return y
