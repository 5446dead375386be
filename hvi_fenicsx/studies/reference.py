"""The reference that a study measures against, and how far it may be from the truth itself.

It is the unsmoothed law on a mesh finer than all others. With e' and e'' the distances of the next two coarser rungs
from it, and errors that fall as C hᵖ, its own error follows by Richardson's extrapolation (Roache 1998, *Verification
and Validation in Computational Science and Engineering*): e''/e' = 2ᵖ + 1, and the error is e'/(2ᵖ - 1). In the energy
norm the differences of nested Galerkin solutions are orthogonal to each other, so there the same holds of the squares,
with 4ᵖ for 2ᵖ (of inequalities nearly so).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .errors import QUANTITIES, Errors

SLOWEST, FASTEST = 0.5, 2.0
"""Orders that are believed; a measured one beyond them is taken for the nearer one, a missing one for the first."""
_POWERS = {"energy_norm": 2}
"""The power of the errors that is additive over the rungs."""
ROUNDING = 1e-12
"""Relative: no smaller error can be told."""


@dataclass(frozen=True)
class Certainty:
    """Of one quantity: the reference's own relative error, and the order in h that it was told by (None: not known)."""

    error: float | None
    order: float | None


def certainty(below: Sequence[Errors]) -> Mapping[str, Certainty]:
    """By quantity, from the errors of the next coarser rungs against the reference, finest first.

    Without rungs nothing is known of the error in h.
    """
    return {name: _certainty([e[name] for e in below], _POWERS.get(name, 1)) for name in QUANTITIES}


def _certainty(errors: Sequence[float | None], power: int) -> Certainty:
    known = [e**power for e in errors if e is not None]
    if not known:
        return Certainty(None, None)
    if known[0] <= ROUNDING**power:
        return Certainty(ROUNDING, None)
    order = _order(known[0], known[1], power) if len(known) > 1 else None
    believed = min(max(order or SLOWEST, SLOWEST), FASTEST)
    own = (known[0] / (2.0 ** (power * believed) - 1.0)) ** (1.0 / power)
    return Certainty(max(ROUNDING, own), order)


def _order(near: float, far: float, power: int) -> float | None:
    return math.log2(far / near - 1.0) / power if far > near * (1.0 + 1e-9) else None
