"""Rigid motions of the unknowns, and a stiffness that resists them as little as elasticity does: not at all.

A few unknowns, pivots, fix the motion: x = T x_p with T = I at the pivots. Eigenvectors only tell how many there are;
the rest of T makes no force on the other unknowns, and is off by rounding alone. The condensed S resists T by what
rounding left in it. So a body far away would be held where a load is above its limit by little. The blocks of S at the
pivots are therefore made from the block of the other unknowns, such that S T = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from ..typing import Array, Integers
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class RigidMotions:
    """The motions T x_p, to which S is no resistance but for rounding.

    Attributes:
        pivots: unknowns that fix the motion, (k,).
        others: all other unknowns, (n - k,).
        shapes: T, (n, k).
    """

    pivots: Integers
    others: Integers
    shapes: Array

    @classmethod
    def of(cls, stiffness: Array) -> RigidMotions:
        """The motions of a stiffness.

        Args:
            stiffness: S, (n, n).
        """
        values, vectors = np.linalg.eigh(stiffness)
        rigid = vectors[:, values <= LIMITS.zero * np.max(values, initial=0.0)]
        n, k = rigid.shape
        pivots = np.asarray(qr(rigid.T, pivoting=True, mode="r")[1][:k], dtype=np.int64)
        others = np.setdiff1d(np.arange(n), pivots)
        shapes = np.zeros((n, k))
        shapes[pivots] = np.eye(k)
        shapes[others] = -np.linalg.solve(stiffness[np.ix_(others, others)], stiffness[np.ix_(others, pivots)])
        return cls(pivots=pivots, others=others, shapes=shapes)


def resistance(stiffness: Array, shapes: Array) -> tuple[Array, Array]:
    """How much a stiffness resists motions, and the size of its rounding, (n, k) each.

    Args:
        stiffness: S, (n, n).
        shapes: T, (n, k).
    """
    return np.abs(stiffness @ shapes), len(stiffness) * LIMITS.rounding * (np.abs(stiffness) @ np.abs(shapes))


def without_resistance(stiffness: Array) -> Array:
    """A stiffness that does not resist its rigid motions; the given one where they may be deformations.

    Shares of a motion that are next to 0, 1 or -1 are these numbers.

    Args:
        stiffness: S, symmetric, (n, n).
    """
    motions = RigidMotions.of(stiffness)
    found, rounding = resistance(stiffness, motions.shapes)
    if np.any(found > rounding):
        return stiffness
    others, pivots, shapes = motions.others, motions.pivots, motions.shapes[motions.others]
    whole = np.round(shapes)
    shapes = np.where(np.abs(shapes - whole) < LIMITS.accuracy, whole, shapes)
    result, scale = stiffness.copy(), np.sqrt(np.diag(stiffness))
    between = -stiffness[np.ix_(others, others)] @ shapes
    result[np.ix_(others, pivots)], result[np.ix_(pivots, others)] = between, between.T
    own = -shapes.T @ between
    result[np.ix_(pivots, pivots)] = 0.5 * (own + own.T)
    near = np.all(np.abs(result - stiffness) <= LIMITS.zero * np.outer(scale, scale))
    return result if near else stiffness
