"""What a plus function adds to a function at its kinks: value and derivatives from one evaluation of its profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...typing import Array
from ..convex_parts import folded

_LARGEST = float(np.finfo(np.float64).max)

Profiles = tuple[Array, Array, Array]
"""D, D' and D'', of one shape."""


@dataclass(frozen=True, eq=False)
class RoundedKinks:
    """What plus functions of the widths ε/|jump| add at the kinks of a function.

    Attributes:
        places: of the kinks, (k,).
        jumps: of the derivative there, positive or negative, (k,).
        profile: D, D' and D'' of the plus function at z = |t|/e ≥ 0.
        epsilon: ε.
    """

    places: Array
    jumps: Array
    profile: Callable[[Array], Profiles]
    epsilon: float

    def less(self, other: RoundedKinks) -> RoundedKinks:
        """What is added here less what is added at other kinks.

        Args:
            other: those.
        """
        jumps = np.concatenate([self.jumps, -other.jumps])
        return RoundedKinks(np.concatenate([self.places, other.places]), jumps, self.profile, self.epsilon)

    @cached_property
    def _heights(self) -> Array:
        return np.abs(self.jumps)

    @cached_property
    def _stiffness(self) -> Array:
        """By what D'' is multiplied at each kink, (k,)."""
        with np.errstate(over="ignore"):
            return np.sign(self.jumps) * np.minimum(self._heights / self.epsilon * self._heights, _LARGEST)

    def profiles(self, x: Array) -> Profiles:
        """D, D', D'' (m, k) of each point and kink, at their distance in units of the kink's width.

        Args:
            x: points, (m,).
        """
        return self._profiles(np.abs(x[:, None] - self.places))

    def _profiles(self, distances: Array) -> Profiles:
        with np.errstate(over="ignore"):
            return self.profile(distances / self.epsilon * self._heights)

    def values(self, profiles: Profiles) -> Array:
        """What is added to the function, (m,).

        Args:
            profiles: of the points.
        """
        return np.asarray(self.epsilon * (profiles[0] * np.sign(self.jumps)).sum(axis=1))

    def slopes(self, x: Array, profiles: Profiles) -> Array:
        """What is added to the right derivative, (m,).

        Args:
            x: points, (m,).
            profiles: of them.
        """
        # Right of a kink the plus function's slope is 1 + D', left of it -D'; the 1 is the function's own jump.
        turned = np.where(x[:, None] >= self.places, profiles[1], -profiles[1])
        return np.asarray(turned @ self.jumps)

    def curvatures(self, profiles: Profiles) -> Array:
        """What is added to the second derivative, (m,).

        Args:
            profiles: of the points.
        """
        with np.errstate(over="ignore"):
            return np.asarray((profiles[2] * self._stiffness).sum(axis=1))

    def curvature_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest of these on intervals, where D'' never rises and all jumps are positive, (m,) each.

        Args:
            low: begin of the intervals, (m,).
            high: end of the intervals, (m,).
        """
        near, far = folded(low[:, None] - self.places, high[:, None] - self.places)
        return self.curvatures(self._profiles(far)), self.curvatures(self._profiles(near))
