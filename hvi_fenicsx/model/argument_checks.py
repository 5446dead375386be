"""Checks of the arguments that Python functions of the program are given, with messages that name them."""

from __future__ import annotations

import math
import os
from numbers import Real
from typing import Any

import numpy as np

from ..errors import InputError


def require_switch(name: str, given: Any) -> None:
    """Refuse anything but True and False.

    Args:
        name: of the argument.
        given: what the user gave.

    Raises:
        InputError: it is something else.
    """
    if not isinstance(given, bool | np.bool_):
        raise InputError(f"{name}: must be True or False (is {given!r})")


def require_between(name: str, given: Any, high: float = math.inf) -> None:
    """Refuse anything but a number above 0 and below a limit.

    Args:
        name: of the argument.
        given: what the user gave.
        high: the limit.

    Raises:
        InputError: it is something else.
    """
    number = isinstance(given, Real) and not isinstance(given, bool | np.bool_)
    if not number or not 0.0 < given < high:
        wanted = "above 0" if math.isinf(high) else f"above 0 and below {high:g}"
        raise InputError(f"{name}: must be a number {wanted} (is {given!r})")


def require_kind(name: str, given: Any, kinds: tuple[type, ...], wanted: str) -> None:
    """Refuse anything but a value of some kinds; a boolean is no number.

    Args:
        name: of the argument.
        given: what the user gave.
        kinds: those that are allowed.
        wanted: the same in words.

    Raises:
        InputError: it is something else.
    """
    if isinstance(given, bool) or not isinstance(given, kinds):
        raise InputError(f"{name}: must be {wanted} (is {given!r})")


def require_path(name: str, given: Any) -> None:
    """Refuse anything but a path.

    Args:
        name: of the argument.
        given: what the user gave.

    Raises:
        InputError: it is something else.
    """
    require_kind(name, given, (str, os.PathLike), "a path, as a text or a pathlib.Path")
