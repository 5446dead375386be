"""How many solutions the smooth equations of a cell have, and where: Krawczyk's operator, contraction, monotony."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from ..typing import Array
from .scalar_problem import ScalarProblem
from .smooth_system import EPSILON, SmoothSystem


def is_only_one(system: SmoothSystem, u: Array) -> bool:
    """Whether a computed solution is one, and the only one in the cell and near itself.

    Args:
        system: the equations.
        u: the solution, (k + l,).
    """
    near = system.near(u)
    about = np.stack([np.minimum(system.ends[0], u - near), np.maximum(system.ends[1], u + near)])
    return has_one_at_most(replace(system, ends=about)) and holds_one(system, u)


def holds_one(system: SmoothSystem, u: Array) -> bool:
    """Whether a solution is very near a computed one: Krawczyk's image of what is near lies within.

    Args:
        system: the equations.
        u: the computed one, (k + l,).
    """
    near = system.near(u)
    found = image(replace(system, ends=np.stack([u - near, u + near])))
    return found is not None and bool(np.all((found[0] > u - near) & (found[1] < u + near)))


def image(system: SmoothSystem) -> Array | None:
    """Intervals for all solutions in the cell (Krawczyk's operator), (2, k + l); None where it is not defined.

    Args:
        system: the equations.
    """
    derived = _inverted(system)
    if derived is None:
        return None
    (inverse, off), middle, ends = derived, system.start, system.ends
    rest, error = system.rest(middle)
    half = np.maximum(ends[1] - middle, middle - ends[0]) * (1.0 + 4.0 * EPSILON)
    moved = middle - inverse @ rest
    reach = off @ half + np.abs(inverse) @ error
    reach += 4.0 * EPSILON * (np.abs(moved) + len(moved) * (np.abs(inverse) @ np.abs(rest)))
    return np.stack([moved - reach, moved + reach])


def has_one_at_most(system: SmoothSystem) -> bool:
    """Whether there is one solution in the cell at most.

    Args:
        system: the equations.
    """
    return _is_monotone(system) or _contracts(system)


def _inverted(system: SmoothSystem) -> tuple[Array, Array] | None:
    """An inverse Y of the middle of the derivative J, and the largest |I - YJ|; None where there is none."""
    if np.any(system.ends[0, len(system.free) :][~system.drops] <= 0.0):
        return None
    low, high = system.derivative(system.ends)
    if not np.all(np.isfinite([low, high])):
        return None
    middle = 0.5 * (low + high)
    half = np.maximum(high - middle, middle - low) + 4.0 * EPSILON * np.abs(middle)
    try:
        inverse = np.linalg.inv(middle)
    except np.linalg.LinAlgError:
        return None
    size = len(middle)
    off = np.abs(np.eye(size) - inverse @ middle) + np.abs(inverse) @ half
    return inverse, off + 2.0 * size * EPSILON * (np.abs(inverse) @ np.abs(middle))


def _contracts(system: SmoothSystem) -> bool:
    """Whether |I - YJ| w < w for some w > 0: J is regular then, and so are all means of it."""
    derived = _inverted(system)
    if derived is None:
        return False
    off = derived[1]
    try:
        weights = np.linalg.solve(np.eye(len(off)) - off, np.ones(len(off)))
    except np.linalg.LinAlgError:
        return False
    return bool(np.all(weights > 0.0) and np.all(off @ weights < (1.0 - 1e-9) * weights))


def _is_monotone(system: SmoothSystem) -> bool:
    """Whether S plus the least of g' and κ is positive definite.

    Two vectors y and z whose lengths are in an interval on which both are c at least have tractions with
    (y - z)·(t - τ) ≥ c |y - z|²: it is linear in the cosine between them, and holds where that is 1 or -1. On a
    drop it holds with c = κ.
    """
    own = system.ends[:, len(system.free) :]
    if np.any(own[0] <= 0.0):
        return False
    kappa = system.secants(own).min(axis=0)
    least = system.slopes.copy()
    c = np.where(system.drops, kappa, np.minimum(system.b, kappa))
    lengths, curved = system.problem.lengths, system.curved
    added = c[:, None] * lengths.factors[curved] ** 2
    least[lengths.unknowns[curved][system.seen]] += added[system.seen]
    free = system.free
    return is_positive(system.problem.stiffness[np.ix_(free, free)] + np.diag(least[free]), system.problem)


def is_positive(matrix: Array, problem: ScalarProblem) -> bool:
    """Whether a matrix is positive definite, its least pivot above a share of the largest.

    Args:
        matrix: symmetric, (k, k).
        problem: with the share.
    """
    try:
        pivots = np.diag(cholesky(matrix, lower=True)) if np.all(np.isfinite(matrix)) else np.array([-1.0])
    except LinAlgError:
        return False
    return bool(pivots.min(initial=np.inf) > problem.thresholds.cells.regular * pivots.max(initial=0.0))
