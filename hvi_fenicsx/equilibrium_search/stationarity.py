"""Whether a point is stationary, and whether it is a minimiser: arrays only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array, Integers, Mask, magnitude
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


class Kind(StrEnum):
    """What a stationary point is."""

    MINIMISER = "minimiser"
    SADDLE = "saddle"
    UNDECIDED = "undecided"


@dataclass(frozen=True, kw_only=True)
class Subdifferential:
    """What the laws and bounds allow at a point, and what they do.

    Attributes:
        low: least force, -inf at a lower bound, (n,).
        high: largest force, (n,).
        falls: whether the traction drops there, (n,).
        least: slope of the traction, the smaller one at a joint, (n,).
        most: the larger one, (n,).
    """

    low: Array
    high: Array
    falls: Mask
    least: Array
    most: Array


def subdifferential(problem: ScalarProblem, x: Array) -> Subdifferential:
    """∂φ and bounds at a point.

    Args:
        problem: the problem, without laws of lengths.
        x: the point, (n,).
    """
    arcs, accuracy = problem.arcs, LIMITS.accuracy
    near = accuracy * (1.0 + magnitude(x))
    here = (arcs.low <= x[:, None] + near) & (arcs.high >= x[:, None] - near)
    at = np.clip(x[:, None], np.where(here, arcs.low, -np.inf), np.where(here, arcs.high, np.inf))
    t = arcs.tractions + arcs.slopes * (at - arcs.anchors)
    drop = here[:, :-1] & here[:, 1:] & (t[:, :-1] - t[:, 1:] > accuracy * problem.force_size)
    laws = Subdifferential(
        low=np.where(here, t, np.inf).min(axis=1),
        high=np.where(here, t, -np.inf).max(axis=1),
        falls=np.any(drop, axis=1),
        least=np.where(here, arcs.slopes, np.inf).min(axis=1),
        most=np.where(here, arcs.slopes, -np.inf).max(axis=1),
    )
    return with_bounds(problem, x, laws)


def with_bounds(problem: ScalarProblem, x: Array, laws: Subdifferential) -> Subdifferential:
    """What laws and bounds allow at a point; a drop that a bound keeps the unknown on is none.

    Args:
        problem: the stiffness, the force and the bounds.
        x: the point, (n,).
        laws: what the laws allow there.
    """
    near = LIMITS.accuracy * (1.0 + magnitude(x))
    force = problem.force - problem.stiffness @ x
    below, above = x <= problem.lower + near, x >= problem.upper - near
    kept = (below & above) | (below & (force <= laws.low)) | (above & (force >= laws.high))
    low, high = np.where(below, -np.inf, laws.low), np.where(above, np.inf, laws.high)
    return replace(laws, low=low, high=high, falls=laws.falls & ~kept)


def imbalance(problem: ScalarProblem, x: Array) -> float:
    """The largest force that neither law nor bound can bear, relative to the largest force.

    Args:
        problem: the problem, without laws of lengths.
        x: the point, (n,).
    """
    force, allowed = problem.force - problem.stiffness @ x, subdifferential(problem, x)
    off = np.maximum(np.maximum(allowed.low - force, force - allowed.high), 0.0)
    return float(off.max(initial=0.0) / problem.force_size)


def kind(problem: ScalarProblem, x: Array, here: Subdifferential | None = None) -> Kind:
    """Whether a stationary point is a minimiser.

    On a drop it is none. Else displacements decide that keep those unknowns at their kinks and bounds which bear a
    force strictly inside what these can.

    Args:
        problem: the stiffness, the force and, without laws of lengths, the laws.
        x: a stationary point, (n,).
        here: what the laws and bounds allow there; None: those of the problem.
    """
    here = subdifferential(problem, x) if here is None else here
    if here.falls.any():
        return Kind.SADDLE
    force = problem.force - problem.stiffness @ x
    near = LIMITS.accuracy * max(magnitude(force), 1e-300)
    jumps = here.high - here.low > near
    inside = jumps & (force > here.low + near) & (force < here.high - near)
    surely, perhaps = np.flatnonzero(~jumps), np.flatnonzero(~inside)
    if _definite(problem, perhaps, here.least[perhaps]) > 0:
        return Kind.MINIMISER
    return Kind.SADDLE if _definite(problem, surely, here.most[surely]) < 0 else Kind.UNDECIDED


def _definite(problem: ScalarProblem, free: Integers, slopes: Array) -> int:
    """1: positive definite on these unknowns, 0: singular, -1: not semidefinite."""
    if not free.size:
        return 1
    values = np.linalg.eigvalsh(problem.stiffness[np.ix_(free, free)] + np.diag(slopes))
    size = max(abs(float(values[-1])), float(np.trace(problem.stiffness)) / problem.size)
    limit = LIMITS.zero * size
    return int(values[0] > limit) - int(values[0] < -limit)


@dataclass(frozen=True, kw_only=True)
class StationaryPoint:
    """A point that satisfies the inequality.

    Attributes:
        x: (n,).
        energy: there.
        kind: minimiser, saddle or undecided.
        isolated: False where it is one of a continuum.
    """

    x: Array
    energy: float
    kind: Kind
    isolated: bool = True


class PointList(list[StationaryPoint]):
    """Different points.

    Args:
        same: points nearer than this share of the displacements are one.
    """

    def __init__(self, same: float) -> None:
        self._same = same

    def add(self, point: StationaryPoint | None) -> bool:
        """Put a point at the end, if there is one and it is new; whether it is.

        Args:
            point: the point.
        """
        if point is None:
            return False
        near = self._same * (1.0 + magnitude(point.x))
        new = all(magnitude(p.x - point.x) >= near for p in self)
        if new:
            self.append(point)
        return new


def stationary_point(near: ScalarProblem, problem: CondensedProblem, x: Array) -> StationaryPoint | None:
    """The stationary point of laws of one component near one of their polylines; None where there is none.

    An unknown stays where a jump of its laws or a bound bears the force.

    Args:
        near: the problem with polylines near the laws.
        problem: the problem with the laws, at the load factor 1.
        x: displacements, (n,).
    """
    start, best = x, None
    for _ in range(LIMITS.most_steps):
        force, allowed = near.force - near.stiffness @ x, _subdifferential(near, problem, x)
        rest = force - np.clip(force, allowed.low, allowed.high)
        missing = magnitude(rest)
        if best is not None and missing >= 0.5 * best[0] and best[0] <= LIMITS.accuracy * near.force_size:
            break  # at a fold, where two points are one, a step leaves a quarter of the rest
        best = missing, x, allowed
        free = (allowed.high - allowed.low <= LIMITS.accuracy * near.force_size) | (rest != 0.0)
        matrix = near.stiffness[np.ix_(free, free)] + np.diag(allowed.least[free])
        step = np.zeros(len(x))
        step[free] = np.linalg.lstsq(matrix, rest[free], rcond=None)[0]
        x = np.clip(x + step, near.lower, near.upper)
        if not magnitude(x - start) <= LIMITS.longest * (1.0 + magnitude(start)):
            break
    if best is None or best[0] > LIMITS.accuracy**1.5 * near.force_size:
        return None
    _, x, allowed = best
    return StationaryPoint(x=x, energy=problem.energy(x), kind=kind(near, x, allowed))


def _subdifferential(near: ScalarProblem, problem: CondensedProblem, x: Array) -> Subdifferential:
    """What the laws and bounds allow at a point."""
    close = LIMITS.accuracy * (1.0 + magnitude(x))
    low, high, slope = np.zeros((3, near.size))
    falls = np.zeros(near.size, dtype=np.bool_)
    for bonds in problem.bonds:
        at, argument = bonds.unknowns[:, 0], bonds.argument(x)
        for total, force in zip((low, high), _forces(bonds, argument, close), strict=True):
            np.add.at(total, at, force)
        second = bonds.law.convex.second(argument) - bonds.law.concave.second(argument)
        np.add.at(slope, at, bonds.weights * bonds.signs[:, 0] ** 2 * second)
        for kink in bonds.law.concave.kinks:
            falls[at[(np.abs(argument - kink) <= close) & (bonds.weights > 0.0)]] = True
    laws = Subdifferential(low=low, high=high, falls=falls, least=slope, most=slope)
    return with_bounds(near, x, laws)


def _forces(bonds: Bonds, argument: Array, close: float) -> tuple[Array, Array]:
    """The least and the largest force of each bond."""
    factors = bonds.weights * bonds.signs[:, 0]
    ends = [factors * traction for traction in bonds.law.interval(argument, close)]
    return np.minimum(*ends), np.maximum(*ends)
