"""How far the reference of a study may be from the truth itself.

It is the unsmoothed law on a mesh finer than all others. With e' and e'' the distances of the next two coarser levels
from it, and errors that fall as C hᵖ, its own error follows by Richardson's extrapolation (Roache 1998, *Verification
and Validation in Computational Science and Engineering*): e''/e' = 2ᵖ + 1, and the error is e'/(2ᵖ - 1). In the energy
norm the differences of nested Galerkin solutions are orthogonal to each other, so there the same holds of the squares,
with 4ᵖ for 2ᵖ (of inequalities nearly so).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .error_norms import ERROR_NORMS, Errors
from .thresholds import DEFAULT, Thresholds

ROUNDING = 1e-12
"""Relative: no smaller error can be measured."""


@dataclass(frozen=True)
class Certainty:
    """How well the reference is known in one quantity.

    Attributes:
        error: the reference's own relative error; None where it is not known.
        order: in h, measured on the next coarser levels; None where it is not known.
    """

    error: float | None
    order: float | None


def certainty(coarser: Sequence[Errors], thresholds: Thresholds = DEFAULT) -> Mapping[str, Certainty]:
    """How well the reference is known, by quantity; without coarser levels nothing is known of the error in h.

    Args:
        coarser: errors of the next coarser levels against the reference, finest first.
        thresholds: which orders are believed.
    """
    return {key: _certainty([e[key] for e in coarser], norm.power, thresholds) for key, norm in ERROR_NORMS.items()}


def _certainty(errors: Sequence[float | None], power: int, thresholds: Thresholds) -> Certainty:
    known = [e**power for e in errors if e is not None]
    if not known:
        return Certainty(None, None)
    if known[0] <= ROUNDING**power:
        return Certainty(ROUNDING, None)
    order = _order(known[0], known[1], power) if len(known) > 1 else None
    believed = min(max(order or thresholds.slowest_order, thresholds.slowest_order), thresholds.fastest_order)
    own = (known[0] / (2.0 ** (power * believed) - 1.0)) ** (1.0 / power)
    return Certainty(max(ROUNDING, own), order)


def _order(near: float, far: float, power: int) -> float | None:
    return math.log2(far / near - 1.0) / power if far > near * (1.0 + 1e-9) else None
