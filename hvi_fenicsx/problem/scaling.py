"""The scales that make a problem nondimensional: lengths by the body, stress by the load (physics.md, last section)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..effects import BodySizes, Contribution, Drive, Effect, Evaluate, Place
from ..errors import InputError


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
        _check(Scales(sizes.length, stress, sizes.modulus, dimension), placed, 0.0)
    if not driving:
        return Scales(sizes.length, 1.0, sizes.modulus, dimension)
    active = [pair for pair in driving if pair[1][1].drive is not Drive.RESISTANCE]
    stress, placed = max(active or driving, key=lambda pair: pair[0])
    chosen = Scales(sizes.length, stress, sizes.modulus, dimension)
    _check(chosen, placed, 1.0 / DEFAULT.largest_scale)
    return chosen


def _check(scales: Scales, placed: Placed, least: float) -> None:
    if not all(least <= scale <= DEFAULT.largest_scale for scale in (scales.stress, scales.displacement)):
        raise InputError(
            f"{place(placed)}: makes stresses of about {scales.stress:.0e} N/m² and displacements of about "
            f"{scales.displacement:.0e} m, which cannot be computed with; give all numbers, the modulus of "
            f"{scales.modulus:.0e} too, in m and N/m²"
        )


@dataclass(frozen=True, kw_only=True)
class CompositionThresholds:
    """What counts as rounding, and what a law's traction is judged by.

    Attributes:
        same: difference of two prescribed displacements, relative to the largest, of two vertices, over the body's
            length, or of normals (rad), up to which they are the same: a part is flat, two parts orthogonal or equal.
            Forces of a rigid motion, relative to those of a stretch, that are none; distance (of u0) of a prescribed
            displacement beyond a bound.
        rounding: relative rounding of the mesh's coordinates, and of a direction that the scene states; part of a facet
            that is too little to lie over another one.
        uneven: angle by which the normal of a part that is not flat may be turned at a vertex that it shares with
            another part or with a prescribed component: few digits in the coordinates explain so much.
        turned_to_prescribed: the same for a flat part at a prescribed component. Contact stays exact; a law sees the
            square of this angle.
        largest_scale: of stresses (N/m²) and displacements (m); its inverse is the smallest. Energies are products of
            both, so beyond this they are no numbers any more.
        law_scale: smallest scale of a law's traction, in units of the load's stress: a weaker law is not judged finer.
        facing: cosine of the largest angle between the normal of a facet and that against the one that it meets.
        uncovered: part of a facet at its end that may lie beyond the other side.
        rim: part of a facet by which the rims of curved sides may be apart and are still one.
        rim_parts: chords that stand for a curved edge at the end of a side.
        overlap: part of a facet's length by which bodies may overlap: curved sides that touch do so by less.
        least_force: forces that are a smaller part of stiffness times displacement are not judged finer.
        travel: a body that travels so many times its deformation has stresses without this travel: to take it off
            rounds too, so of other bodies it is not taken off.
    """

    same: float = 1e-8
    rounding: float = 1e-14
    uneven: float = 0.02
    turned_to_prescribed: float = 1e-4
    largest_scale: float = 1e100
    law_scale: float = 1e-3
    facing: float = 0.5
    uncovered: float = 1e-6
    rim: float = 0.01
    rim_parts: int = 8
    overlap: float = 0.1
    least_force: float = 1e-5
    travel: float = 100.0


DEFAULT = CompositionThresholds()


class PlacedContribution(NamedTuple):
    """An effect, its place and its contribution.

    Attributes:
        where: boundary part or region; None for the whole body.
        effect: the effect.
        contribution: its forms, conditions, bounds and laws.
    """

    where: str | None
    effect: Effect
    contribution: Contribution
