"""A straight part of a traced curve, and what ended it."""

from __future__ import annotations

from dataclasses import dataclass

from .segments import Segment

FACTOR = -1
"""The number of the factor among the variables."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """What ended a straight part of the curve.

    Attributes:
        variable: the unknown that reached the end of its segment; FACTOR: the factor reached its aim; None: nothing,
            the curve goes on for ever.
        before: the segment that the unknown left; None for the factor.
        tied: how many unknowns reached an end at once.
        reversed: whether bonds with memory turned back.
    """

    variable: int | None
    before: Segment | None = None
    tied: int = 1
    reversed: bool = False
