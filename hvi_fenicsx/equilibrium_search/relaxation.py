"""The convex programme that bounds the energy on a box from below: envelopes of the laws, curvature given to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask
from . import envelopes as convex
from . import motions
from .arcs import ArcTable
from .boxes import Box
from .convex_programme import minimise, never
from .curvature import Curvature, CurvatureShare
from .length_programme import LengthProgramme
from .motions import Lent
from .scalar_problem import ScalarProblem


def envelopes(problem: ScalarProblem, low: Array, high: Array, added: Array) -> list[Array]:
    """The convex envelopes of all laws with ½ d t² added, on a box; those of lengths reach to zero, and never fall.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        added: d, (n + m,).
    """
    chains = convex.envelopes(problem.arcs, low, high, added)
    return [*chains[: problem.size], *(_risen(c) for c in chains[problem.size :])]


def _risen(chain: Array) -> Array:
    """The largest convex chain from zero on that does not fall and is nowhere above the given one, (k, 6)."""
    low, high, anchor, _, traction, slope = chain.T
    begin, end = traction + slope * (low - anchor), traction + slope * (high - anchor)
    rising = np.flatnonzero((end > 0.0) | ((slope > 0.0) & (begin >= 0.0)))
    if not rising.size:
        return np.array([_flat(chain[-1], float(high[-1]))])
    rest = chain[rising[0] :].copy()
    if begin[rising[0]] < 0.0:
        rest[0, 0] = np.clip(anchor[rising[0]] - traction[rising[0]] / slope[rising[0]], *rest[0, :2])
    turn = float(rest[0, 0])
    return np.vstack([_flat(rest[0], turn), rest]) if turn > 0.0 else rest


def _flat(arc: Array, end: float) -> list[float]:
    """A constant arc from zero on that ends on a given one."""
    anchor, value, traction, slope = map(float, arc[2:])
    away = end - anchor
    return [0.0, end, end, value + (traction + 0.5 * slope * away) * away, 0.0, 0.0]


class Relaxation:
    """Relaxations of one problem.

    Args:
        problem: the problem.
        cut: whether convex programmes are to be cut short, since the search stops; the bounds hold for any point.
    """

    def __init__(self, problem: ScalarProblem, cut: Callable[[], bool] = never) -> None:
        self.problem, self._thresholds, self._cut = problem, problem.thresholds.bounds, cut
        self._share = CurvatureShare(problem)

    def undecided(self, low: Array, high: Array) -> Integers:
        """Arguments whose law is not convex on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
        """
        arcs = self.problem.arcs
        wide = high > low
        return np.flatnonzero(wide & ((arcs.drops(low, high) > 0.0) | (arcs.least_slope(low, high) < 0.0)))

    def share_span(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest shares of rigid motions in a box, (k,) each.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
        """
        n = self.problem.size
        return motions.span(self._share.shapes, low[:n], high[:n], self.problem.thresholds.cells.widened)

    @cached_property
    def joints(self) -> Array:
        """The largest shares of rigid motions at which laws have joints, (k,)."""
        return motions.farthest_joints(self.problem, self._share.shapes)

    def shares(self, x: Array) -> Array:
        """The shares of rigid motions at a point, (k,).

        Args:
            x: the point, (n,).
        """
        return np.asarray(self._share.shapes.T @ x)

    def solve(self, box: Box, part: float, lost: float = 0.0) -> tuple[Box, Curvature]:
        """The box with its bound, minimiser and gaps, and the curvature that was used.

        Args:
            box: where to minimise; its x is where to begin.
            part: share of the largest curvature.
            lost: energy that the chords of rigid motions may take off.
        """
        problem, undecided = self.problem, self.undecided(box.low, box.high)
        weights = self._weights(box, undecided)
        curvature, wanted = self._curvature(box, undecided, weights, part, lost)
        lent = self.lent(box, curvature)
        stack = ArcTable.of(envelopes(problem, box.low, box.high, curvature.added))
        x, bound = self._minimised(box, curvature, lent, stack)
        gaps = np.zeros(len(box.motion_low))
        gaps[np.flatnonzero(curvature.lent)] = _above(lent.gaps(x), self._thresholds.tight * problem.energy_size(x))
        box = replace(
            box,
            motion_gaps=np.where(wanted, np.inf, gaps),
            value=bound + problem.constant,
            bound=max(box.bound, bound + problem.constant),
        )
        return self._examined(box, x, stack, curvature, undecided), curvature

    def curvature(self, box: Box, part: float) -> Array:
        """The diagonal D of a box, (n + m,).

        Args:
            box: the box.
            part: share of the largest curvature.
        """
        undecided = self.undecided(box.low, box.high)
        return self._share.share(box.low, box.high, undecided, self._weights(box, undecided), part).added

    def _curvature(
        self, box: Box, undecided: Integers, weights: Array, part: float, lost: float
    ) -> tuple[Curvature, Mask]:
        """The curvature, and the rigid motions whose shares are to be divided before any is lent along them, (k,)."""
        given, wide = (box.low, box.high, undecided, weights, part), box.motion_high - box.motion_low
        wanted: Mask = np.zeros(len(wide), dtype=np.bool_)
        if lost > 0.0 and 0 < len(wide) <= self._thresholds.most_motions:
            wanted = motions.long(box.motion_low, box.motion_high, self.joints, self._thresholds.growth)
            if undecided.size and not wanted.any():
                curvature = self._share.share(*given, lend=True)
                cost = curvature.lent * wide**2 / 8.0
                if cost.sum() <= lost:
                    return curvature, wanted
                wanted = (cost >= 0.5 * cost.max()) & (cost.sum() <= self._thresholds.most_parts**2 * lost)
        return self._share.share(*given), wanted

    def lent(self, box: Box, curvature: Curvature) -> Lent:
        """The curvature along rigid motions with the intervals of their shares.

        Args:
            box: the box.
            curvature: on it.
        """
        used = np.flatnonzero(curvature.lent)
        ends = (box.motion_low[used], box.motion_high[used]) if used.size else (np.empty(0), np.empty(0))
        return Lent(shapes=self._share.shapes[:, used], stiffness=curvature.lent[used], low=ends[0], high=ends[1])

    def _minimised(
        self, box: Box, curvature: Curvature, lent: Lent, stack: ArcTable
    ) -> tuple[Array, float]:
        """The minimiser, and a lower bound."""
        problem = self.problem
        a = problem.stiffness - np.diag(problem.diagonal(curvature.added)) + lent.matrix
        b = problem.force + lent.force
        if len(problem.lengths):
            shut = curvature.added[problem.size :]
            programme = LengthProgramme(
                problem=problem, a=a, b=b, laws=stack, shut=shut, low=box.low, high=box.high, cut=self._cut
            )
            found = programme.bound(programme.minimiser(box.x))
        else:
            found = minimise(a, b, stack, box.x, problem.thresholds.programmes, self._cut)
        return found.x, found.bound + lent.constant

    def _weights(self, box: Box, undecided: Integers) -> Array:
        """How much of D each argument is to have, (n + m,)."""
        arcs, low, high = self.problem.arcs, box.low, box.high
        drops = arcs.drops(low, high)
        strength = np.where(drops > 0.0, drops, -arcs.least_slope(low, high) * (high - low))[undecided]
        seen = box.weights[undecided]
        most = float(seen.max(initial=0.0))
        weights = np.zeros(len(low))
        weights[undecided] = strength * (seen / most + self._thresholds.least_weight if most > 0.0 else 1.0)
        return weights

    def _examined(self, box: Box, x: Array, stack: ArcTable, curvature: Curvature, undecided: Integers) -> Box:
        """Where the envelope is not tight at x: the gaps, the chords, and the weights for the next D."""
        problem, at = self.problem, self.problem.arguments(x)
        rows = np.arange(len(at))
        k = np.minimum(stack.at(at), stack.slopes.shape[1] - 1)
        begin, end = stack.ends[rows, k], stack.ends[rows, k + 1]
        gaps = problem.arcs.energy(at) + 0.5 * curvature.added * at * at - stack.energy(at)
        loose = np.zeros(len(at), dtype=bool)
        loose[undecided] = gaps[undecided] > self._thresholds.tight * problem.energy_size(x)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread = np.where(loose, 0.5 * (at - begin) * (end - at), 0.0)
        weights = 0.5 * (box.weights + spread) if box.weights.any() else spread
        return replace(
            box,
            x=x,
            weights=weights,
            gaps=np.where(loose, gaps, 0.0),
            chord_low=begin,
            chord_high=end,
        )


def _above(values: Array, least: float) -> Array:
    return np.where(values > least, values, 0.0)
