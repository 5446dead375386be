"""The convex programme that bounds the energy on a box from below: envelopes of the laws, curvature given to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..laws.arc import Arc
from ..typing import Array, Integers
from .arcs import envelope
from .convex_programme import Chains, minimise
from .curvature import Curvature, CurvatureShare
from .dual_bound import DualBound
from .length_programme import LengthProgramme
from .scalar_problem import ScalarProblem

TIGHT = 1e-14
"""An envelope below its law by less than this share of the energy's parts is tight."""
LEAST_WEIGHT = 0.1
"""Share of the weights of D that does not follow from where envelopes were not tight."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """Intervals of the unknowns and the lengths, and what is known of the energy there.

    Attributes:
        low: (n + m,).
        high: (n + m,).
        bound: no point of it has a lower energy.
        x: the relaxation's minimiser, (n,).
        weights: where envelopes were not tight, (n + m,).
        gaps: law minus envelope at x, (n + m,).
        chord_low: begin of the chord of the envelope at x, (n + m,).
        chord_high: end of it, (n + m,).
        share: of the whole search, by the number of parts at each division.
    """

    low: Array
    high: Array
    bound: float
    x: Array
    weights: Array
    gaps: Array
    chord_low: Array
    chord_high: Array
    share: float = 1.0


def envelopes(problem: ScalarProblem, low: Array, high: Array, added: Array) -> list[list[Arc]]:
    """The convex envelopes of all laws with ½ d t² added, on a box; those of lengths reach to zero, and never fall.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        added: d, (n + m,).
    """
    sides = zip(problem.chains, map(float, low), map(float, high), map(float, added), strict=True)
    chains = [envelope(c, begin, end, d) for c, begin, end, d in sides]
    return [*chains[: problem.size], *map(_risen, chains[problem.size :])]


def _risen(arcs: list[Arc]) -> list[Arc]:
    """The largest convex chain from zero on that does not fall and is nowhere above the given one."""
    rising = [a for a in arcs if a.rate(a.high) > 0.0 or (a.slope > 0.0 and a.rate(a.low) >= 0.0)]
    if not rising:
        end = arcs[-1]
        return [Arc(0.0, end.high, end.high, end.at(end.high), 0.0, 0.0)]
    first = rising[0]
    turn = max(first.low, first.toucher(0.0)) if first.rate(first.low) < 0.0 else first.low
    flat = [Arc(0.0, turn, turn, first.at(turn), 0.0, 0.0)] if turn > 0.0 else []
    return [*flat, first._replace(low=turn), *rising[1:]]


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
        """Arguments whose law is not convex on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
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
        weights = np.zeros(len(box.low))
        weights[undecided] = self._weights(box, undecided)
        curvature = self._share.share(box.low, box.high, undecided, weights, part)
        chains = envelopes(problem, box.low, box.high, curvature.added)
        x, bound, steps = self._minimised(box, curvature, chains)
        self.programmes += steps
        return self._examined(box, x, bound, Chains.of(chains), curvature, undecided), curvature

    def _minimised(self, box: Box, curvature: Curvature, chains: list[list[Arc]]) -> tuple[Array, float, int]:
        """The minimiser, a lower bound, and the linear systems or steps that it took."""
        problem = self.problem
        a = problem.stiffness - np.diag(problem.diagonal(curvature.added))
        if not len(problem.lengths):
            found = minimise(a, problem.force, Chains.of(chains), box.x)
            return found.x, found.bound, found.steps
        programme = LengthProgramme.of(problem, a, problem.force, chains, curvature.added[problem.size :])
        x, steps = programme.minimiser(box.x)
        dual = DualBound(problem=problem, low=box.low, high=box.high, added=curvature.added)
        return x, dual.at(x, programme.multipliers(x)), steps

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
        problem, at = self.problem, self.problem.arguments(x)
        rows = np.arange(len(at))
        k = np.minimum(stack.arc_at(at), stack.slopes.shape[1] - 1)
        begin, end = stack.ends[rows, k], stack.ends[rows, k + 1]
        gaps = problem.arcs.energy(at) + 0.5 * curvature.added * at * at - stack.energy(at)
        loose = np.zeros(len(at), dtype=bool)
        loose[undecided] = gaps[undecided] > TIGHT * problem.energy_size(x)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread = np.where(loose, 0.5 * (at - begin) * (end - at), 0.0)
        weights = 0.5 * (box.weights + spread) if box.weights.any() else spread
        return replace(
            box,
            bound=max(box.bound, bound + problem.constant),
            x=x,
            weights=weights,
            gaps=np.where(loose, gaps, 0.0),
            chord_low=begin,
            chord_high=end,
        )
