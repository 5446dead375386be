"""From a state that is not stable down to a stable one as an overdamped body moves: θ D x' = f - S x - r.

Implicit steps in time, each followed from event to event like a path: what is left of the forces is applied little by
little while a stiffness θ D holds back. A law that drops does so at once, and θ falls from step to step, so that the
energy falls all the way until equilibrium is reached or a body is out of all reach. Bonds remember on the way.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from enum import Enum

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array
from .curve import Curve
from .equations import Refused
from .events import Outcome
from .passage import Crossing, set_out
from .sites import Sites


class _Went(Enum):
    """How a step in time went, and by what θ changes after it."""

    WELL = 0.4
    PARTLY = 8.0
    """Up to where what holds back is too little for the rest; the energy has fallen as far as that."""
    NOWHERE = 64.0


class Relaxation:
    """The motion at constant loads.

    Args:
        problem: the problem.
        sites: where they are; changed.
        z: their coordinates, (n,).
        load: f, (n,).
        lag: an order of the sites, (m,).
        held: whether no way leads off at these loads, however far the body goes.
        step: called before each step; it may end the motion by an exception.

    Attributes:
        z: the coordinates now, (n,).
        escapes: whether a body is out of reach.
        theta: what holds back in the next step, in units of the damping.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        sites: Sites,
        z: Array,
        load: Array,
        lag: Array,
        *,
        held: bool,
        step: Callable[[], None],
    ) -> None:
        self._problem, self._sites, self._load, self._lag, self._step = problem, sites, load, lag, step
        self._limits = sites.thresholds.jump
        self._damping = np.diag(sites.forces / sites.length)
        self.z, self.escapes, self.theta = z.copy(), False, 1.0
        self._infinite = np.inf if held else self._limits.far * (1.0 + float(np.max(np.abs(sites.s(z)), initial=0.0)))

    def run(self, directions: Array) -> bool:
        """Move to equilibrium; whether one was found, or the body escapes.

        Args:
            directions: in which sites that are on a drop go on, (m,).
        """
        stiffness = self._sites.stiffness
        try:
            self._leave_drops(directions)
            return self._moved()
        except (Refused, np.linalg.LinAlgError):
            return False
        finally:
            self._sites.stiffness = stiffness

    def _moved(self) -> bool:
        for _ in range(self._limits.times + self._limits.more_times * len(self._sites)):
            if self._at_rest():
                return self._settled()
            if self._is_out_of_reach():
                self.escapes = True
                return True
            self.theta *= self._stepped_or_back().value
            if self.theta > 1e12:
                return False
        return False

    def _is_out_of_reach(self) -> bool:
        return float(np.max(np.abs(self._sites.s(self.z)), initial=0.0)) > self._infinite

    def _left(self) -> Array:
        """What is left of the forces, (n,)."""
        values = self._sites.values(self.z)
        return np.asarray(self._load - self._problem.stiffness @ values.x - values.force)

    def _at_rest(self) -> bool:
        """Whether hardly any force is left, and the body would not leave by itself what is left of it."""
        values = self._sites.values(self.z)
        acting = (self._load, self._problem.stiffness @ values.x, values.force)
        size = max(float(np.max(np.abs(force), initial=0.0)) for force in acting)
        rests = bool(np.max(np.abs(self._left()), initial=0.0) <= 1e-9 * size)
        self._sites.stiffness = self._problem.stiffness  # without what holds back
        return rests and self._sites.unstable_directions(values) == 0

    def _settled(self) -> bool:
        """The equilibrium itself, from where the motion is slow; whether it is stable, and on the sites' segments."""
        self._sites.stiffness = self._problem.stiffness
        curve = Curve(self._load, np.zeros_like(self._load), self._sites, self.z, 0.0)
        z = curve.correct(curve.here.y, curve.at_factor(0.0))[:-1]
        values, low, high = self._sites.values(z), self._sites.low, self._sites.high
        beyond = np.maximum(low - values.s, values.s - high) > curve.limits.rounding * (1.0 + np.abs(values.s))
        if np.any(beyond) or self._sites.unstable_directions(values):
            return False
        self.z = z
        return True

    def _stepped_or_back(self) -> _Went:
        """One step in time; where it led nowhere, nothing has changed."""
        kept, z, went = self._sites.kept(), self.z, _Went.NOWHERE
        with suppress(Refused, np.linalg.LinAlgError):
            went = self._stepped()
        if went is _Went.NOWHERE:
            self._sites.restore(kept)
            self.z = z
        return went

    def _stepped(self) -> _Went:
        """One step in time, up to the first drop, or to where the body is out of reach."""
        sites, left, values = self._sites, self._left(), self._sites.values(self.z)
        sites.stiffness = self._problem.stiffness + self.theta * self._damping
        if sites.unstable_directions(values):  # what holds back is less than what pushes on: the energy would rise
            return _Went.NOWHERE
        held = sites.stiffness @ values.x + values.force
        curve = Curve(held, left, sites, self.z, 0.0)
        set_out(curve, 1.0, self._lag, self._step)
        curve.shortest = self._limits.shortest
        went = self._followed(curve)
        self.z = curve.here.y[:-1].copy()
        if sites.on_drops():
            self._leave_drops(sites.rates(curve.here.y[:-1], curve.here.tangent[:-1]))
            return _Went.WELL
        return went

    def _followed(self, curve: Curve) -> _Went:
        """Along the curve of one step, until all that was left of the forces is applied or a law drops."""
        sites = self._sites
        for _ in range(50 + 4 * len(sites)):
            if curve.here.tangent[-1] < 0.0 or sites.on_drops():
                break
            self._step()
            move = curve.advance(1.0)
            self.z = curve.here.y[:-1].copy()
            if move.outcome is Outcome.FACTOR or self._is_out_of_reach():
                return _Went.WELL
            if move.outcome is Outcome.AWAY:
                return _Went.NOWHERE
            if move.outcome is Outcome.STUCK:
                break
            if move.outcome in (Outcome.END, Outcome.TURNED):
                Crossing(curve, self._lag, self._step).run(move)
        return _Went.PARTLY if curve.factor > 0.0 else _Went.NOWHERE

    def _leave_drops(self, directions: Array) -> None:
        """Let the laws that drop do so."""
        for k in self._sites.on_drops():
            self._sites.leave(self.z, k, forward=bool(directions[k] >= 0.0))
