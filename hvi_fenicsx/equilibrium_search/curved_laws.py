"""Stationary points of curved laws: Newton's method on the laws themselves."""

from __future__ import annotations

import numpy as np

from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array
from . import stationarity
from .scalar_problem import ScalarProblem
from .stationarity import StationaryPoint, Subdifferential


def stationary_point(near: ScalarProblem, problem: CondensedProblem, x: Array) -> StationaryPoint | None:
    """The stationary point of laws of one component near one of their polylines; None where there is none.

    An unknown stays where a jump of its laws or a bound bears the force.

    Args:
        near: the problem with polylines near the laws.
        problem: the problem with the laws, at the load factor 1.
        x: displacements, (n,).
    """
    start, best, limits = x, None, near.thresholds.points
    for _ in range(near.thresholds.programmes.most_steps):
        force, allowed = near.force - near.stiffness @ x, _subdifferential(near, problem, x)
        rest = force - np.clip(force, allowed.low, allowed.high)
        missing = float(np.max(np.abs(rest), initial=0.0))
        if best is not None and missing >= 0.5 * best[0] and best[0] <= limits.accuracy * near.force_size:
            break  # at a fold, where two points are one, a step leaves a quarter of the rest
        best = missing, x, allowed
        free = (allowed.high - allowed.low <= limits.accuracy * near.force_size) | (rest != 0.0)
        matrix = near.stiffness[np.ix_(free, free)] + np.diag(allowed.least[free])
        step = np.zeros(len(x))
        step[free] = np.linalg.lstsq(matrix, rest[free], rcond=None)[0]
        x = np.clip(x + step, near.lower, near.upper)
        if not np.max(np.abs(x - start)) <= limits.longest * (1.0 + np.max(np.abs(start))):
            break
    if best is None or best[0] > limits.accuracy**1.5 * near.force_size:
        return None
    _, x, allowed = best
    return StationaryPoint(x=x, energy=problem.energy(x), kind=stationarity.kind(near, x, allowed))


def _subdifferential(near: ScalarProblem, problem: CondensedProblem, x: Array) -> Subdifferential:
    """What the laws and bounds allow at a point."""
    close = near.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
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
    return stationarity.with_bounds(near, x, laws)


def _forces(bonds: Bonds, argument: Array, close: float) -> tuple[Array, Array]:
    """The least and the largest force of each bond."""
    factors = bonds.weights * bonds.signs[:, 0]
    ends = [factors * traction for traction in bonds.law.interval(argument, close)]
    return np.minimum(*ends), np.maximum(*ends)
