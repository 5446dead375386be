"""Smoothings: from a law with kinks to one without, at a stated price (docs/laws.md)."""

from __future__ import annotations

import difflib

from ...errors import InputError
from .. import Superpotential
from .checks import require_epsilon
from .paper import PaperSmoothing
from .plus_functions import PLUS_FUNCTIONS, Chks, LogExp, PlusFunction, Quadratic
from .smoothed_law import SmoothedLaw

__all__ = [
    "PLUS_FUNCTIONS",
    "Chks",
    "LogExp",
    "PaperSmoothing",
    "PlusFunction",
    "Quadratic",
    "SmoothedLaw",
    "available",
    "create",
]


def available() -> tuple[str, ...]:
    """Names of all smoothings, the paper's own among them."""
    return tuple(sorted([*PLUS_FUNCTIONS, "paper"]))


def create(
    kind: str, law: Superpotential, *, epsilon: float | None = None, epsilon_absolute: float | None = None
) -> SmoothedLaw | PaperSmoothing:
    """The law, smoothed as a scene names it: with ε relative to the law's energy scale, or absolute in N/m.

    InputError for an unknown kind, and unless exactly one ε is given, finite and > 0.
    """
    if kind not in available():
        match = difflib.get_close_matches(str(kind), available(), n=1)
        hint = f" (did you mean {match[0]!r}?)" if match else ""
        raise InputError(f"unknown smoothing {kind!r}{hint}; available: {', '.join(available())}")
    width = _width(law, epsilon, epsilon_absolute)
    if kind != "paper":
        return SmoothedLaw(law, width, PLUS_FUNCTIONS[kind])
    return PaperSmoothing(law, width)  # type: ignore[arg-type]  # which refuses other laws, with advice


def _width(law: Superpotential, epsilon: float | None, epsilon_absolute: float | None) -> float:
    if (epsilon is None) == (epsilon_absolute is None):
        raise InputError(
            "smoothing: give either epsilon (relative to the law's energy scale, for example 0.01) "
            "or epsilon_absolute (in N/m)"
        )
    if epsilon_absolute is not None:
        require_epsilon("epsilon_absolute", epsilon_absolute)
        return float(epsilon_absolute)
    require_epsilon("epsilon", epsilon)
    return float(epsilon or 0.0) * law.energy_scale
