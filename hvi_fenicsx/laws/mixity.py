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
from ..errors import InputError
from ..typing import Array
from .parameter_checks import require_number, require_positive

_REGISTRY: dict[str, type] = {}


@dataclass(frozen=True)
class Mixity(ABC):
    """A criterion of mixed-mode separation. A subclass with a `name` is registered under it.

    Attributes:
        energy_ratio: the energy of slip alone over that of opening alone.
        exponent: of the criterion, at least 1.

    Raises:
        InputError: these are not such numbers.
    """

    name: ClassVar[str]
    energy_ratio: float
    exponent: float

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        enter(_REGISTRY, cls, cls.name, "mixity")

    def __post_init__(self) -> None:
        require_positive(self._title, energy_ratio=self.energy_ratio)
        require_number(self._title, exponent=self.exponent)
        if self.exponent < 1.0:
            raise InputError(f"{self._title}: exponent = {self.exponent!r} must be at least 1")

    @property
    def _title(self) -> str:
        """How messages name it."""
        return f"mixity {self.name!r}"

    @abstractmethod
    def energy(self, share: Array) -> Array:
        """The energy of separation over that of opening alone, monotone in the share, (m,).

        Args:
            share: of the slip in the work, 0 to 1, (m,).
        """

    @abstractmethod
    def slope(self, share: Array) -> Array:
        """The derivative of the energy by the share, (m,).

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

    @override
    def slope(self, share: Array) -> Array:
        return np.asarray((self.energy_ratio - 1.0) * self.exponent * share ** (self.exponent - 1.0))


class PowerLaw(Mixity):
    """(G (1 - B)/G_I)^exponent + (G B/G_II)^exponent = 1 (Wu and Reuter 1965)."""

    name = "power_law"

    @override
    def energy(self, share: Array) -> Array:
        return np.asarray(self._parts(share) ** (-1.0 / self.exponent))

    @override
    def slope(self, share: Array) -> Array:
        power = self.exponent - 1.0
        change = (1.0 - share) ** power - (share / self.energy_ratio) ** power / self.energy_ratio
        return np.asarray(change * self._parts(share) ** (-1.0 / self.exponent - 1.0))

    def _parts(self, share: Array) -> Array:
        return np.asarray((1.0 - share) ** self.exponent + (share / self.energy_ratio) ** self.exponent)


def mixities() -> dict[str, type[Mixity]]:
    """All criteria by name, sorted by it."""
    return dict(sorted(_REGISTRY.items()))
