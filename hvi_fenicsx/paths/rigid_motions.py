"""Rigid motions that nothing resists in a cell: neither elasticity nor laws and bounds.

Where the load that grows works on such a motion, it drives the body along it at once, until something resists. Where it
does not, as on a body that rolls, or that contact alone holds and that may slide, the body is in equilibrium all along
the motion, with the same energy and the same forces. The equations of the cell are then singular. They become regular
with springs against the motions: the body stays where it has come to along them, and the springs carry nothing, so that
the solution is one without them. They belong to one cell: in the next one something else may resist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from ..typing import Array, Integers, magnitude
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Unresisted:
    """The rigid motions that nothing resists.

    Attributes:
        motions: orthonormal rows, (k, n).
        rate: the load that grows, (n,).
    """

    motions: Array
    rate: Array

    @property
    def balanced(self) -> Array:
        """The part of the load that works on none of the motions, (n,)."""
        return self.rate - (self.motions @ self.rate) @ self.motions

    @property
    def driven(self) -> Array:
        """The motion along which the load drives the body, (n,); 0 where it drives it along none but for rounding."""
        found = (self.motions @ self.rate) @ self.motions
        none = np.linalg.norm(found) <= DEFAULT.none * np.linalg.norm(self.rate)
        return np.zeros_like(found) if none else found

    @property
    def held(self) -> Array:
        """The motions along which no load drives the body, as orthonormal rows, (d, n)."""
        return without(self.motions, (self.motions @ self.driven)[:, None], 0.0)


def without(motions: Array, parts: Array, none: float) -> Array:
    """The combinations of motions whose parts are none.

    Args:
        motions: orthonormal rows, (k, n).
        parts: of each, (k, m).
        none: what is none.
    """
    if not len(motions) or not parts.size:
        return motions
    left, values, _ = np.linalg.svd(parts, full_matrices=parts.shape[1] < len(motions))
    return left[:, np.count_nonzero(values > none) :].T @ motions


def are_same(motions: Array, others: Array) -> bool:
    """Whether combinations of some motions are those of others.

    Args:
        motions: orthonormal rows, (d, n).
        others: likewise.
    """
    if len(motions) != len(others):
        return False
    return magnitude(others - (others @ motions.T) @ motions) <= DEFAULT.slow


def pins(motions: Array) -> Integers:
    """Unknowns, one for each motion: where they are held, none is left. Always that of the largest remaining row.

    Args:
        motions: orthonormal rows, (d, n).
    """
    return qr(motions, mode="r", pivoting=True)[1][: len(motions)]
