"""From a state that is not stable to the next stable equilibrium at the same loads.

It is looked for along the curve of equilibria first: where that turns, falls, and comes back to the loads, with one
unstable direction on its way, and bears more. Else a force t c holds the body back, against the way in which it leaves,
while it goes: the loads f(λ) + t c, t < 0, give a branch of equilibria that begins at the state with t = 0. The energy
falls along it, dE = t cᵀdx, and where t is 0 again is an equilibrium of the loads alone. Where the bonds that are left
cannot bear the load, or such branches of two forces go on for ever with t < 0, a body comes off; with t = 0 it is in
equilibrium wherever it goes. Else the body moves as an overdamped one (:mod:`.motion`). Bonds remember on the way.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, magnitude
from .branch import Branch, Refused, StepEnd, advancing
from .contact_points import ContactPoints
from .curve import branch_from
from .motion import OverdampedMotion
from .thresholds import DEFAULT

WAYS = "along the curve", "held back", "in motion"
"""How the next state is looked for, one after the other."""


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Where a body went.

    Attributes:
        z: the coordinates of a stable equilibrium, (n,); None: the body comes off.
        inverse: of its equations; None where it is not known.
        way: how it was found.
        proven: whether what bonds still bear is less than the load: there is no equilibrium.
    """

    z: Array | None
    inverse: CellInverse | None = None
    way: str = ""
    proven: bool = False


