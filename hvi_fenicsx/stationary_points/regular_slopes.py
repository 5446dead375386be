"""Whether S plus slopes from intervals is never singular: then two stationary points cannot both be there.

Of two stationary points the difference v has (Sv)ᵢ + eᵢvᵢ = 0, eᵢ being the slope of a chord of a law's graph: it
is within the range of the slopes; where the traction jumps upwards, or a bound bears, it has no upper end. With M = S
plus the middles (the lower ends where there is no upper one) and the half widths r, that is |Mv|ᵢ ≤ rᵢ|v|ᵢ, or
vᵢ(Mv)ᵢ ≤ 0, which is |Mv + sv|ᵢ ≤ |Mv - sv|ᵢ for any s > 0 (Cayley's transform). So |Pv|ᵢ ≤ |Qv|ᵢ with two matrices P
and Q, and v = 0 if Q P⁻¹, scaled, has a norm below 1. It has wherever S plus the least slopes is positive definite; and
S with the slopes may be indefinite, too, where saddles are.
"""

from __future__ import annotations

import numpy as np

from ..typing import Array
from .thresholds import DEFAULT

EPSILON = float(np.finfo(float).eps)


def is_regular(stiffness: Array, least: Array, most: Array, least_width: float = DEFAULT.cells.least_width) -> bool:
    """Whether S + E is regular for all diagonal E from least to most.

    Args:
        stiffness: S, symmetric, (n, n).
        least: -inf where no bound is known, (n,).
        most: inf where there is none, (n,).
        least_width: share of the stiffness to which ranges are widened at least.
    """
    if not len(least) or not np.all(np.isfinite(least)):
        return not len(least)
    scale = float(np.max(np.diag(stiffness))) or 1.0
    ends = np.isfinite(most)
    half = np.maximum(0.5 * (np.where(ends, most, least) - least), least_width * scale)
    matrix = stiffness + np.diag(least + np.where(ends, half, 0.0))
    spring = np.where(ends, 0.0, np.maximum(np.diag(matrix), least_width * scale))
    first, second = matrix + np.diag(spring), matrix - np.diag(spring)
    second[ends] = np.diag(half)[ends]
    weights = np.where(ends, half, 2.0 * spring) ** -0.5
    return _shrinks(weights[:, None] * first, weights[:, None] * second)


def _shrinks(first: Array, second: Array) -> bool:
    """Whether |Qv| < |Pv| for all v but zero; the rounding of the inverse is allowed for."""
    try:
        inverse = np.linalg.inv(first)
    except np.linalg.LinAlgError:
        return False
    size = len(first)
    sizes = [float(np.linalg.norm(matrix)) for matrix in (first, second, inverse)]
    rest = float(np.linalg.norm(np.eye(size) - inverse @ first)) + size * EPSILON * sizes[0] * sizes[2]
    if not rest < 0.5:
        return False
    rounding = 2.0 * sizes[1] * sizes[2] * (rest + size * EPSILON)
    return bool(np.linalg.norm(second @ inverse, 2) + rounding < 1.0)
