"""Checks of a law's parameters, with messages that say what is wrong, what is allowed and how to correct it."""

from __future__ import annotations

import sys
from numbers import Real
from typing import Any

from ..errors import InputError


def require_number(law: str, **parameters: Any) -> None:
    """Refuse anything but finite real numbers.

    Args:
        law: the law's name, for the message.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    for key, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, Real) or not _is_finite(value):
            raise InputError(f"law {law!r}: {key} = {value!r} is not usable; give a finite number")


def _is_finite(value: Any) -> bool:
    """Whether a number is finite as a float; whole numbers may be larger than any."""
    return bool(abs(value) <= sys.float_info.max)


def require_positive(law: str, **parameters: object) -> None:
    """Refuse anything but finite numbers > 0.

    Args:
        law: the law's name, for the message.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    require_number(law, **parameters)
    for key, value in parameters.items():
        if not float(value) > 0.0:  # type: ignore[arg-type]
            raise InputError(f"law {law!r}: {key} = {value!r} must be > 0; give its magnitude, in the scene's units")


def require_count(law: str, most: int, **parameters: object) -> None:
    """Refuse anything but whole numbers from 1 on.

    Args:
        law: the law's name, for the message.
        most: the largest number allowed.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    for key, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise InputError(f"law {law!r}: {key} = {value!r} must be a whole number from 1 to {most}")


def require_ordered(law: str, **parameters: float) -> None:
    """Refuse a residual below 0 or above the peak.

    Args:
        law: the law's name, for the message.
        parameters: the residual and the peak, in this order, by name.

    Raises:
        InputError: they are not 0 ≤ residual ≤ peak, peak > 0.
    """
    require_number(law, **parameters)
    (low_name, low), (high_name, high) = parameters.items()
    if not 0.0 <= low <= high or high == 0.0:
        raise InputError(
            f"law {law!r}: {low_name} = {low!r} and {high_name} = {high!r} do not fit; "
            f"allowed is 0 <= {low_name} <= {high_name} with {high_name} > 0"
        )