class Jump:
    """A jump from a state.

    Args:
        problem: the problem.
        branch: it is at the state; after the jump its points are where they are then.
        heading: 1 where larger factors are wanted, -1 where smaller ones are.
        held: whether there is an equilibrium at these loads whatever the bonds remember, so that no way leads off.
    """

    def __init__(self, problem: CondensedProblem, branch: Branch, heading: int, *, held: bool) -> None:
        self._problem, self._branch, self._points = problem, branch, branch.points
        self._load, self._heading, self._held = problem.load(branch.factor), heading, held
        self._z, self._values, self._directions = branch.z.copy(), branch.values, branch.directions.copy()

    def landing(self) -> Landing | None:
        """Where it leads; None where this was not found, with the points where they were."""
        kept = self._points.kept()
        for way, found_by in zip(WAYS, (self._along, self._held_back, self._moved), strict=True):
            if (found := found_by()) is not None:
                return replace(found, way=way)
            self._points.restore(kept)
        return None

    def _along(self) -> Landing | None:
        """The next state along the curve that bears more than these loads, if one unstable direction leads there."""
        points, rate, factor = self._points, self._problem.force_rate, self._branch.factor
        branch = branch_from(points, self._problem.force, rate, self._z, factor, self._branch.inverse())
        branch.resume(self._branch.position(0))
        branch.trend, branch.unstable = self._branch.trend, self._branch.unstable
        beyond, released = factor + self._heading * DEFAULT.slow * abs(factor), 0.0
        found, kept = None, points.kept()
        with suppress(Refused, np.linalg.LinAlgError):
            for _ in range(DEFAULT.waits**2):
                before, x = branch.factor, branch.values.x
                move = next(advancing(branch, beyond if found else factor, 1))
                branch.note(move)
                released += (factor - 0.5 * (before + branch.factor)) * float(rate @ (branch.values.x - x))
                rises, there = self._heading * branch.rising > 0.0, move.outcome is StepEnd.FACTOR
                if found and there:
                    points.restore(kept)
                    return found
                if rises and there and released > 0.0:
                    found, kept = self._landed(branch.z.copy(), branch.inverse()), points.kept()
                found = found if rises else None
                lost = move.outcome in (StepEnd.AWAY, StepEnd.STUCK) or branch.unstable > 1
                if lost or self._heading * (branch.factor - beyond) > 0.0:
                    break
        return None

    def _held_back(self) -> Landing | None:
        """The landing of the first restraint whose branch leads to one; off where it is proven, or two lead off."""
        kept, off = self._points.kept(), None
        for restraint, k in _restraints(self._branch):
            found = None
            with suppress(Refused, np.linalg.LinAlgError):
                found = self._restrained(restraint, k)
            if found is not None and (found.z is not None or found.proven or off is not None):
                return found
            off = found or off
            self._points.restore(kept)
        return None

    def _restrained(self, restraint: Array, k: int) -> Landing | None:
        """The landing of the branch along which a restraint grows at first; None where none is found."""
        points, inverse = self._points, self._branch.inverse()
        restraint = points.unresisted(self._values, restraint).balanced * float(np.mean(points.forces))
        branch = branch_from(points, self._load, restraint, self._z, 0.0, inverse)
        branch.set_out(-1.0)
        back = points.straight and branch.directions[k] * self._directions[k] <= 0.0
        if back or branch.rising > DEFAULT.undecided:
            return None
        forces = self._load, self._values.force
        largest = max(magnitude(force) for force in forces)
        none = DEFAULT.none * largest / magnitude(restraint)
        return self._at_its_end(branch, none)

    def _at_its_end(self, branch: Branch, none: float) -> Landing | None:
        standing, x = 0, self._values.x
        most = DEFAULT.waits * (2 + len(self._points) * self._points.straight)
        for move in advancing(branch, 0.0, most):
            if self._points.straight and self._points.are_outdone(branch.values, self._load, branch.motion):
                return Landing(z=None, proven=True)
            stands = self._points.straight and np.allclose(branch.values.x, x, rtol=1e-12, atol=0.0)
            standing, x = standing + 1 if stands else 0, branch.values.x
            anywhere = move.outcome is StepEnd.AWAY and abs(branch.factor) <= none
            back = move.outcome is StepEnd.FACTOR and branch.rising > 0.0  # else it has only set out, but for rounding
            # it set out from its aim, which a long first step passes unseen
            passed = move.outcome is StepEnd.STEP and branch.factor > none and branch.rising > 0.0
            if back or anywhere or passed:
                z, inverse = (branch.balanced(0.0), None) if passed else (branch.z.copy(), branch.inverse())
                stable = self._points.unstable_directions(self._points.values(z)) == 0
                return self._landed(z, inverse) if stable else None
            if move.outcome is StepEnd.AWAY:
                off = branch.stands and branch.factor < 0.0 and not self._held
                return Landing(z=None) if off else None
            lost = move.outcome is StepEnd.STUCK or branch.factor > none
            if lost or standing > DEFAULT.waits + 4 * len(self._points):
                return None
        return None

    def _landed(self, z: Array, inverse: CellInverse | None = None) -> Landing | None:
        """The landing at a stable equilibrium; None where it is the state itself, or a curve leads back from there."""
        x, before = self._points.values(z).x, self._values.x
        size = max(magnitude(x), magnitude(before))
        if magnitude(x - before) <= DEFAULT.none * size:
            return None
        return Landing(z=z, inverse=inverse) if self._points.straight or self._leads_on(z) else None

    def _leads_on(self, z: Array) -> bool:
        """Whether a way leads from a state to wanted loads."""
        kept, rate, leads_on = self._points.kept(), self._heading * self._problem.force_rate, False
        onward = branch_from(self._points, self._load, rate, z, 0.0)
        with suppress(Refused, np.linalg.LinAlgError):
            onward.set_out(1.0)
            leads_on = onward.rising >= 0.0 and not np.any(self._points.unresisted(onward.values, rate).driven)
        self._points.restore(kept)
        return leads_on

    def _moved(self) -> Landing | None:
        """The landing of overdamped motions, under loads that are larger at first: many bonds may end together."""
        rate, z = self._problem.force_rate, self._z
        push = DEFAULT.slow * self._heading * magnitude(self._load) / np.max(np.abs(rate), initial=1e-300) * rate
        for load in (self._load + push, self._load):
            motion = OverdampedMotion(self._problem, self._points, z, load, held=self._held)
            if not motion.run(self._directions):
                return None
            if motion.escapes:
                return Landing(z=None)
            z = motion.z
        return self._landed(z)


def _restraints(branch: Branch) -> Iterator[tuple[Array, int]]:
    """Forces against the ways in which a body may leave, of size 1, and the point that leads.

    They are even on all bonds that move, as the motion is, and on one point alone.
    """
    points, seen = branch.points, list[Array]()
    for motion, k in branch.leaving():
        size = magnitude(motion)
        if size == 0.0:
            continue
        alone, group = np.zeros_like(motion), points.unknowns[k]
        alone[group] = motion[group]
        for force in (_evened(points, motion, size), motion, alone):
            found = force / (magnitude(force) or 1.0)
            known = any(np.allclose(found, other, rtol=0.0, atol=DEFAULT.slow) for other in seen)
            if np.any(found) and not known:
                seen.append(found)
                yield found, k


def _evened(points: ContactPoints, motion: Array, size: float) -> Array:
    """Forces in the direction of a motion, of the size of each point's area."""
    found = np.zeros_like(motion)
    for laws, unknowns in zip(points.laws, points.unknowns, strict=True):
        own = float(np.linalg.norm(motion[unknowns]))
        if laws and own > DEFAULT.slow * size:
            found[unknowns] = sum(law.weight for law in laws) * motion[unknowns] / own
    return found
