"""Energies of separation that differ by mode: by what a law of opening and slip is multiplied at a mode mixity.

With the share B of the slip in the work of the law, the energy of separation is G(B) = m(B) G_I. Such a law has no
potential: m is frozen at the mixity of a state, and the potential m g(δ) is solved, until the mixity stands.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from ..class_registry import enter
from ..typing import Array
from .parameter_checks import require_positive

_REGISTRY: dict[str, type] = {}


@dataclass(frozen=True)
class Mixity(ABC):
    """A criterion of mixed-mode separation. A subclass with a `name` is registered under it.

    Attributes:
        energy_ratio: the energy of slip alone over that of opening alone.
        exponent: of the criterion.
    """

    name: ClassVar[str]
    energy_ratio: float
    exponent: float

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        enter(_REGISTRY, cls, cls.name, "mixity")

    def __post_init__(self) -> None:
        require_positive(self.name, energy_ratio=self.energy_ratio, exponent=self.exponent)

    @abstractmethod
    def energy(self, share: Array) -> Array:
        """The energy of separation over that of opening alone, monotone in the share, (m,).

        Args:
            share: of the slip in the work, 0 to 1, (m,).
        """

    @property
    def least(self) -> float:
        """The least energy over that of opening alone."""
        return min(1.0, self.energy_ratio)

    @property
    def greatest(self) -> float:
        """The greatest one."""
        return max(1.0, self.energy_ratio)


class BenzeggaghKenane(Mixity):
    """G = G_I + (G_II - G_I) B^exponent (Benzeggagh and Kenane 1996)."""

    name = "benzeggagh_kenane"

    @override
    def energy(self, share: Array) -> Array:
        return np.asarray(1.0 + (self.energy_ratio - 1.0) * share**self.exponent)


class PowerLaw(Mixity):
    """(G (1 - B)/G_I)^exponent + (G B/G_II)^exponent = 1 (Wu and Reuter 1965)."""

    name = "power_law"

    @override
    def energy(self, share: Array) -> Array:
        parts = (1.0 - share) ** self.exponent + (share / self.energy_ratio) ** self.exponent
        return np.asarray(parts ** (-1.0 / self.exponent))


def mixities() -> dict[str, type[Mixity]]:
    """All criteria by name, sorted by it."""
    return dict(sorted(_REGISTRY.items()))
