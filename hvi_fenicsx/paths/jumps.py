"""From a state that is not stable to the next stable equilibrium at the same loads.

A force t c holds the body back, against the unstable direction, while it goes: the loads f(λ) + t c, t < 0, give a
branch of equilibria that begins at the state with t = 0. The energy falls along it, dE = t cᵀdx, and where t is 0 again
is an equilibrium of the loads alone. Where the branch goes on for ever with t < 0 a body comes off; with t = 0 it is in
equilibrium wherever it goes. Where no such branch leads to an end soon, the body moves as an overdamped one
(:mod:`.motion`). Bonds remember on the way.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, Integers
from .branch import Branch, Outcome, Refused, advancing
from .branching import branch_from
from .curve import Curve
from .equations import Place
from .events import displacement_rate
from .motion import Relaxation
from .passages import Crossing
from .pivoting import StraightBranch
from .relations import ContactPoints


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Where a body went.

    Attributes:
        z: the coordinates of a stable equilibrium, (n,); None: the body comes off.
        inverse: of its equations; None where it is not known.
    """

    z: Array | None
    inverse: CellInverse | None = None


class Jump(ABC):
    """A jump from a state.

    Args:
        problem: the problem.
        branch: it is at the state; after the jump its points are where they are then.
        heading: 1 where larger factors are wanted, -1 where smaller ones are.
        held: whether there is an equilibrium at these loads whatever the bonds remember, so that no way leads off.
        step: called before each step; it may end the jump by an exception.
    """

    def __init__(
        self, problem: CondensedProblem, branch: Branch, heading: int, held: bool, step: Callable[[], None]
    ) -> None:
        self._problem, self._branch, self._points = problem, branch, branch.points
        self._load, self._heading, self._held, self._step = problem.load(branch.factor), heading, held, step
        self._z, self._directions = branch.z.copy(), branch.directions.copy()
        self._x = branch.values.x.copy()
        self._tried: list[Array] = []

    def landing(self) -> Landing | None:
        """Where it leads; None where this was not found, with the points where they were."""
        limits, kept = self._points.thresholds, self._points.kept()
        many = limits.many + limits.waits * len(self._points)
        first, later = (many, 0) if self._points.straight else (limits.many, many)
        ways: list[Callable[[], Landing | None]] = [
            lambda: self._held_back(first),
            self._released,
            self._pushed_off,
            lambda: self._held_back(later),
        ]
        for way in ways:
            found = way()
            if found is not None:
                return found
            self._points.restore(kept)
        return None

    @abstractmethod
    def _restrained(self) -> Iterator[Branch]:
        """Branches along which a restraint grows at first; the points are where they were before each of them."""

    def _held_back(self, most: int) -> Landing | None:
        """The landing of the first restraint whose branch leads to an end in so many steps."""
        kept = self._points.kept()
        for branch in self._restrained() if most else ():
            with suppress(Refused, np.linalg.LinAlgError):
                found = self._to_its_end(branch, most)
                if found is not None:
                    return found
            self._points.restore(kept)
        return None

    def _to_its_end(self, branch: Branch, most: int) -> Landing | None:
        none, standing, x = self._none(branch), 0, self._x
        for move in advancing(branch, 0.0, self._step, most):
            stands = self._points.straight and np.allclose(branch.values.x, x, rtol=1e-12, atol=0.0)
            standing, x = standing + 1 if stands else 0, branch.values.x
            anywhere = move.outcome is Outcome.AWAY and abs(branch.factor) <= none
            if move.outcome is Outcome.FACTOR or anywhere:
                stable = self._points.unstable_directions(branch.values) == 0
                return self._landed(branch.z.copy(), branch) if stable else None
            if move.outcome is Outcome.AWAY:
                off = branch.stands and branch.factor < 0.0 and not self._held
                return Landing(z=None) if off else None
            if move.outcome is Outcome.STUCK or branch.factor > none or standing > self._most_standing:
                return None
        return None

    @property
    def _most_standing(self) -> int:
        return self._points.thresholds.waits + 4 * len(self._points)

    @abstractmethod
    def _none(self, branch: Branch) -> float:
        """A restraint that is none."""

    def _landed(self, z: Array, branch: Branch | None = None) -> Landing | None:
        """The landing at a stable equilibrium; None where it is the state itself."""
        x = self._points.values(z).x
        size = max(float(np.max(np.abs(x), initial=0.0)), float(np.max(np.abs(self._x), initial=0.0)))
        if float(np.max(np.abs(x - self._x), initial=0.0)) <= 1e-9 * size:
            return None
        return Landing(z=z, inverse=None if branch is None else branch.inverse())

    def _released(self) -> Landing | None:
        """The landing of an overdamped motion."""
        start = self._z if self._points.on_drops() else self._beyond()
        return self._come_to_rest(start)

    @abstractmethod
    def _beyond(self) -> Array:
        """A little farther along the path, where the loads are smaller than those that act."""

    def _come_to_rest(self, z: Array) -> Landing | None:
        found = self._relaxed(z, self._load)
        return found if found is None or found.z is None else self._landed(found.z)

    def _relaxed(self, z: Array, load: Array) -> Landing | None:
        relaxation = Relaxation(self._problem, self._points, z, load, held=self._held, step=self._step)
        if not relaxation.run(self._directions):
            return None
        return Landing(z=None if relaxation.escapes else relaxation.z)

    def _pushed_off(self) -> Landing | None:
        """The landing under loads that are larger at first: where many bonds reach an end together, the body rests."""
        rate = self._problem.force_rate
        push = self._points.thresholds.slow * self._heading
        push = push * np.max(np.abs(self._load)) / np.max(np.abs(rate), initial=1e-300)
        found = self._relaxed(self._z.copy(), self._load + push * rate)
        return found if found is None or found.z is None else self._come_to_rest(found.z)


