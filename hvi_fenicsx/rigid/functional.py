"""The functional on the rigid motions, which limit analysis minimises, and the sets over which it does.

The functional is  linear·y + Σ_p factors_p G_p(y)  with the slip integrals  G_p(y) = Σ_i δ_p(B_pi y), y in R^k,
k <= 6, δ_p being a length: positively homogeneous, and convex if no factor is negative.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from ..laws import Length
from ..typing import Array

_DIGITS = 12
"""To which directions of rows are compared; all other errors of the programme are larger."""


@dataclass(frozen=True)
class SlipIntegral:
    """G(y) = Σ_i δ(B_i y).

    Attributes:
        rows: the B_i, each times its lumped area, (m, r, k); r = 1 to 3 components.
        length: δ.
    """

    rows: Array
    length: Length

    def value(self, y: Array) -> float:
        """The integral at y, (k,)."""
        return float(self.length.of(self.rows @ y).sum())

    def joined(self, other: SlipIntegral) -> SlipIntegral:
        """The sum of two integrals of the same length, its rows merged (:func:`merged`).

        Args:
            other: the other one.
        """
        return SlipIntegral(merged(np.concatenate([self.rows, other.rows])), self.length)

    def subgradient(self, y: Array) -> Array:
        """One subgradient at y, (k,): a vertex without slip contributes the zero of its ball."""
        return np.asarray(np.tensordot(self.length.gradient(self.rows @ y), self.rows, axes=2))


def merged(rows: Array) -> Array:
    """Rows B_i that are positive multiples of one another as their sum: δ is positively homogeneous, so G stays.

    The vertices of a flat part have one row in the plane, whatever the mesh. Vanishing rows are left out.

    Args:
        rows: (m, r, k).
    """
    flat = rows.reshape(len(rows), rows.shape[1] * rows.shape[2])
    length = np.linalg.norm(flat, axis=1)
    flat, length = flat[length > 0.0], length[length > 0.0]
    directions, group = np.unique(np.round(flat / length[:, None], _DIGITS) + 0.0, axis=0, return_inverse=True)
    found = np.zeros_like(directions)
    np.add.at(found, group.ravel(), flat)
    return found.reshape(-1, *rows.shape[1:])


@dataclass(frozen=True)
class Functional:
    """The function linear·y + Σ_p factors_p G_p(y) on the cone {cone @ y <= 0}.

    Attributes:
        linear: (k,).
        factors: of the slip integrals, (p,).
        cone: rows of length one, (c, k).
    """

    linear: Array
    factors: Array
    cone: Array

    def minus(self, load: Array, factor: float = 1.0) -> Functional:
        """The functional less the work of a load.

        Args:
            load: its work on the basis motions, (k,).
            factor: what the load is multiplied by.
        """
        return replace(self, linear=self.linear - factor * load)

    def unresisted(self) -> Functional:
        """Zero, on the same cone."""
        return replace(self, linear=np.zeros_like(self.linear), factors=np.zeros_like(self.factors))


@dataclass(frozen=True)
class Region:
    """The bounded set {upper @ y <= 1, equal @ y = value} to search.

    Attributes:
        upper: (q, k).
        equal: (e, k).
        value: (e,).
    """

    upper: Array
    equal: Array
    value: Array


def ball(frame: Array) -> Region:
    """|y| <= 1 in the largest of the rigid coefficients z = frame @ y, frame (n, k)."""
    none = np.zeros((0, frame.shape[1]))
    return Region(np.vstack([frame, -frame]), none, np.zeros(0))


def vertices(frame: Array, rank: float) -> Array:
    """The corners (v, k) of the ball |y| <= 1.

    Args:
        frame: rigid coefficients of the basis motions, (n, k).
        rank: singular values this small beside the largest count as zero.
    """
    k = frame.shape[1]
    chosen = [frame[list(rows)] for rows in combinations(range(len(frame)), k)]
    signs = np.array(list(product((1.0, -1.0), repeat=k)))
    corners = np.vstack([np.linalg.solve(rows, signs.T).T for rows in chosen if np.linalg.cond(rows) * rank < 1.0])
    return np.asarray(corners[np.abs(corners @ frame.T).max(axis=1) <= 1.0 + rank])


def idle(frame: Array, load: Array) -> Region:
    """The motions with |y| <= 1 on which a load does no work.

    Args:
        frame: rigid coefficients of the basis motions, (n, k).
        load: its work on the basis motions, (k,).
    """
    return replace(ball(frame), equal=load[None], value=np.zeros(1))


def cross(frame: Array) -> Region:
    """Σ|z_j| <= 1: its corners are pure translations and rotations, so it yields directions easy to name."""
    signs = np.array(list(product((1.0, -1.0), repeat=frame.shape[0])))
    return replace(ball(frame), upper=signs @ frame)


def faces(frame: Array, across: Array) -> Iterator[Region]:
    """The faces of the sphere |y| = 1 in the space orthogonal to some motions.

    Args:
        frame: rigid coefficients of the basis motions, (n, k).
        across: the motions to which y is to be orthogonal, (q, k).
    """
    whole = ball(frame)
    for row in whole.upper[np.abs(whole.upper).max(axis=1) > 0.0]:
        yield replace(whole, equal=np.vstack([row, across]), value=np.r_[1.0, np.zeros(len(across))])
