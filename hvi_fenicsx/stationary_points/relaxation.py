"""The convex programme that bounds the energy on a box from below: envelopes of the laws, curvature given to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers
from .arcs import envelope
from .convex_programme import Chains, minimise
from .curvature import Curvature, CurvatureShare
from .scalar_problem import ScalarProblem

TIGHT = 1e-14
"""An envelope below its law by less than this share of the energy's parts is tight."""
LEAST_WEIGHT = 0.1
"""Share of the weights of D that does not follow from where envelopes were not tight."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """Intervals of the unknowns, and what is known of the energy there.

    Attributes:
        low: (n,).
        high: (n,).
        bound: no point of it has a lower energy.
        x: the relaxation's minimiser, (n,).
        weights: where envelopes were not tight, (n,).
        gaps: law minus envelope at x, (n,).
        chord_low: begin of the chord of the envelope at x, (n,).
        chord_high: end of it, (n,).
    """

    low: Array
    high: Array
    bound: float
    x: Array
    weights: Array
    gaps: Array
    chord_low: Array
    chord_high: Array


def envelopes(problem: ScalarProblem, low: Array, high: Array, added: Array) -> Chains:
    """The convex envelopes of all laws with ½ d x² added, on a box.

    Args:
        problem: the problem.
        low: of the box, (n,), finite.
        high: of the box, (n,), finite.
        added: d, (n,).
    """
    sides = zip(problem.chains, map(float, low), map(float, high), map(float, added), strict=True)
    return Chains.of([envelope(c, begin, end, d) for c, begin, end, d in sides])


class Relaxation:
    """Relaxations of one problem.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self.problem = problem
        self._share = CurvatureShare(problem)
        self.programmes = 0

    def undecided(self, low: Array, high: Array) -> Integers:
        """Unknowns whose law is not convex on a box.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        arcs = self.problem.arcs
        wide = high > low
        return np.flatnonzero(wide & ((arcs.drops(low, high) > 0.0) | (arcs.least_slope(low, high) < 0.0)))

    def solve(self, box: Box, part: float) -> tuple[Box, Curvature]:
        """The box with its bound, minimiser and gaps, and the curvature that was used.

        Args:
            box: where to minimise; its x is where to begin.
            part: share of the largest curvature.
        """
        problem, undecided = self.problem, self.undecided(box.low, box.high)
        weights = np.zeros(problem.size)
        weights[undecided] = self._weights(box, undecided)
        curvature = self._share.share(box.low, box.high, undecided, weights, part)
        stack = envelopes(problem, box.low, box.high, curvature.added)
        found = minimise(problem.stiffness - np.diag(curvature.added), problem.force, stack, box.x)
        self.programmes += found.steps
        return self._examined(box, found.x, found.bound, stack, curvature, undecided), curvature

    def _weights(self, box: Box, undecided: Integers) -> Array:
        arcs, low, high = self.problem.arcs, box.low, box.high
        drops = arcs.drops(low, high)
        strength = np.where(drops > 0.0, drops, -arcs.least_slope(low, high) * (high - low))[undecided]
        seen = box.weights[undecided]
        most = float(seen.max(initial=0.0))
        return np.asarray(strength * (seen / most + LEAST_WEIGHT if most > 0.0 else 1.0))

    def _examined(
        self, box: Box, x: Array, bound: float, stack: Chains, curvature: Curvature, undecided: Integers
    ) -> Box:
        """Where the envelope is not tight at x: the gaps, the chords, and the weights for the next D."""
        problem, rows = self.problem, np.arange(len(x))
        k = np.minimum(stack.arc_at(x), stack.slopes.shape[1] - 1)
        begin, end = stack.ends[rows, k], stack.ends[rows, k + 1]
        gaps = problem.arcs.energy(x) + 0.5 * curvature.added * x * x - stack.energy(x)
        loose = np.zeros(len(x), dtype=bool)
        loose[undecided] = gaps[undecided] > TIGHT * problem.energy_size(x)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread = np.where(loose, 0.5 * (x - begin) * (end - x), 0.0)
        weights = 0.5 * (box.weights + spread) if box.weights.any() else spread
        return Box(
            low=box.low,
            high=box.high,
            bound=max(box.bound, bound + problem.constant),
            x=x,
            weights=weights,
            gaps=np.where(loose, gaps, 0.0),
            chord_low=begin,
            chord_high=end,
        )
