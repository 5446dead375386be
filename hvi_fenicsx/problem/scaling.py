"""The scales that make a problem nondimensional: lengths by the body, stress by the load (physics.md, last section)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..effects import Drive, Effect, Evaluate, Sizes


@dataclass(frozen=True, slots=True)
class Scales:
    """What one nondimensional unit is in SI.

    Attributes:
        length: L in m.
        stress: p0 in N/m².
        modulus: E0 in N/m².
        dimension: 2 or 3.
    """

    length: float
    stress: float
    modulus: float
    dimension: int

    @property
    def displacement(self) -> float:
        """u0 = p0 L / E0, m."""
        return self.stress * self.length / self.modulus

    @property
    def energy(self) -> float:
        """p0 u0 L^(d-1): J/m in 2D, J in 3D."""
        return self.stress * self.displacement * self.length ** (self.dimension - 1)

    @property
    def force(self) -> float:
        """p0 L^(d-1): N/m in 2D, N in 3D."""
        return self.stress * self.length ** (self.dimension - 1)


Placed = tuple[str | None, Effect]
"""An effect with where it acts: a boundary part, a region, or None for the whole body."""


def sizes(length: float, effects: Sequence[Placed]) -> Sizes:
    """What the effects' scales may depend on.

    Args:
        length: L of the body, m.
        effects: those in force, with their places.
    """
    modulus = max((e.modulus_scale() for _, e in effects), default=0.0) or 1.0
    return Sizes(length, modulus, max((e.expansion_scale() for _, e in effects), default=0.0))


def choose(sizes: Sizes, dimension: int, effects: Sequence[Placed], evaluate: Callable[[Placed], Evaluate]) -> Scales:
    """The scales of a problem. Collective where ``evaluate`` is.

    The stress scale is the largest load; without one, that of the largest other driving effect (prescribed
    displacement, thermal strain); without that either, the largest law's: the solution is then zero and any will do.

    Args:
        sizes: of the body and its materials.
        dimension: 2 or 3.
        effects: those in force, with their places.
        evaluate: gives, for an effect with its place, the function that finds a formula's largest absolute value there.
    """
    stress = dict.fromkeys(Drive, 0.0)
    for placed in effects:
        effect = placed[1]
        size = effect.stress_scale(evaluate(placed), sizes)
        stress[effect.drive] = max(stress[effect.drive], size)
    chosen = next((stress[kind] for kind in Drive if stress[kind] > 0), 1.0)
    return Scales(sizes.length, chosen, sizes.modulus, dimension)
