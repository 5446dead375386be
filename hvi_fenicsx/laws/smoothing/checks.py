"""The check that all smoothings share."""

from __future__ import annotations

import math
from numbers import Real

from ...errors import InputError


def require_epsilon(key: str, epsilon: object) -> None:
    """Refuse anything but a finite number > 0."""
    number = isinstance(epsilon, Real) and not isinstance(epsilon, bool)
    if not number or not math.isfinite(epsilon) or not epsilon > 0.0:  # type: ignore[arg-type, operator]
        raise InputError(
            f"smoothing: {key} = {epsilon!r} must be a finite number > 0; "
            f"for the unsmoothed law leave smoothing and {key} away"
        )
