"""Boxes: intervals of the unknowns and the lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..typing import Array


@dataclass(frozen=True, kw_only=True)
class Box:
    """Intervals of the unknowns and the lengths, and what is known there.

    Attributes:
        low: (n + m,).
        high: (n + m,).
        x: where a relaxation has its minimiser, or is to begin, (n,).
        weights: where envelopes were not tight, (n + m,).
        bound: no point of it has a lower energy.
    """

    low: Array
    high: Array
    x: Array
    weights: Array
    bound: float = -math.inf

    @classmethod
    def around(cls, low: Array, high: Array, x: Array) -> Box:
        """A box of which nothing is known.

        Args:
            low: (n + m,).
            high: (n + m,).
            x: where to begin, (n,).
        """
        return cls(low=low, high=high, x=clipped(x, low, high), weights=np.zeros(len(low)))


def clipped(x: Array, low: Array, high: Array) -> Array:
    """The unknowns within their intervals, (n,).

    Args:
        x: (n,).
        low: of the box, (n + m,).
        high: of the box, (n + m,).
    """
    return np.asarray(np.clip(x, low[: len(x)], high[: len(x)]))
