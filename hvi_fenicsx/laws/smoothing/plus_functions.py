"""Smooth plus functions p(t; e) ≈ max(t, 0), of which every smoothing of a law is made.

Each is max(t, 0) + e D(|t|/e) with one profile D: convex, decreasing, D(0) = κ, D'(0) = -1/2. So the error
is at most κ e, largest at the kink and alike on both sides of it, and as D decays, so does the error away
from the kink. Computing D, and not p, keeps the difference p - max(t, 0) exact where it is tiny.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from typing_extensions import override

from ...typing import Array
from ..base import quotient


@dataclass(frozen=True)
class PlusFunction(ABC):
    """One smoothing of max(t, 0). t (m,) and the width e > 0 have the same unit; results have shape (m,)."""

    name: ClassVar[str]
    kappa: ClassVar[float]
    """The constant of |p(t; e) - max(t, 0)| ≤ κ e; it is attained at t = 0."""
    decay: ClassVar[str]
    """How the difference behaves away from the kink."""

    @abstractmethod
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        """D, D' and D'' at z = |t|/e ≥ 0, inf included."""

    def value(self, t: Array, e: float) -> Array:
        """The function p(t; e)."""
        return np.asarray(np.maximum(t, 0.0) + e * self._at(t, e)[0])

    def derivative(self, t: Array, e: float) -> Array:
        """Its derivative by t, from 0 to 1, and 1/2 at 0."""
        slope = self._at(t, e)[1]
        return np.where(t >= 0.0, 1.0 + slope, -slope)

    def second(self, t: Array, e: float) -> Array:
        """Its second derivative by t."""
        with np.errstate(over="ignore"):
            return np.asarray(self._at(t, e)[2] / e)

    def _at(self, t: Array, e: float) -> tuple[Array, Array, Array]:
        with np.errstate(over="ignore"):
            return self.profile(np.abs(t) / e)


@dataclass(frozen=True)
class Quadratic(PlusFunction):
    """Zang's: 0 for t ≤ -e/2, (t + e/2)²/(2e) between, t for t ≥ e/2. The paper's, and the default."""

    name = "quadratic"
    kappa = 1.0 / 8.0
    decay = "zero for |t| >= e/2"

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        rest = np.maximum(0.5 - z, 0.0)
        return 0.5 * rest**2, -rest, np.where(z < 0.5, 1.0, 0.0)


@dataclass(frozen=True)
class Chks(PlusFunction):
    """Chen, Harker, Kanzow, Smale: (t + √(t² + 4e²))/2. Smooth of every order, but felt far away."""

    name = "chks"
    kappa = 1.0
    decay = "at most e^2/|t|"

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        root = np.hypot(z, 2.0)
        # (√(z² + 4) - z)/2 and its derivative, written without the difference of near equals.
        difference = quotient(np.full_like(z, 2.0), root + z)
        return difference, -difference / root, 2.0 / root**3


@dataclass(frozen=True)
class LogExp(PlusFunction):
    """e log(1 + exp(t/e)), the neural networks' softplus. Smooth of every order."""

    name = "log_exp"
    kappa = math.log(2.0)
    decay = "at most e exp(-|t|/e)"

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        small = np.exp(-z)
        share = small / (1.0 + small)
        return np.log1p(small), -share, share / (1.0 + small)


QUADRATIC = Quadratic()
PLUS_FUNCTIONS: dict[str, PlusFunction] = {plus.name: plus for plus in (QUADRATIC, Chks(), LogExp())}
"""The family by name: a new member is a new class and an entry here."""
