"""Boxes: intervals of the unknowns and the lengths, and of the shares of rigid motions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..typing import Array


@dataclass(frozen=True, kw_only=True)
class Box:
    """Intervals of the unknowns and the lengths, and what is known of the energy there.

    Attributes:
        low: (n + m,).
        high: (n + m,).
        bound: no point of it has a lower energy.
        value: the bound of the last relaxation, from which its strong convexity counts.
        x: the relaxation's minimiser, (n,).
        weights: where envelopes were not tight, (n + m,).
        gaps: law minus envelope at x, (n + m,).
        chord_low: begin of the chord of the envelope at x, (n + m,).
        chord_high: end of it, (n + m,).
        motion_low: begin of the intervals of rigid motions' shares, (k,); empty where these are not divided.
        motion_high: end of them, (k,).
        motion_gaps: what the chords of these shares take off at x, (k,).
        share: of the whole search, by the number of parts at each division.
    """

    low: Array
    high: Array
    bound: float
    value: float
    x: Array
    weights: Array
    gaps: Array
    chord_low: Array
    chord_high: Array
    motion_low: Array = field(default_factory=lambda: np.empty(0))
    motion_high: Array = field(default_factory=lambda: np.empty(0))
    motion_gaps: Array = field(default_factory=lambda: np.empty(0))
    share: float = 1.0

    @property
    def tight(self) -> bool:
        """Whether the relaxation is the energy at x."""
        return not (self.gaps.any() or self.motion_gaps.any())


def fresh_box(low: Array, high: Array, x: Array) -> Box:
    """A box of which nothing is known.

    Args:
        low: (n + m,).
        high: (n + m,).
        x: where its relaxation is to begin, (n,).
    """
    none = np.zeros(len(low))
    return Box(
        low=low,
        high=high,
        bound=-math.inf,
        value=-math.inf,
        x=clipped(x, low, high),
        weights=none,
        gaps=none,
        chord_low=low,
        chord_high=high,
    )


def clipped(x: Array, low: Array, high: Array) -> Array:
    """The unknowns within their intervals, (n,).

    Args:
        x: (n,).
        low: of the box, (n + m,).
        high: of the box, (n + m,).
    """
    return np.asarray(np.clip(x, low[: len(x)], high[: len(x)]))
