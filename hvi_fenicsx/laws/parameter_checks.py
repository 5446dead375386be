"""Checks of numbers that a law or a criterion is made of; messages say what is wrong, and how to correct it."""

from __future__ import annotations

import sys
from numbers import Real
from typing import Any

from ..errors import InputError


def require_number(owner: str, **parameters: Any) -> None:
    """Refuse anything but finite real numbers.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    for key, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, Real) or not _is_finite(value):
            raise InputError(f"{owner}: {key} = {value!r} is not usable; give a finite number")


def _is_finite(value: Any) -> bool:
    """Whether a number is finite as a float; whole numbers may be larger than any."""
    return bool(abs(value) <= sys.float_info.max)


def require_positive(owner: str, **parameters: object) -> None:
    """Refuse anything but finite numbers > 0.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    require_number(owner, **parameters)
    for key, value in parameters.items():
        if not float(value) > 0.0:  # type: ignore[arg-type]
            raise InputError(f"{owner}: {key} = {value!r} must be > 0; give its magnitude")


def require_count(owner: str, most: int, **parameters: object) -> None:
    """Refuse anything but whole numbers from 1 on.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        most: the largest number allowed.
        parameters: by name.

    Raises:
        InputError: with the first that is none.
    """
    for key, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise InputError(f"{owner}: {key} = {value!r} must be a whole number from 1 to {most}")


def require_ordered(owner: str, **parameters: float) -> None:
    """Refuse a residual below 0 or above the peak.

    Args:
        owner: whose they are, for the message: ``law 'tresca'``.
        parameters: the residual and the peak, in this order, by name.

    Raises:
        InputError: they are not 0 ≤ residual ≤ peak, peak > 0.
    """
    require_number(owner, **parameters)
    (low_name, low), (high_name, high) = parameters.items()
    if not 0.0 <= low <= high or high == 0.0:
        raise InputError(
            f"{owner}: {low_name} = {low!r} and {high_name} = {high!r} do not fit; "
            f"allowed is 0 <= {low_name} <= {high_name} with {high_name} > 0"
        )
