"""Extreme tractions of a law known only by its split j = H - G: rigorous bounds by bisection.

On an interval (a, b) the traction j' = H' - G' lies in [H'(a+) - G'(b-), H'(b-) - G'(a+)], since H' and G'
are monotone. Bisecting wherever this bound still exceeds the best sample gives a bound from above that
is as sharp as wished: no peak, however narrow, can hide between samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .convex_parts import SplitLaw


@dataclass(frozen=True, kw_only=True)
class LawThresholds:
    """Limits of the search for extreme tractions, and of sampling.

    Attributes:
        resolution: relative sharpness of the bounds, and the least displacement sampled, over the law's length scale.
        far: the largest displacement that is searched, over the largest of 1, the law's length scale and its kinks;
            beyond it the law's growth is trusted.
        first_samples: displacements of the first grid, in geometric progression.
        most_intervals: intervals up to which bisection goes on.
        jump: relative to the largest traction, a smaller difference of the limits at an end is not meant as a jump.
        most_drops: drops of a sawtooth: each is a piece of the law, which is looked at at every vertex.
    """

    resolution: float = 1e-6
    far: float = 1e12
    first_samples: int = 400
    most_intervals: int = 200_000
    jump: float = 1e-9
    most_drops: int = 1_000


DEFAULT = LawThresholds()


_Objective = Callable[[Array, Array, Array], Array]
"""Objective f(lo, hi, |x|) of an interval of tractions lo..hi and a displacement."""


@dataclass(frozen=True)
class Extremes:
    """Upper bounds of the largest resistances and of the paper's growth constant.

    Attributes:
        peak_minus: of the resistance in the direction -1.
        peak_plus: of the resistance in the direction +1.
        c4: of the constant of the paper's growth condition (ii).
    """

    peak_minus: float
    peak_plus: float
    c4: float


def extremes(law: SplitLaw, thresholds: LawThresholds = DEFAULT) -> Extremes:
    """Bounds from above of a law's extreme tractions.

    Args:
        law: by its split.
        thresholds: how sharp, and how far out.
    """
    right = _grid(law, thresholds)
    left = -right[::-1]
    both = np.concatenate([left[:-1], right])

    def supremum(grid: Array, objective: _Objective) -> float:
        return _supremum(law, grid, objective, thresholds)

    return Extremes(
        peak_minus=max(law.growth.minus, supremum(both, lambda lo, hi, r: -lo)),
        peak_plus=max(law.growth.plus, supremum(both, lambda lo, hi, r: hi)),
        c4=max(
            0.0,
            supremum(right, lambda lo, hi, r: np.where(r > 0, -lo, 0.0)),
            supremum(left, lambda lo, hi, r: np.where(r > 0, hi, 0.0)),
        ),
    )


def _grid(law: SplitLaw, thresholds: LawThresholds) -> Array:
    """Displacements ≥ 0: zero, every kink, and a geometric progression out to where nothing happens."""
    unit = law.length_scale
    kinks = np.abs(law.kinks)
    reach = thresholds.far * max(unit, 1.0, *kinks)
    return np.asarray(
        np.unique(
            np.concatenate([[0.0], kinks, np.geomspace(thresholds.resolution * unit, reach, thresholds.first_samples)])
        )
    )


def _supremum(law: SplitLaw, grid: Array, objective: _Objective, thresholds: LawThresholds) -> float:
    """A bound from above of the objective's supremum over the range of the grid."""
    a, b = grid[:-1], grid[1:]
    best = _sample(law, grid, objective)
    tolerance = thresholds.resolution * max(abs(best), _typical(law, grid, objective))
    while (undecided := (bound := _bound(law, a, b, objective)) > best + tolerance).any():
        a, b = a[undecided], b[undecided]
        middle = 0.5 * (a + b)
        if a.size > thresholds.most_intervals or np.any((middle == a) | (middle == b)):
            break
        best = max(best, _sample(law, middle, objective))
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    if undecided.any():
        return float(bound.max())
    return best + tolerance if best > 0 else best


def _sample(law: SplitLaw, x: Array, objective: _Objective) -> float:
    lo, hi = law.interval(x)
    return float(objective(lo, hi, np.abs(x)).max())


def _typical(law: SplitLaw, x: Array, objective: _Objective) -> float:
    """The objective's size on tractions of the law's own size, so that the tolerance is never zero."""
    lo, hi = law.interval(x)
    size = np.maximum(np.abs(lo), np.abs(hi))
    return float(np.abs(objective(-size, size, np.abs(x))).max())


def _bound(law: SplitLaw, a: Array, b: Array, objective: _Objective) -> Array:
    lo = law.convex.right(a) - law.concave.left(b)
    hi = law.convex.left(b) - law.concave.right(a)
    nearest = np.minimum(np.abs(a), np.abs(b))
    # The interval is open: where it starts at zero, it is not the excluded point x = 0 that counts.
    return objective(lo, hi, np.where(nearest > 0, nearest, np.finfo(float).tiny))
