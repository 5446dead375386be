"""The numbers that tune how a problem is composed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """What counts as rounding, and what a law's traction is judged by.

    Attributes:
        same_displacement: difference of two prescribed displacements, relative to the largest, that is rounding.
        axis_parallel: distance of a normal's largest component from 1 up to which the normal is parallel to an axis.
        outside_bounds: distance (of u0) by which a prescribed displacement may be outside of a contact bound.
        law_scale: smallest scale of a law's traction, in units of the load's stress: a weaker law is not judged finer.
    """

    same_displacement: float = 1e-9
    axis_parallel: float = 1e-10
    outside_bounds: float = 1e-12
    law_scale: float = 1e-3


DEFAULT = Thresholds()
