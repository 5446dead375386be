"""From a state that is not stable to the next stable equilibrium at the same loads.

It is looked for along the curve of equilibria first: where the curve turns, falls, and comes back to the loads, with
one unstable direction on its way, that is where the body goes. Else the body moves as an overdamped one
(:mod:`.motion`), under loads that are a little larger until it rests, in steps that are halved until its end stands.
It sets out with two small forces at random, the one against the other: where they lead to two ends, the jump has
several ways, and that is taken which releases most. What is found in no motion is looked for by descent, in steps that
are as long as they may be. Where all of these lead out of reach, a body comes off. Bonds remember on the way.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, magnitude
from .branch import Branch, Refused, StepEnd, advancing
from .motion import OverdampedMotion
from .statuses import Kept
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Where a body went.

    Attributes:
        way: how that was found.
        z: the coordinates of a stable equilibrium, (n,); None: the body comes off.
        energy: stored and dissipated there; infinite where it comes off.
        kept: where the points are then.
        inverse: of its equations; None where it is not known.
        branching: whether another way leads elsewhere.
    """

    way: str
    z: Array | None = None
    energy: float = np.inf
    kept: Kept | None = None
    inverse: CellInverse | None = None
    branching: bool = False


class Jump:
    """A jump from a state.

    Args:
        problem: the problem.
        branch: it is at the state; after the jump its points are where they are then.
        heading: 1 where larger factors are wanted, -1 where smaller ones are.
        held: whether there is an equilibrium at these loads whatever the bonds remember, so that no way leads off.
        energy: what is stored and dissipated, from the coordinates of the points.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        branch: Branch,
        heading: int,
        *,
        held: bool,
        energy: Callable[[Array], float],
    ) -> None:
        self._problem, self._branch, self._points = problem, branch, branch.points
        self._factor, self._heading, self._held, self._energy = branch.factor, heading, held, energy
        self._z, self._directions, self._kept = branch.z.copy(), branch.directions.copy(), branch.points.kept()

    def landing(self) -> Landing | None:
        """Where it leads; None where this was not found, with the points where they were."""
        found = (None if self._several_lead() else self._along()) or self._in_motion()
        if found is None or found.z is None:
            found = self._moved("by descent", np.inf, 1.0) or found
        self._points.restore(self._kept if found is None or found.kept is None else found.kept)
        return found

    def _several_lead(self) -> bool:
        """Whether several points that move are at ends of their segments: then the curve takes them in any order."""
        ends, speeds = np.stack([self._points.low, self._points.high]), np.abs(self._directions)
        sizes = np.max(np.where(np.isfinite(ends), np.abs(ends), 0.0), axis=0, initial=0.0)
        there = np.min(np.abs(ends - self._branch.values.s), axis=0) <= DEFAULT.none * sizes
        return bool(np.count_nonzero(there & (speeds > DEFAULT.slow * magnitude(speeds))) > 1)

    def _along(self) -> Landing | None:
        """The next state along the curve that bears more than these loads, if one unstable direction leads there."""
        branch, rate, found, released = self._branch, self._problem.force_rate, None, 0.0
        beyond = self._factor + self._heading * DEFAULT.slow * abs(self._factor)
        with suppress(Refused, np.linalg.LinAlgError):
            for _ in range(DEFAULT.waits * (2 + len(self._points))):
                before, x = branch.factor, branch.values.x
                move = next(advancing(branch, beyond if found else self._factor, 1))
                branch.note(move)
                released += (self._factor - 0.5 * (before + branch.factor)) * float(rate @ (branch.values.x - x))
                rises, there = self._heading * branch.rising > 0.0, move.outcome is StepEnd.FACTOR
                if found and there:
                    return found
                if rises and there and released > 0.0:
                    found = self._landed("along the curve", branch.z.copy(), branch.inverse())
                found = found if rises else None
                lost = move.outcome in (StepEnd.AWAY, StepEnd.STUCK) or branch.unstable > 1
                if lost or self._heading * (branch.factor - beyond) > 0.0:
                    break
        return None

    def _in_motion(self) -> Landing | None:
        """The end of a motion: the same with either force at random and with shorter steps, or the best of two."""
        first, second = self._moved("in motion", 1.0, 1.0), self._moved("in motion", 0.5, -1.0)
        if first is not None and second is not None and self._are_same(first, second):
            return second
        ends = [end for end in map(self._resolved, (1.0, -1.0)) if end is not None]
        if len(ends) < 2 or self._are_same(*ends):
            return ends[0] if len(ends) == 2 else None
        return replace(min(ends, key=lambda end: end.energy), branching=True)

    def _resolved(self, sign: float) -> Landing | None:
        """The end of a motion whose steps are halved until it stands."""
        last, growth = None, 1.0
        for _ in range(4):
            found = self._moved("in motion", growth, sign)
            if found is not None and last is not None and self._are_same(found, last):
                return found
            last, growth = found, 0.5 * growth
        return None

    def _are_same(self, one: Landing, other: Landing) -> bool:
        if one.z is None or other.z is None:
            return one.z is other.z
        off = magnitude(one.z - other.z)
        return off <= DEFAULT.near * max(magnitude(one.z - self._z), magnitude(other.z - self._z))

    def _moved(self, way: str, growth: float, sign: float) -> Landing | None:
        """The end of one motion, pushed off at first; None where it has none."""
        points, load = self._points, self._problem.load(self._factor)
        rate = self._problem.force_rate
        points.restore(self._kept)
        size = magnitude(load) or magnitude(rate)
        push = self._heading * DEFAULT.slow * size / (magnitude(rate) or 1.0) * rate
        push += sign * DEFAULT.none * size * (points.order[points.point_of] - 1.0)
        motion = OverdampedMotion(self._problem, points, self._z, held=self._held, growth=growth)
        for one in (load + push, load):
            if not motion.run(one, self._directions):
                return None
            if motion.escapes:
                return Landing(way=way)
        return self._landed(way, motion.z)

    def _landed(self, way: str, z: Array, inverse: CellInverse | None = None) -> Landing | None:
        """The landing at a stable equilibrium; None where it is none, or the state itself."""
        values = self._points.values(z)
        size = max(magnitude(values.x), magnitude(self._z))
        if self._points.unstable_directions(values) or magnitude(z - self._z) <= DEFAULT.none * size:
            return None
        return Landing(way=way, z=z, energy=self._energy(z), kept=self._points.kept(), inverse=inverse)
