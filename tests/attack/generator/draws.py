"""Random choices, and sizes that belong together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass
class Draw:
    """Random choices, and the sizes that make them belong together.

    Attributes:
        rng: the source.
        d: dimension.
        length: of the body, m.
        modulus: Young's modulus, N/m².
        stress: of the loads, N/m².
    """

    rng: np.random.Generator
    d: int
    length: float
    modulus: float
    stress: float

    def some(self, chance: float) -> bool:
        """True so often."""
        return bool(self.rng.random() < chance)

    def pick(self, *options: Any, p: list[float] | None = None) -> Any:
        """One of several."""
        return options[int(self.rng.choice(len(options), p=p))]

    def log(self, low: float, high: float) -> float:
        """10 to a power between two."""
        return round_to(10.0 ** self.rng.uniform(low, high))

    def signed(self, low: float, high: float) -> float:
        """The same with either sign."""
        return float(self.pick(-1.0, 1.0)) * self.log(low, high)

    @property
    def u0(self) -> float:
        """A displacement that the loads make."""
        return self.stress * self.length / self.modulus

    def vector(self, *components: float) -> list[Any]:
        """Components, zero where not named."""
        return [*components, *[0.0] * (self.d - len(components))][: self.d]


def round_to(value: float, digits: int = 6) -> float:
    """Few digits, so that a scene can be read."""
    return float(f"{value:.{digits}g}")


def new_draw(rng: np.random.Generator, d: int) -> Draw:
    steel = rng.random() < 0.6
    length = 1.0 if rng.random() < 0.6 else round_to(10.0 ** rng.uniform(-3, 2), 3)
    modulus = 2.15e11 if steel else round_to(10.0 ** rng.uniform(6, 12), 3)
    stress = 1e6 if rng.random() < 0.5 else round_to(modulus * 10.0 ** rng.uniform(-13, -3), 3)
    return Draw(rng, d, length, modulus, stress)
