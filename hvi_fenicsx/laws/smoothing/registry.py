"""Smoothings by name, as a scene file names them."""

from __future__ import annotations

from ...class_registry import hint
from ...errors import InputError
from ..base import Superpotential
from .base import SmoothedLaw, registered, require_epsilon


def available() -> tuple[str, ...]:
    """Names of all smoothings, the user's own among them."""
    return tuple(registered())


def create(
    name: str, law: Superpotential, *, epsilon: float | None = None, epsilon_absolute: float | None = None
) -> SmoothedLaw:
    """The law, smoothed as a scene says it.

    Args:
        name: of the smoothing.
        law: with kinks or without.
        epsilon: the width ε relative to the law's energy scale.
        epsilon_absolute: instead, the width ε in N/m.

    Raises:
        InputError: the name is unknown, not exactly one ε is given, it is no finite number > 0, or the smoothing cannot
            smooth this law.
    """
    kind = registered().get(name)
    if kind is None:
        names = available()
        raise InputError(f"unknown smoothing {name!r}{hint(name, names)}; available: {', '.join(names)}")
    if epsilon is not None and epsilon_absolute is None:
        return kind().relative(law, epsilon)
    if epsilon_absolute is not None and epsilon is None:
        require_epsilon("epsilon_absolute", epsilon_absolute)
        return kind().smooth(law, float(epsilon_absolute))
    raise InputError(
        "smoothing: give either epsilon (relative to the law's energy scale, for example 0.01) "
        "or epsilon_absolute (in N/m)"
    )
