"""From a state that is not stable to the next stable equilibrium at the same loads.

As on an exact path (:mod:`..snap`): a force t c holds the body back while it goes; the loads f(λ) + t c, t < 0, give a
curve of equilibria along which the energy falls, and where t is 0 again is an equilibrium of the loads alone. Where no
such curve leads to an end soon, the body moves as an overdamped one (:mod:`.relaxation`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array, Integers
from .curve import Curve
from .energies import displacement_rate
from .equations import Place, Refused
from .events import Outcome
from .passage import Crossing, advancing, set_out
from .relaxation import Relaxation
from .sites import Sites


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Where a body went.

    Attributes:
        z: the coordinates of a stable equilibrium, (n,); None: the body comes off.
    """

    z: Array | None


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A jump from a state.

    Attributes:
        problem: the problem.
        sites: where they are; after the jump, where they are then.
        here: the state, and where its curve goes on.
        load: f, (n,).
        heading: 1 where larger factors are wanted, -1 where smaller ones are.
        lag: an order of the sites, (m,).
        held: whether there is an equilibrium at these loads whatever the bonds remember, so that no way leads off.
        step: called before each step; it may end the jump by an exception.
    """

    problem: CondensedProblem
    sites: Sites
    here: Place
    load: Array
    heading: int
    lag: Array
    held: bool
    step: Callable[[], None]

    def landing(self) -> Landing | None:
        """Where it leads; None where this was not found, with the sites where they were."""
        limits = self.sites.thresholds.jump
        ways: list[Callable[[], Landing | None]] = [
            lambda: self._held_back(limits.steps),
            self._released,
            self._pushed_off,
            lambda: self._held_back(limits.steps + limits.later_steps * len(self.sites)),
        ]
        kept = self.sites.kept()
        for way in ways:
            found = way()
            if found is not None:
                return found
            self.sites.restore(kept)
        return None

    def _held_back(self, most: int) -> Landing | None:
        """The landing of the first restraint whose curve leads to an end in so many steps."""
        kept = self.sites.kept()
        for restraint in _restraints(self.problem, self.sites, self.here):
            tried: list[Array] = []
            for row in _starts(self.here):
                with suppress(Refused, np.linalg.LinAlgError):
                    found = self._followed(restraint, row, most, tried)
                    if found is not None:
                        return found
                self.sites.restore(kept)
        return None

    def _followed(self, restraint: Array, row: Array, most: int, tried: list[Array]) -> Landing | None:
        """Along the curve of one restraint in a direction that was not tried; None where it leads to no end."""
        sites = self.sites
        restraint = sites.unresisted(self.here.values, restraint).balanced
        curve = Curve(self.load, restraint * float(np.mean(sites.forces)), sites, self.here.y[:-1].copy(), 0.0)
        curve.head(row)
        tangent = curve.here.tangent
        if any(np.allclose(tangent, other, rtol=0.0, atol=curve.limits.rounding) for other in tried):
            return None
        tried.append(tangent)
        if curve.factor_rate > 1e-7:
            return None
        Crossing(curve, self.lag, self.step).run()
        return self._to_its_end(curve, most)

    def _to_its_end(self, curve: Curve, most: int) -> Landing | None:
        for move in advancing(curve, 0.0, self.lag, self.step, most):
            anywhere = move.outcome is Outcome.AWAY and abs(curve.here.y[-1]) <= 1e-9
            if move.outcome is Outcome.FACTOR or anywhere:
                stable = curve.sites.unstable_directions(curve.here.values) == 0
                return self._landed(curve.here.y[:-1]) if stable else None
            if move.outcome is Outcome.AWAY:
                off = abs(curve.factor_rate) <= 1e-6 and curve.here.y[-1] < 0.0 and not self.held
                return Landing(z=None) if off else None
            if move.outcome is Outcome.STUCK or curve.here.y[-1] > 1e-9:
                return None
        return None

    def _landed(self, z: Array) -> Landing | None:
        """The landing at a stable equilibrium; None where it is the state itself, or no way leads to wanted loads."""
        if float(np.max(np.abs(z - self.here.y[:-1]), initial=0.0)) <= 1e-9:
            return None
        kept = self.sites.kept()
        rate, leads_on = self.heading * self.problem.force_rate, False
        curve = Curve(self.load, rate, self.sites, z.copy(), 0.0)
        with suppress(Refused, np.linalg.LinAlgError):
            set_out(curve, 1.0, self.lag, self.step)
            driven = self.sites.unresisted(curve.here.values, rate).driven
            leads_on = curve.factor_rate >= 0.0 and not np.any(driven)
        self.sites.restore(kept)
        return Landing(z=z) if leads_on else None

    def _released(self) -> Landing | None:
        """The landing of an overdamped motion."""
        start = self.here.y[:-1] if self.sites.on_drops() else self._beyond()
        return self._come_to_rest(start, self._directions())

    def _come_to_rest(self, z: Array, directions: Array) -> Landing | None:
        found = self._relaxed(z, self.load, directions)
        return found if found is None or found.z is None else self._landed(found.z)

    def _directions(self) -> Array:
        """In which the sites go along the path, (m,)."""
        return self.sites.rates(self.here.y[:-1], self.here.tangent[:-1])

    def _beyond(self) -> Array:
        """A little farther along the path, where the loads are smaller than those that act."""
        curve = Curve(self.problem.force, self.problem.force_rate, self.sites, self.here.y[:-1].copy(), 0.0)
        curve.place(self.here.y.copy(), self.here.tangent)
        curve.length = self.sites.thresholds.jump.beyond
        return curve.advance(np.inf).after.y[:-1]

    def _relaxed(self, z: Array, load: Array, directions: Array) -> Landing | None:
        relaxation = Relaxation(self.problem, self.sites, z, load, self.lag, held=self.held, step=self.step)
        if not relaxation.run(directions):
            return None
        return Landing(z=None if relaxation.escapes else relaxation.z)

    def _pushed_off(self) -> Landing | None:
        """The landing under loads that are larger at first: where many bonds reach an end together, the body rests."""
        rate, directions = self.problem.force_rate, self._directions()
        push = self.sites.thresholds.jump.push * self.heading
        push = push * np.max(np.abs(self.load)) / np.max(np.abs(rate), initial=1e-300)
        found = self._relaxed(self.here.y[:-1].copy(), self.load + push * rate, directions)
        if found is None or found.z is None:
            return found
        return self._come_to_rest(found.z, directions)


def _starts(here: Place) -> Iterator[Array]:
    """Linear functions that grow on the way: along the curve, or against the restraint."""
    along = here.tangent.copy()
    along[-1] = 0.0
    yield along
    against = np.zeros_like(along)
    against[-1] = -1.0
    yield against


def _restraints(problem: CondensedProblem, sites: Sites, here: Place) -> Iterator[Array]:
    """Forces against the motion: of equal size on all bonds that move, as the motion is, on one site."""
    path, groups = displacement_rate(sites, here), sites.unknowns()
    for motion in _motions(problem, sites, here, path):
        yield _evened(sites, motion)
        yield motion
        sizes = [float(np.max(np.abs(motion[group]))) for group in groups]
        for k in sites.on_drops() or [int(np.argmax(sizes))]:
            yield _alone(groups[k], motion)


def _alone(unknowns: Integers, motion: Array) -> Array:
    """The motion of some unknowns alone, of size 1."""
    found = np.zeros_like(motion)
    found[unknowns] = motion[unknowns]
    return np.asarray(found / (np.max(np.abs(found)) or 1.0))


def _motions(problem: CondensedProblem, sites: Sites, here: Place, path: Array) -> Iterator[Array]:
    """Motions in which the energy may fall, of size 1.

    Where many sites are at ends of their segments, the lowest one may lead on in the sense that leaves the cell.
    """
    drops = sites.on_drops()
    if drops:
        found = [_after_drops(problem, sites, here, drops), path]
    elif (lowest := _lowest(sites, here)) is not None:
        lowest *= np.sign(_into_cell(sites, here, lowest) or float(lowest @ path)) or 1.0
        found = [lowest, path, -lowest]
    else:
        found = [path]
    seen: list[Array] = []
    same = sites.thresholds.jump.same
    for motion in found:
        size = float(np.max(np.abs(motion), initial=0.0))
        if size and not any(np.allclose(motion / size, other, rtol=0.0, atol=same) for other in seen):
            seen.append(np.asarray(motion / size))
            yield seen[-1]


def _into_cell(sites: Sites, here: Place, motion: Array) -> float:
    """How far a motion takes the sites at ends of their segments into these; 0 where there are none."""
    s, moves = here.values.s, here.values.moves > 0.0
    allowed = sites.allowances(
        here.values, sites.rates(here.y[:-1], here.tangent[:-1]), float(np.max(np.abs(here.tangent)))
    )
    low, high = moves & (s <= sites.low + allowed), moves & (s >= sites.high - allowed)
    return float((low * 1.0 - high) @ sites.along(here.values, motion))


def _after_drops(problem: CondensedProblem, sites: Sites, here: Place, drops: list[int]) -> Array:
    """How a body moves when sites on drops go on: these outwards, all others follow."""
    motion, groups = np.zeros(problem.size), sites.unknowns()
    rates = sites.rates(here.y[:-1], here.tangent[:-1])
    for k in drops:
        p = sites.radial(k)
        way = 1.0 if p is None else here.values.directions[sites.radials.owner == p]
        motion[groups[k]] = (np.sign(rates[k]) or 1.0) * way
    free = sites.motions(here.values)
    if len(free.slopes):
        motion -= free.ways.T @ np.linalg.lstsq(free.matrix, free.ways @ (problem.stiffness @ motion))[0]
    return motion


def _lowest(sites: Sites, here: Place) -> Array | None:
    """The motion in which the energy falls most."""
    free = sites.motions(here.values)
    if not len(free.slopes):
        return None
    _, vectors = np.linalg.eigh(free.matrix)
    found = free.ways.T @ vectors[:, 0]
    return np.asarray(found / np.max(np.abs(found)))


def _evened(sites: Sites, motion: Array) -> Array:
    """Forces in the direction of a motion, of the size of each site's area."""
    found = np.zeros_like(motion)
    for several, unknowns in zip(sites.laws, sites.unknowns(), strict=True):
        size = float(np.linalg.norm(motion[unknowns]))
        if several and size > 1e-6:
            found[unknowns] = sum(law.weight for law in several) * motion[unknowns] / size
    largest = float(np.max(np.abs(found), initial=0.0))
    return np.asarray(found / largest) if largest else motion