class StraightJump(Jump):
    """A jump of points on straight segments."""

    @override
    def _restrained(self) -> Iterator[Branch]:
        path = self._branch
        assert isinstance(path, StraightBranch)
        moved, direction = path.leader
        with suppress(np.linalg.LinAlgError):
            inverse = path.inverse() or path.state.inverse()
            for tried in _restraints_of(path, inverse):
                restraint = self._points.unresisted(path.values, tried).balanced
                with suppress(np.linalg.LinAlgError):
                    branch = StraightBranch(
                        self._points, self._load, restraint, self._z, 0.0, inverse=inverse, heading=-1
                    )
                    if branch.rates[moved] * direction > 0.0:
                        yield branch

    @override
    def _none(self, branch: Branch) -> float:
        return self._points.thresholds.none * float(np.max(np.abs(self._load), initial=0.0))

    @override
    def _beyond(self) -> Array:
        assert isinstance(self._branch, StraightBranch)
        return self._branch.beyond(self._points.thresholds.near)


def _restraints_of(path: StraightBranch, inverse: CellInverse) -> Iterator[Array]:
    """Forces against the unstable direction, of size 1: equal on all bonds that it moves, as it is, on one point."""
    points, (moved, direction) = path.points, path.leader
    own, free, rise = np.eye(1, len(points), moved)[0], points.moving, float(points.rise[moved])
    if rise:  # on a drop: the point goes on, and all others follow
        way = direction if rise < 0.0 else direction * rise
        pull = np.where(free, -way * points.elastic.column(moved), 0.0)
        unstable = np.where(free, inverse.solve(pull), way * own)
    else:
        unstable = path.state.softest(inverse, own)
        unstable *= np.sign(unstable[moved]) * direction or 1.0
    size = float(np.max(np.abs(unstable), initial=0.0))
    if size == 0.0:
        return
    even = _weights(points) * np.sign(np.where(np.abs(unstable) > 1e-6 * size, unstable, 0.0))
    if np.any(even):
        yield np.asarray(even / np.max(np.abs(even)))
    yield np.asarray(unstable / size)
    yield own * direction


def _weights(points: ContactPoints) -> Array:
    """The areas of all points, (m,)."""
    return np.array([sum(law.weight for law in several) for several in points.laws], dtype=np.float64)


class CurvedJump(Jump):
    """A jump of points of which some are on curved graphs."""

    @property
    def _here(self) -> Place:
        assert isinstance(self._branch, Curve)
        return self._branch.here

    @override
    def _restrained(self) -> Iterator[Branch]:
        for restraint in _restraints(self._problem, self._points, self._here):
            self._tried = []
            for row in _starts(self._here):
                with suppress(Refused, np.linalg.LinAlgError):
                    curve = self._set_out(restraint, row)
                    if curve is not None:
                        yield curve

    def _set_out(self, restraint: Array, row: Array) -> Curve | None:
        """The branch of one restraint in a direction that was not tried; None where there is none."""
        points = self._points
        restraint = points.unresisted(self._here.values, restraint).balanced
        curve = Curve(self._load, restraint * float(np.mean(points.forces)), points, self._z.copy(), 0.0)
        curve.head(row)
        tangent = curve.here.tangent
        if any(np.allclose(tangent, other, rtol=0.0, atol=curve.limits.reached) for other in self._tried):
            return None
        self._tried.append(tangent)
        if curve.rising > 1e-7:
            return None
        Crossing(curve, self._step).run()
        return curve

    @override
    def _none(self, branch: Branch) -> float:
        assert isinstance(branch, Curve)
        return 1e-9 * branch.unit

    @override
    def _landed(self, z: Array, branch: Branch | None = None) -> Landing | None:
        """None as well where no way leads from there to wanted loads."""
        if super()._landed(z) is None:
            return None
        kept = self._points.kept()
        rate, leads_on = self._heading * self._problem.force_rate, False
        onward = branch_from(self._points, self._load, rate, z, 0.0)
        with suppress(Refused, np.linalg.LinAlgError):
            onward.set_out(1.0, self._step)
            driven = self._points.unresisted(onward.values, rate).driven
            leads_on = onward.rising >= 0.0 and not np.any(driven)
        self._points.restore(kept)
        return Landing(z=z) if leads_on else None

    @override
    def _beyond(self) -> Array:
        curve = Curve(self._problem.force, self._problem.force_rate, self._points, self._z.copy(), 0.0)
        curve.place(self._here.y.copy(), self._here.tangent)
        curve.length = self._points.thresholds.near
        return curve.advance(np.inf).after.y[:-1]


