"""The scales that make a problem nondimensional: lengths by the body, stress by the load (physics.md, last section)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..effects import BodySizes, Drive, Effect, Evaluate, Place
from ..errors import InputError
from .thresholds import DEFAULT


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


def sizes(length: float, effects: Sequence[Placed]) -> BodySizes:
    """What the effects' scales may depend on.

    Args:
        length: L of the body, m.
        effects: those in force, with their places.
    """
    modulus = max((e.modulus_scale() for _, e in effects), default=0.0) or 1.0
    return BodySizes(length, modulus, max((e.expansion_scale() for _, e in effects), default=0.0))


def place(placed: Placed) -> str:
    """Where the scene states an effect.

    Args:
        placed: the effect with where it acts.
    """
    where, effect = placed
    name = where if effect.place is Place.BOUNDARY else effect.name
    return ".".join(filter(None, (effect.place.value, name, effect.key)))


def choose(
    sizes: BodySizes, dimension: int, effects: Sequence[Placed], evaluate: Callable[[Placed], Evaluate]
) -> Scales:
    """The scales of a problem. Collective where ``evaluate`` is.

    The stress scale is that of the largest driving effect: a load, or the strain of a prescribed displacement or of
    heat, beside which a small load would make the unit of displacement far too small. Without any it is the largest
    law's.

    Args:
        sizes: of the body and its materials.
        dimension: 2 or 3.
        effects: those in force, with their places.
        evaluate: gives, for an effect with its place, the function that finds a formula's largest absolute value there.

    Raises:
        InputError: an effect is so large, or all are so small, that their energies are no numbers.
    """
    found = [(placed[1].stress_scale(evaluate(placed), sizes), placed) for placed in effects]
    driving = [pair for pair in found if pair[0] != 0.0]
    for stress, placed in driving:
        _check(Scales(sizes.length, stress, sizes.modulus, dimension), placed, DEFAULT.largest_scale, 0.0)
    if not driving:
        return Scales(sizes.length, 1.0, sizes.modulus, dimension)
    active = [pair for pair in driving if pair[1][1].drive is not Drive.RESISTANCE]
    stress, placed = max(active or driving, key=lambda pair: pair[0])
    chosen = Scales(sizes.length, stress, sizes.modulus, dimension)
    _check(chosen, placed, DEFAULT.largest_scale, 1.0 / DEFAULT.largest_scale)
    return chosen


def _check(scales: Scales, placed: Placed, most: float, least: float) -> None:
    if not all(least <= scale <= most for scale in (scales.stress, scales.displacement)):
        raise InputError(
            f"{place(placed)}: makes stresses of about {scales.stress:.0e} N/m² and displacements of about "
            f"{scales.displacement:.0e} m, which cannot be computed with; give all numbers, the modulus of "
            f"{scales.modulus:.0e} too, in m and N/m²"
        )
