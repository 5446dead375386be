"""Smaller cells by strong monotonicity: all stationary points of a cell are near the minimiser of its relaxation.

With y the minimiser of the relaxation with diagonal D and τ = f - Sy, each stationary point x with tractions t has
(x - y)ᵀ(S - D)(x - y) + Σ [(xᵢ - yᵢ)(tᵢ - τᵢ) + dᵢ(xᵢ - yᵢ)²] = 0. The terms of the sum are bounded from below on the
graph of each law; they are not negative where the law only rises.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..typing import Array
from .boxes import Box
from .relaxation import Relaxation
from .scalar_problem import ScalarProblem


def tightened(relaxation: Relaxation, box: Box) -> Box:
    """A smaller box with the same stationary points; empty (low > high) if there are none.

    Args:
        relaxation: of the problem.
        box: the box; its x and weights are where to begin.
    """
    problem, limits = relaxation.problem, relaxation.problem.thresholds.cells
    solved, curvature = relaxation.solve(box, limits.part)
    y = solved.x
    short = -np.minimum(least_products(problem, box, y, curvature.added), 0.0).sum()
    size = float(np.abs(problem.force) @ np.abs(y)) + problem.energy_size(y)
    with np.errstate(invalid="ignore"):
        reach = curvature.radii * np.sqrt(short * (1.0 + limits.widened_radius) + 1e-14 * size)
    reach = np.where(np.isfinite(curvature.radii), reach, np.inf)
    low, high = np.maximum(box.low, y - reach), np.minimum(box.high, y + reach)
    fixed = box.low == box.high
    return replace(
        box,
        low=np.where(fixed, box.low, low),
        high=np.where(fixed, box.high, high),
        bound=-np.inf,
        x=y,
        weights=solved.weights,
        gaps=solved.gaps,
        chord_low=solved.chord_low,
        chord_high=solved.chord_high,
    )


def least_products(problem: ScalarProblem, box: Box, y: Array, added: Array) -> Array:
    """The least (x - y)(t - τ) + d (x - y)² on the graph of each law in the box, (n,).

    What a bound bears adds nothing negative, since y is within the bounds.

    Args:
        problem: the problem.
        box: the box; where it is a point, y is there.
        y: a point in it, (n,).
        added: d, (n,).
    """
    arcs, at, d = problem.arcs, y[:, None], added[:, None]
    tau = (problem.force - problem.stiffness @ y)[:, None]
    low, high = np.maximum(arcs.low, box.low[:, None]), np.minimum(arcs.high, box.high[:, None])
    curve = arcs.slopes + d
    with np.errstate(invalid="ignore", divide="ignore"):
        start = arcs.tractions + arcs.slopes * (at - arcs.anchors) - tau
        middle = np.clip(np.where(curve > 0.0, at - 0.5 * start / curve, low), low, high)
        values = [(x - at) * (start + curve * (x - at)) for x in (low, high, middle)]
    least = np.where(arcs.meets(box.low, box.high), np.minimum(np.minimum(values[0], values[1]), values[2]), np.inf)
    return np.asarray(np.where(box.low == box.high, 0.0, least.min(axis=1)))