def jump_from(
    problem: CondensedProblem, branch: Branch, heading: int, *, held: bool, step: Callable[[], None]
) -> Landing | None:
    """Where a jump from a state leads; None where this was not found, with the points where they were.

    Args:
        problem: the problem.
        branch: it is at the state; after the jump its points are where they are then.
        heading: 1 where larger factors are wanted, -1 where smaller ones are.
        held: whether there is an equilibrium at these loads whatever the bonds remember, so that no way leads off.
        step: called before each step; it may end the jump by an exception.
    """
    kind = StraightJump if branch.points.straight else CurvedJump
    return kind(problem, branch, heading, held, step).landing()


def _starts(here: Place) -> Iterator[Array]:
    """Linear functions that grow on the way: along the curve, or against the restraint."""
    along = here.tangent.copy()
    along[-1] = 0.0
    yield along
    against = np.zeros_like(along)
    against[-1] = -1.0
    yield against


def _restraints(problem: CondensedProblem, points: ContactPoints, here: Place) -> Iterator[Array]:
    """Forces against the motion: of equal size on all bonds that move, as the motion is, on one point."""
    path, groups = displacement_rate(points, here), points.unknowns()
    for motion in _motions(problem, points, here, path):
        yield _evened(points, motion)
        yield motion
        sizes = [float(np.max(np.abs(motion[group]))) for group in groups]
        for k in points.on_drops() or [int(np.argmax(sizes))]:
            yield _alone(groups[k], motion)


def _alone(unknowns: Integers, motion: Array) -> Array:
    """The motion of some unknowns alone, of size 1."""
    found = np.zeros_like(motion)
    found[unknowns] = motion[unknowns]
    return np.asarray(found / (np.max(np.abs(found)) or 1.0))


def _motions(problem: CondensedProblem, points: ContactPoints, here: Place, path: Array) -> Iterator[Array]:
    """Motions in which the energy may fall, of size 1.

    Where many points are at ends of their segments, the lowest one may lead on in the sense that leaves the cell.
    """
    drops = points.on_drops()
    if drops:
        found = [_after_drops(problem, points, here, drops), path]
    elif (lowest := _lowest(points, here)) is not None:
        lowest *= np.sign(_into_cell(points, here, lowest) or float(lowest @ path)) or 1.0
        found = [lowest, path, -lowest]
    else:
        found = [path]
    seen: list[Array] = []
    same = points.thresholds.small
    for motion in found:
        size = float(np.max(np.abs(motion), initial=0.0))
        if size and not any(np.allclose(motion / size, other, rtol=0.0, atol=same) for other in seen):
            seen.append(np.asarray(motion / size))
            yield seen[-1]


def _into_cell(points: ContactPoints, here: Place, motion: Array) -> float:
    """How far a motion takes the points at ends of their segments into these; 0 where there are none."""
    s, moves = here.values.s, here.values.moves > 0.0
    allowed = points.allowances(
        here.values, points.rates(here.y[:-1], here.tangent[:-1]), float(np.max(np.abs(here.tangent)))
    )
    low, high = moves & (s <= points.low + allowed), moves & (s >= points.high - allowed)
    return float((low * 1.0 - high) @ points.along(here.values, motion))


def _after_drops(problem: CondensedProblem, points: ContactPoints, here: Place, drops: list[int]) -> Array:
    """How a body moves when points on drops go on: these outwards, all others follow."""
    motion, groups = np.zeros(problem.size), points.unknowns()
    rates = points.rates(here.y[:-1], here.tangent[:-1])
    for k in drops:
        p = points.radial(k)
        way = 1.0 if p is None else here.values.directions[points.vectors.owner == p]
        motion[groups[k]] = (np.sign(rates[k]) or 1.0) * way
    free = points.motions(here.values)
    if len(free.slopes):
        motion -= free.ways.T @ np.linalg.lstsq(free.matrix, free.ways @ (problem.stiffness @ motion))[0]
    return motion


def _lowest(points: ContactPoints, here: Place) -> Array | None:
    """The motion in which the energy falls most."""
    free = points.motions(here.values)
    if not len(free.slopes):
        return None
    _, vectors = np.linalg.eigh(free.matrix)
    found = free.ways.T @ vectors[:, 0]
    return np.asarray(found / np.max(np.abs(found)))


def _evened(points: ContactPoints, motion: Array) -> Array:
    """Forces in the direction of a motion, of the size of each point's area."""
    found = np.zeros_like(motion)
    for several, unknowns in zip(points.laws, points.unknowns(), strict=True):
        size = float(np.linalg.norm(motion[unknowns]))
        if several and size > 1e-6:
            found[unknowns] = sum(law.weight for law in several) * motion[unknowns] / size
    largest = float(np.max(np.abs(found), initial=0.0))
    return np.asarray(found / largest) if largest else motion
