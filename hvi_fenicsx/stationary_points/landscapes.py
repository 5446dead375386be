"""Energies over displacements in which ways down from saddles are looked for: of polylines, and of curved laws.

A step down minimises a convex function that is nowhere below the energy and equal to it at the point. Between a point
and the next the energy is below that convex function, which falls there; so it stays below the energy at the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from ..laws.arc import Arc
from ..typing import Array
from . import stationarity
from .convex_programme import Chains, minimise
from .curved_laws import CurvedLaws
from .descent import descend
from .scalar_problem import ScalarProblem
from .thresholds import DescentThresholds


class Landscape(Protocol):
    """An energy, and ways down in it."""

    @property
    def ends(self) -> tuple[Array, Array]:
        """Least and largest displacements, (n,) each."""

    @property
    def thresholds(self) -> DescentThresholds:
        """How ways down are gone."""

    def energy(self, x: Array) -> float:
        """The energy.

        Args:
            x: displacements, (n,).
        """

    def unstable_directions(self, x: Array) -> Array | None:
        """Displacements along which the energy falls from a stationary point, (n, k); None if that is undecided.

        Args:
            x: a stationary point, (n,).
        """

    def lower(self, x: Array) -> Array:
        """A point at the end of a way on which the energy is below that at the begin; the same where it ends.

        Args:
            x: displacements, (n,).
        """

    def is_convex(self, low: Array, high: Array) -> bool:
        """Whether the energy is surely strictly convex on a box.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """


class PolylineLandscape:
    """The energy of laws whose tractions are polylines.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem, self.thresholds = problem, problem.thresholds.descent
        self.ends = _ends(problem)

    def energy(self, x: Array) -> float:
        """The energy.

        Args:
            x: displacements, (n,).
        """
        return self._problem.energy(x)

    def unstable_directions(self, x: Array) -> Array | None:
        """As of :class:`Landscape`.

        Args:
            x: a stationary point, (n,).
        """
        return stationarity.unstable_directions(self._problem, x, stationarity.subdifferential(self._problem, x))

    def lower(self, x: Array) -> Array:
        """As of :class:`Landscape`.

        Args:
            x: displacements, (n,).
        """
        return descend(self._problem, *self.ends, x)[0]

    def is_convex(self, low: Array, high: Array) -> bool:
        """As of :class:`Landscape`.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        arcs = self._problem.arcs
        falls = np.where(arcs.drops(low, high) > 0.0, -np.inf, arcs.least_slope(low, high))
        return _is_positive(self._problem.stiffness, falls, low, high)


class CurvedLandscape:
    """The energy of curved laws of which bounds of all slopes are known.

    Args:
        laws: the laws.
    """

    def __init__(self, laws: CurvedLaws) -> None:
        self._laws, self._near, self.thresholds = laws, laws.near, laws.near.thresholds.descent
        self.ends = _ends(laws.near)

    def energy(self, x: Array) -> float:
        """The energy.

        Args:
            x: displacements, (n,).
        """
        return self._laws.problem.energy(x)

    def unstable_directions(self, x: Array) -> Array | None:
        """As of :class:`Landscape`.

        Args:
            x: a stationary point, (n,).
        """
        return stationarity.unstable_directions(self._near, x, self._laws.subdifferential(x))

    def lower(self, x: Array) -> Array:
        """As of :class:`Landscape`.

        Args:
            x: displacements, (n,).
        """
        energy, limits = self.energy(x), self.thresholds
        for _ in range(limits.curved_steps):
            chains, programmes = Chains.of(self.majorants(x)), self._near.thresholds.programmes
            found = minimise(self._near.stiffness, self._near.force, chains, x, programmes).x
            after = self.energy(found)
            if not energy - after > limits.rounding * self._near.energy_size(x):
                break
            x, energy = found, after
        return x

    def is_convex(self, low: Array, high: Array) -> bool:
        """As of :class:`Landscape`.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        return _is_positive(self._near.stiffness, self._laws.slopes(low, high)[0], low, high)

    def majorants(self, x: Array) -> list[Sequence[Arc]]:
        """Convex chains that are nowhere below the laws less their energies at a point: falls are linearised there.

        Args:
            x: the point, (n,).
        """
        before, after = self._laws.sides(x)
        left, right = self._half(x, -1.0, -before), self._half(x, 1.0, np.maximum(before, after))
        here = [(Arc(at, at, at, 0.0, 0.0, 0.0),) for at in map(float, x)]
        return [(*a[::-1], *b) or point for a, b, point in zip(left, right, here, strict=True)]

    def _half(self, x: Array, way: float, begin: Array) -> list[list[Arc]]:
        """The arcs on one side of a point, from there on; `begin` is what resists to move to that side, (n,)."""
        places = self._places(x, way)
        wide = np.abs(np.diff(places, axis=0))
        slopes = np.maximum(self._laws.most_slopes(*np.sort([places[:-1], places[1:]], axis=0)), 0.0)
        fresh = np.diff(places, axis=0, prepend=x[None])[:-1] != 0.0  # places that are there twice count once
        jumps = np.where(fresh, self._laws.upward_jumps(places[:-1]), 0.0)
        rises = np.cumsum(jumps, axis=0) + np.cumsum(np.vstack([np.zeros(len(x)), (slopes * wide)[:-1]]), axis=0)
        tractions = begin + rises
        values = np.cumsum(np.vstack([np.zeros(len(x)), ((tractions + 0.5 * slopes * wide) * wide)[:-1]]), axis=0)
        low, high = np.sort([places[:-1], places[1:]], axis=0)
        table = np.stack([low, high, places[:-1], values, way * tractions, slopes], axis=-1)
        return [[Arc(*arc) for arc in table[low[:, i] < high[:, i], i].tolist()] for i in range(len(x))]

    def _places(self, x: Array, way: float) -> Array:
        """Where the intervals on one side of a point end, from the point on, (k, n)."""
        end = self.ends[1 if way > 0.0 else 0]
        places = np.vstack([x, x + way * self._grown[:, None], self._laws.convex_kinks, end])
        return np.asarray(way * np.sort(way * np.clip(places, np.minimum(x, end), np.maximum(x, end)), axis=0))

    @cached_property
    def _grown(self) -> Array:
        """Distances that grow up to all displacements."""
        limits = self.thresholds
        first = limits.first_interval * min(b.law.length_scale for b in self._laws.problem.bonds)
        far = float(np.max(self.ends[1] - self.ends[0]))
        return np.asarray(first * limits.growth ** np.arange(np.ceil(np.log(far / first) / np.log(limits.growth))))


def _ends(problem: ScalarProblem) -> tuple[Array, Array]:
    return np.maximum(problem.lower, -problem.far), np.minimum(problem.upper, problem.far)


def _is_positive(stiffness: Array, slopes: Array, low: Array, high: Array) -> bool:
    """Whether S plus slopes is positive definite on the unknowns that a box leaves free."""
    free = np.flatnonzero(low < high)
    if not np.all(np.isfinite(slopes[free])):
        return False
    try:
        cholesky(stiffness[np.ix_(free, free)] + np.diag(slopes[free]), lower=True)
    except LinAlgError:
        return False
    return True
