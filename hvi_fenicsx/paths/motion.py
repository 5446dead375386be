"""From a state that is not stable down to a stable one as an overdamped body moves: θ x' = f - S x - r.

Implicit steps in time, each followed from event to event like a path: what is left of the forces is applied little by
little while a stiffness θ holds back. Where the forces grow by more than a step may let them, it is gone back and made
shorter; else the next one is longer. A law that drops does so at once. So the energy falls all the way until
equilibrium is reached or a body is out of all reach. Bonds remember on the way.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, magnitude
from .branch import Branch, Refused, StepEnd, advancing
from .curve import branch_from
from .relations import ContactPoints, Values
from .thresholds import DEFAULT


class OverdampedMotion:
    """The motion at constant loads.

    Args:
        problem: the problem.
        points: where they are; changed.
        z: their coordinates, (n,).
        held: whether no way leads off at these loads, however far the body goes.
        growth: of what is left of the forces in one step, at most, relative.

    Attributes:
        z: the coordinates now, (n,).
        escapes: whether a body is out of reach.
        theta: what holds back in the next step, in units of the stiffness.
    """

    def __init__(
        self, problem: CondensedProblem, points: ContactPoints, z: Array, *, held: bool, growth: float = np.inf
    ) -> None:
        self._problem, self._points, self._growth = problem, points, growth
        self.z, self.escapes, self.theta = z.copy(), False, 1.0
        self._infinite = np.inf if held else DEFAULT.far * (points.scale + self._extent())

    def run(self, load: Array, directions: Array) -> bool:
        """Move to equilibrium; whether one was found, or the body escapes.

        Args:
            load: f, (n,).
            directions: in which points that are on a drop go on, (m,).
        """
        self._load = load
        try:
            self._leave_drops(directions)
            return self._moved()
        except (Refused, np.linalg.LinAlgError):
            return False
        finally:
            self._points.elastic = self._problem.elastic

    def _moved(self) -> bool:
        for _ in range(DEFAULT.waits**2 * (1 + len(self._points))):
            if self._at_rest() and self._settled():
                return True
            if self._is_out_of_reach():
                self.escapes = True
                return True
            self.theta *= 0.5 if self._stepped_or_back() else 4.0
            if self.theta > 1e12:
                return False
        return False

    def _is_out_of_reach(self) -> bool:
        return self._extent() > self._infinite

    def _extent(self) -> float:
        return magnitude(self._points.values(self.z).lengths)

    def _left(self, values: Values) -> Array:
        """What is left of the forces, (n,)."""
        return self._load - self._problem.elastic @ values.x - values.force

    def _at_rest(self) -> bool:
        """Whether hardly any force is left, and the body would not leave by itself what is left of it."""
        values = self._points.values(self.z)
        size = max(magnitude(self._load), magnitude(values.force), magnitude(self._problem.elastic @ values.x))
        self._points.elastic = self._problem.elastic  # without what holds back
        return magnitude(self._left(values)) <= 1e-9 * size and not self._points.unstable_directions(values)

    def _settled(self) -> bool:
        """The equilibrium itself, from where the motion is slow; whether it is stable, and on the points' segments."""
        z = branch_from(self._points, self._load, np.zeros_like(self._load), self.z, 0.0).balanced(0.0)
        values, low, high = self._points.values(z), self._points.low, self._points.high
        allowed = DEFAULT.reached * (1.0 + np.abs(values.s))
        beyond = np.maximum(low - values.s, values.s - high) > allowed
        if np.any(beyond) or self._points.unstable_directions(values):
            return False
        self.z = z
        return True

    def _stepped_or_back(self) -> bool:
        """One step in time; where it went too far, nothing has changed."""
        kept, z = self._points.kept(), self.z
        with suppress(Refused, np.linalg.LinAlgError):
            if self._stepped():
                return True
        self._points.restore(kept)
        self.z = z
        return False

    def _stepped(self) -> bool:
        """One step in time, up to the first drop, or to where the body is out of reach; whether it is short enough."""
        points, values = self._points, self._points.values(self.z)
        left = self._left(values)
        points.elastic = self._problem.elastic.raised(self.theta * points.stiffest)
        if points.unstable_directions(values):  # what holds back is less than what pushes on: the energy would rise
            return False
        branch = branch_from(points, points.elastic @ values.x + values.force, left, self.z, 0.0)
        branch.shortest = DEFAULT.small
        branch.set_out(1.0)
        went = self._followed(branch)
        self.z = branch.z.copy()
        if points.on_drops():
            self._leave_drops(branch.directions)
            return True
        grown = magnitude(self._left(branch.values)) > (1.0 + self._growth) * magnitude(left)
        return went and not grown

    def _followed(self, branch: Branch) -> bool:
        """Along the branch of one step; whether all that was left of the forces is applied, or a law drops before."""
        moves = advancing(branch, 1.0, DEFAULT.waits * (2 + len(self._points)))
        while branch.rising >= 0.0 and not self._points.on_drops() and (move := next(moves, None)):
            self.z = branch.z.copy()
            if move.outcome is StepEnd.FACTOR or self._is_out_of_reach():
                return True
            if move.outcome in (StepEnd.AWAY, StepEnd.STUCK):
                return False
        return False

    def _leave_drops(self, directions: Array) -> None:
        """Let the laws that drop do so."""
        for k in self._points.on_drops():
            self._points.leave(self.z, k, forward=bool(directions[k] >= 0.0))
