"""The plus functions provided: a further one is a further class, here or in a file of the user's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from ...typing import Array
from ..convex_parts import quotient
from .smoothed_law import PlusFunction


@dataclass(frozen=True)
class Quadratic(PlusFunction):
    """Zang's: 0 for t ≤ -e/2, (t + e/2)²/(2e) between, t for t ≥ e/2. The paper's, and the default.

    The difference from max(t, 0) is zero for |t| ≥ e/2.
    """

    name = "quadratic"
    kappa = 1.0 / 8.0
    bands = (0.5,)
    unimodal = True
    parabolic = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        rest = np.maximum(0.5 - z, 0.0)
        return 0.5 * rest**2, -rest, np.where(z < 0.5, 1.0, 0.0)


@dataclass(frozen=True)
class Chks(PlusFunction):
    """Chen, Harker, Kanzow, Smale: (t + √(t² + 4e²))/2. Smooth of every order.

    The difference from max(t, 0) is at most e²/|t|.
    """

    name = "chks"
    kappa = 1.0
    unimodal = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        root = np.hypot(z, 2.0)
        # (√(z² + 4) - z)/2 and its derivative, written without the difference of near equals.
        difference = quotient(np.full_like(z, 2.0), root + z)
        return difference, -difference / root, 2.0 / root**3


@dataclass(frozen=True)
class LogExp(PlusFunction):
    """e log(1 + exp(t/e)), the neural networks' softplus. Smooth of every order.

    The difference from max(t, 0) is at most e exp(-|t|/e).
    """

    name = "log_exp"
    kappa = math.log(2.0)
    bands = (2.0, 8.0, 32.0)
    unimodal = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        small = np.exp(-z)
        share = small / (1.0 + small)
        return np.log1p(small), -share, share / (1.0 + small)


QUADRATIC = Quadratic()
