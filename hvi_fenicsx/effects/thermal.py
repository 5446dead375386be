"""Thermal strain: what a change of temperature would do to a free body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from ..errors import InputError
from .base import Contribution, Drive, Effect, Evaluate, FormulaField, Place, Sizes, Stage
from .elasticity import Elasticity, strain


class Temperature(Effect):
    """Temperature above that of the stress-free state (K), a number or a formula.

    Strains α ΔT by the material's `thermal_expansion`; the stress is C : (ε(u) - α ΔT I).
    """

    key: ClassVar[str] = "temperature"
    place: ClassVar[Place] = Place.BODY
    drive: ClassVar[Drive] = Drive.KINEMATIC
    term: ClassVar[str] = "<g, v> += ∫ C:(α ΔT I):ε(v) dx"

    value: FormulaField

    @model_validator(mode="before")
    @classmethod
    def _from_value(cls, data: Any) -> Any:
        return data if isinstance(data, cls | dict) else {"value": data}

    @model_serializer(mode="wrap")
    def _as_value(self, handler: SerializerFunctionWrapHandler) -> Any:
        return handler(self)["value"]

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The linear forms over the materials of its region."""
        pairs = [(m, cells) for m, cells in _heated(stage, where) if m.thermal_expansion]
        if not pairs:
            place = f" of {where}" if where else ""
            raise InputError(f"body.temperature does nothing: give the material{place} thermal_expansion = α (1/K)")
        loads = tuple(self._load(stage, m) * cells for m, cells in pairs)
        return Contribution(strains=loads, across=tuple(self._across(stage, pairs)))

    def _across(self, stage: Stage, heated: list[tuple[Elasticity, Any]]) -> Iterator[Any]:
        """What holds the thickness of a plane body back from expanding."""
        for material, cells in heated:
            if held := float(material.out_of_plane()[2]):
                yield -stage.number(held / stage.stress) * stage.render(self.value) * stage.scalar_test * cells

    def _load(self, stage: Stage, material: Elasticity) -> Any:
        """(C : αI) : ε(v) ΔT, nondimensional."""
        virtual = stage.number(stage.length) * strain(stage.test)
        stress = material.thermal_stress() / stage.stress
        normal = range(stage.dimension)
        pairs = [(i, i) for i in normal] + ([(0, 1)] if len(normal) == 2 else [(1, 2), (0, 2), (0, 1)])
        work = sum(
            stage.number(float(s)) * (virtual[i, j] if i == j else 2 * virtual[i, j])
            for s, (i, j) in zip(stress, pairs, strict=True)
            if s
        )
        return stage.render(self.value) * work

    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """E α ΔT."""
        return sizes.modulus * sizes.expansion * largest(self.value)


def _heated(stage: Stage, where: str | None) -> list[tuple[Elasticity, Any]]:
    """The materials in a region, with the measures of where they overlap it."""
    found = []
    for region, material in stage.materials:
        cells = stage.cells(where, region)
        if isinstance(material, Elasticity) and cells is not None:
            found.append((material, cells))
    return found
