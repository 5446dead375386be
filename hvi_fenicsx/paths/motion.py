"""From a state that is not stable down to a stable one as an overdamped body moves: θ D x' = f - S x - r.

Implicit steps in time, each followed from event to event like a path: what is left of the forces is applied little by
little while a stiffness θ D holds back. A law that drops does so at once, and θ falls from step to step, so that the
energy falls all the way until equilibrium is reached or a body is out of all reach. Bonds remember on the way.
"""

from __future__ import annotations

from contextlib import suppress
from enum import Enum

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CondensedStiffness, DenseStiffness
from ..typing import Array, magnitude
from .branch import Branch, Refused, StepEnd, advancing
from .contact_points import ContactPoints
from .curve import branch_from
from .thresholds import DEFAULT


class _Went(Enum):
    """How a step in time went, and by what θ changes after it."""

    WELL = 0.4
    PARTLY = 8.0
    """Up to where what holds back is too little for the rest; the energy has fallen as far as that."""
    NOWHERE = 64.0


class OverdampedMotion:
    """The motion at constant loads.

    Args:
        problem: the problem.
        points: where they are; changed.
        z: their coordinates, (n,).
        load: f, (n,).
        held: whether no way leads off at these loads, however far the body goes.

    Attributes:
        z: the coordinates now, (n,).
        escapes: whether a body is out of reach.
        theta: what holds back in the next step, in units of the damping.
    """

    def __init__(self, problem: CondensedProblem, points: ContactPoints, z: Array, load: Array, *, held: bool) -> None:
        self._problem, self._points, self._load = problem, points, load
        self.z, self.escapes, self.theta = z.copy(), False, 1.0
        self._infinite = np.inf if held else DEFAULT.far * (points.scale + self._extent())

    def run(self, directions: Array) -> bool:
        """Move to equilibrium; whether one was found, or the body escapes.

        Args:
            directions: in which points that are on a drop go on, (m,).
        """
        elastic = self._points.elastic
        try:
            self._leave_drops(directions)
            return self._moved()
        except (Refused, np.linalg.LinAlgError):
            return False
        finally:
            self._points.elastic = elastic

    def _moved(self) -> bool:
        for _ in range(DEFAULT.waits**2 * (1 + len(self._points))):
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
        return self._extent() > self._infinite

    def _extent(self) -> float:
        return magnitude(self._points.values(self.z).lengths)

    def _at_rest(self) -> bool:
        """Whether hardly any force is left, and the body would not leave by itself what is left of it."""
        values = self._points.values(self.z)
        elastic = self._problem.elastic @ values.x
        size = max(magnitude(force) for force in (self._load, elastic, values.force))
        rests = magnitude(self._load - elastic - values.force) <= 1e-9 * size
        self._points.elastic = self._problem.elastic  # without what holds back
        return rests and self._points.unstable_directions(values) == 0

    def _settled(self) -> bool:
        """The equilibrium itself, from where the motion is slow; whether it is stable, and on the points' segments."""
        self._points.elastic = self._problem.elastic
        z = branch_from(self._points, self._load, np.zeros_like(self._load), self.z, 0.0).balanced(0.0)
        values, low, high = self._points.values(z), self._points.low, self._points.high
        allowed = DEFAULT.reached * (1.0 + np.abs(values.s))
        beyond = np.maximum(low - values.s, values.s - high) > allowed
        if np.any(beyond) or self._points.unstable_directions(values):
            return False
        self.z = z
        return True

    def _stepped_or_back(self) -> _Went:
        """One step in time; where it led nowhere, nothing has changed."""
        kept, z, went = self._points.kept(), self.z, _Went.NOWHERE
        with suppress(Refused, np.linalg.LinAlgError):
            went = self._stepped()
        if went is _Went.NOWHERE:
            self._points.restore(kept)
            self.z = z
        return went

    def _stepped(self) -> _Went:
        """One step in time, up to the first drop, or to where the body is out of reach."""
        points, values = self._points, self._points.values(self.z)
        left = self._load - self._problem.elastic @ values.x - values.force
        points.elastic = self._held_back()
        if points.unstable_directions(values):  # what holds back is less than what pushes on: the energy would rise
            return _Went.NOWHERE
        branch = branch_from(points, points.elastic @ values.x + values.force, left, self.z, 0.0)
        branch.shortest = DEFAULT.small
        branch.set_out(1.0)
        went = self._followed(branch)
        self.z = branch.z.copy()
        if points.on_drops():
            self._leave_drops(branch.directions)
            return _Went.WELL
        return went

    def _held_back(self) -> CondensedStiffness:
        """The stiffness with what holds back."""
        points, elastic = self._points, self._problem.elastic
        if points.straight:
            return elastic.raised(self.theta * points.stiffest)
        return DenseStiffness(elastic.array + self.theta * np.diag(points.forces / points.length))

    def _followed(self, branch: Branch) -> _Went:
        """Along the branch of one step, until all that was left of the forces is applied or a law drops."""
        moves = advancing(branch, 1.0, DEFAULT.waits * (2 + len(self._points)))
        while branch.rising >= 0.0 and not self._points.on_drops() and (move := next(moves, None)):
            self.z = branch.z.copy()
            if move.outcome is StepEnd.FACTOR or self._is_out_of_reach():
                return _Went.WELL
            if move.outcome is StepEnd.AWAY:
                return _Went.NOWHERE
            if move.outcome is StepEnd.STUCK:
                break
        return _Went.PARTLY if branch.factor > 0.0 else _Went.NOWHERE

    def _leave_drops(self, directions: Array) -> None:
        """Let the laws that drop do so."""
        for k in self._points.on_drops():
            self._points.leave(self.z, k, forward=bool(directions[k] >= 0.0))
