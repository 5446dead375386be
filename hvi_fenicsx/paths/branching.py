"""The branch from a state on: exact, or by predictor and corrector."""

from __future__ import annotations

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array
from .branch import Branch
from .curve import Curve
from .pivoting import StraightBranch
from .relations import ContactPoints


def branch_from(
    points: ContactPoints,
    constant: Array,
    rate: Array,
    z: Array,
    factor: float,
    inverse: CellInverse | None = None,
    heading: int = 1,
) -> Branch:
    """The branch from a state on: exactly from event to event, or by predictor and corrector where graphs are curved.

    Args:
        points: where all points are; changed.
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        z: their coordinates, (n,).
        factor: λ.
        inverse: of the straight equations, where it is known.
        heading: the direction in which the factor of a straight branch sets out, 1 or -1.
    """
    if points.straight:
        return StraightBranch(points, constant, rate, z, factor, inverse=inverse, heading=heading)
    return Curve(constant, rate, points, z.copy(), factor)
