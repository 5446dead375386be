"""Thermal strain: what a change of temperature would do to a free body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from typing_extensions import override

from ..errors import InputError
from .base import Drive, Evaluate, FormContext, Place, Sizes
from .contribution import Contribution
from .elasticity import Elasticity, strain, voigt
from .plain_values import OneValue


class Temperature(OneValue):
    """The temperature above that of the stress-free state (K): a number or a formula.

    Strains α ΔT by the material's `thermal_expansion`; the stress is C : (ε(u) - α ΔT I).
    """

    key: ClassVar[str] = "temperature"
    label: ClassVar[str] = "a change of temperature"
    place: ClassVar[Place] = Place.BODY
    drive: ClassVar[Drive] = Drive.KINEMATIC
    term: ClassVar[str] = "<g, v> += ∫ C:(α ΔT I):ε(v) dx"

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear forms over the materials of its region."""
        pairs = [(m, cells) for m, cells in _heated(context, where) if m.thermal_expansion]
        if not pairs:
            place = f" of {where}" if where else ""
            raise InputError(f"body.temperature does nothing: give the material{place} thermal_expansion = α (1/K)")
        loads = tuple(self._load(context, m) * cells for m, cells in pairs)
        return Contribution(strains=loads, across=tuple(self._across(context, pairs)))

    def _across(self, context: FormContext, heated: list[tuple[Elasticity, Any]]) -> Iterator[Any]:
        """What holds the thickness of a plane body back from expanding."""
        for material, cells in heated:
            if held := float(material.out_of_plane()[2]):
                yield -context.number(held / context.stress) * context.render(self.value) * context.scalar_test * cells

    def _load(self, context: FormContext, material: Elasticity) -> Any:
        """(C : αI) : ε(v) ΔT, nondimensional."""
        virtual = context.number(context.length) * strain(context.test)
        pairs = zip(material.thermal_stress() / context.stress, voigt(virtual, context.dimension), strict=True)
        return context.render(self.value) * sum(context.number(float(s)) * e for s, e in pairs if s)

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """E α ΔT."""
        return sizes.modulus * sizes.expansion * largest(self.value)


def _heated(context: FormContext, where: str | None) -> list[tuple[Elasticity, Any]]:
    """The materials in a region, with the measures of where they overlap it."""
    found = []
    for region, material in context.materials:
        cells = context.cells(where, region)
        if isinstance(material, Elasticity) and cells is not None:
            found.append((material, cells))
    return found
