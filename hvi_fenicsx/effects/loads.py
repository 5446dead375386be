"""What drives the body: tractions, body forces, prescribed displacements."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, PlainSerializer
from typing_extensions import override

from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..schema import refusal
from .base import Drive, Evaluate, FormContext, Place, Sizes, SurfaceLoad, part_of
from .contribution import Condition, Contribution
from .formula_field import FormulaField
from .plain_values import Listed


class Traction(Listed):
    """A surface traction t (N/m²): a list of formulas, one for each component."""

    key: ClassVar[str] = "traction"
    place: ClassVar[Place] = Place.BOUNDARY
    drive: ClassVar[Drive] = Drive.LOAD
    term: ClassVar[str] = "<g, v> += ∫ t·v ds"

    values: tuple[FormulaField, ...]

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its part."""
        import ufl  # here and below: a scene is read without it

        part = part_of(where, self.key)
        vector = ufl.as_vector([context.render(f) for f in self.values]) / context.number(context.stress)
        return Contribution(linear=(ufl.inner(vector, context.test) * context.facets(part, *self.values),))

    @override
    def surface_load(self) -> SurfaceLoad:
        """Its components."""
        return SurfaceLoad(self.values)

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest component."""
        return max(largest(f) for f in self.values)


class BodyForce(Listed):
    """A force per volume f (N/m³): a list of formulas, one for each component."""

    key: ClassVar[str] = "force"
    label: ClassVar[str] = "a force on the body itself"
    place: ClassVar[Place] = Place.BODY
    drive: ClassVar[Drive] = Drive.LOAD
    term: ClassVar[str] = "<g, v> += ∫ f·v dx"

    values: tuple[FormulaField, ...]

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The linear form over its region."""
        import ufl

        factor = context.number(context.length / context.stress)
        vector = factor * ufl.as_vector([context.render(f) for f in self.values])
        return Contribution(linear=(ufl.inner(vector, context.test) * context.cells(where),))

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The largest component times the body's length."""
        return max(largest(f) for f in self.values) * sizes.length


def _component(value: Any) -> Any:
    if value is None or (isinstance(value, str) and value == "free"):
        return "free"
    try:
        return value if isinstance(value, SpatialValue) else Formula(value)
    except InputError as error:
        raise refusal(f'{error}; or write "free" to leave the component alone') from None


Component = Annotated[
    Any,
    BeforeValidator(_component),
    PlainSerializer(lambda value: value.source if isinstance(value, SpatialValue) else value),
]
"""A formula or "free"."""


class PrescribedDisplacement(Listed):
    """A prescribed displacement (m): a list of formulas, one for each component. ``"free"`` prescribes nothing."""

    key: ClassVar[str] = "displacement"
    place: ClassVar[Place] = Place.BOUNDARY
    drive: ClassVar[Drive] = Drive.KINEMATIC
    term: ClassVar[str] = "u_i = value, by component"

    values: tuple[Component, ...]

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The conditions of its components that are not free."""
        return Contribution(conditions=tuple(Condition(i, self.values[i]) for i in self.prescribed()))

    @override
    def prescribed(self) -> tuple[int, ...]:
        """Indices of the components that are not free."""
        return tuple(i for i, f in enumerate(self.values) if f != "free")

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The stress of the largest component, as a strain over the body's length."""
        return max((largest(f) for f in self.values if f != "free"), default=0.0) * sizes.modulus / sizes.length
