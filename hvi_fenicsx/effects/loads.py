"""What drives the body: tractions, body forces, prescribed displacements."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import ufl
from pydantic import model_validator

from ..errors import InputError
from .base import Condition, Contribution, Effect, Evaluate, FormulaField, Place, Stage, components


class _Listed(Effect):
    """An effect that the scene file writes as a bare list: ``traction = [1e6, 0]``."""

    values: tuple[Any, ...]

    @model_validator(mode="before")
    @classmethod
    def _from_list(cls, data: Any) -> Any:
        return {"values": tuple(data)} if isinstance(data, list | tuple) else data

    def check(self, dimension: int) -> None:
        """As many components as the scene has dimensions."""
        components(self.values, dimension, self.key)


class Traction(_Listed):
    """Surface traction t (N/m²): <g, v> gains ∫ t·v ds."""

    key: ClassVar[str] = "traction"
    place: ClassVar[Place] = Place.BOUNDARY
    term: ClassVar[str] = "<g, v> += ∫ t·v ds"

    values: tuple[FormulaField, ...]

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The linear form over its part."""
        if where is None:
            raise InputError("a traction needs a boundary part")
        vector = ufl.as_vector([stage.render(f) for f in self.values]) / stage.number(stage.stress)
        return Contribution(linear=(ufl.inner(vector, stage.test) * stage.facets(where),))

    def stress_scale(self, largest: Evaluate, length: float) -> float:
        """The largest component."""
        return max(largest(f) for f in self.values)


class BodyForce(_Listed):
    """Force per volume f (N/m³): <g, v> gains ∫ f·v dx."""

    key: ClassVar[str] = "force"
    place: ClassVar[Place] = Place.BODY
    term: ClassVar[str] = "<g, v> += ∫ f·v dx"

    values: tuple[FormulaField, ...]

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The linear form over its region."""
        factor = stage.number(stage.length / stage.stress)
        vector = factor * ufl.as_vector([stage.render(f) for f in self.values])
        return Contribution(linear=(ufl.inner(vector, stage.test) * stage.cells(where),))

    def stress_scale(self, largest: Evaluate, length: float) -> float:
        """The largest component times the body's length."""
        return max(largest(f) for f in self.values) * length


class PrescribedDisplacement(_Listed):
    """Displacement by component (m); ``"free"`` leaves a component alone."""

    key: ClassVar[str] = "displacement"
    place: ClassVar[Place] = Place.BOUNDARY
    term: ClassVar[str] = "u_i = value, by component"

    values: tuple[Literal["free"] | FormulaField, ...]

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The conditions of its components that are not free."""
        fixed = [(i, f) for i, f in enumerate(self.values) if f != "free"]
        return Contribution(conditions=tuple(Condition(i, f) for i, f in fixed))
