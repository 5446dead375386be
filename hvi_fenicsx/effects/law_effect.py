"""Superpotentials as fields of a scene, and what every effect that brings one to Γc shares."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ModelWrapValidatorHandler,
    PlainSerializer,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic_core import InitErrorDetails
from typing_extensions import override

from .. import laws
from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..schema import refusal, shown
from . import law_formulas
from .base import Effect, Evaluate, FormContext, Place, Sizes
from .contribution import ONE, BoundaryLaw, Contribution, Direction
from .formula_field import FormulaField
from .law_formulas import PlacedLaw


def _law(value: Any) -> PlacedLaw:
    if isinstance(value, laws.Superpotential):
        return PlacedLaw(law=value)
    if not isinstance(value, dict):
        raise refusal('must be a table, like { law = "name", ... }')
    parameters = dict(value)
    name = parameters.pop("law", None)
    if not isinstance(name, str):
        raise refusal(f'the law\'s name is missing: law = "name"; allowed: {", ".join(laws.available())}')
    try:
        return law_formulas.create(name, parameters)
    except InputError as error:
        if isinstance(error.__cause__, ValidationError):
            raise _explained(error.__cause__) from None  # it knows the place of each wrong parameter
        raise refusal(str(error)) from None


def _explained(error: ValidationError) -> ValidationError:
    """What is wrong with a law's parameters; if one is a text, why it is no formula."""
    for found in error.errors():
        if found["type"] == "float_type" and isinstance(text := found["input"], str):
            try:
                Formula(text)
            except InputError as wrong:
                said = refusal(f"must be a number (is {shown(text)}) or a formula in x, y, z: {wrong}")
                details = InitErrorDetails(type=said, loc=found["loc"], input=text)
                return ValidationError.from_exception_data(error.title, [details])
    return error


LawField = Annotated[
    laws.Superpotential,
    BeforeValidator(lambda value: _law(value).law),
    PlainSerializer(lambda law: laws.describe(law)),
]
"""A superpotential as a field of a scene model: ``{ law = "name", ...parameters }``."""


def _positive(value: SpatialValue) -> SpatialValue:
    if value.is_number and not float(value.source) > 0.0:
        raise refusal(f"is {value.source} and must be positive; leave the law out where there is none")
    return value


Multiplier = Annotated[FormulaField, AfterValidator(_positive)]


def _lowest_traction(law: laws.Superpotential) -> float:
    """The smallest traction at the kinks and on the way to four times the typical displacement, N/m²."""
    x = np.concatenate([law.kinks[law.kinks > 0.0], np.linspace(0.0, 4.0, 65)[1:] * law.length_scale])
    return float(np.min([law.left(x), law.right(x)]))


class LawEffect(Effect):
    """A law that acts on one displacement of a boundary part.

    Class attributes:
        direction: the displacement it acts on.
    """

    place: ClassVar[Place] = Place.BOUNDARY
    exclusive: ClassVar[bool] = True
    on_interfaces: ClassVar[bool] = True
    direction: ClassVar[Direction]

    law: LawField
    """the name of the law; write its parameters as further keys of the same table"""
    multiplier: Multiplier = ONE
    """what all tractions of the law are multiplied by, a positive number or a formula in x, y, z"""
    length_multiplier: Multiplier = ONE
    """what all displacements of the law are multiplied by, a positive number or a formula in x, y, z"""
    _placed: PlacedLaw | None = PrivateAttr(default=None)
    _given: dict[str, Any] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _from_table(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        law = data.get("law") if isinstance(data, dict) else None
        if isinstance(data, cls) or isinstance(law, laws.Superpotential):
            return handler(data)
        if not isinstance(data, dict):
            return handler({"law": _law(data).law})
        own = {key: data[key] for key in cls.model_fields if key != "law" and key in data}
        placed = _law({key: value for key, value in data.items() if key not in own})
        effect = handler({"law": placed.law, **own})
        return effect._multiplied_by(placed, data) if placed.parameters else effect

    def _multiplied_by(self, placed: PlacedLaw, given: dict[str, Any]) -> Self:
        """The effect with what formulas in the place of numbers make of its law; it is stored as it was given."""
        changed = self.model_copy(
            update={
                "multiplier": law_formulas.times(self.multiplier, placed.multiplier),
                "length_multiplier": law_formulas.times(self.length_multiplier, placed.length_multiplier),
            }
        )
        changed._placed, changed._given = placed, given
        return changed

    @model_serializer(mode="wrap")
    def _as_table(self, handler: SerializerFunctionWrapHandler) -> Any:
        table = handler(self)
        for key in ("multiplier", "length_multiplier"):
            if self._given or getattr(self, key) == ONE:
                table.pop(key, None)  # pydantic may have been told to leave it out
        return {**table.pop("law"), **table, **self._given}

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on its displacement."""
        return Contribution(laws=(self._brought(),))

    def _brought(self, slip: float = 1.0) -> BoundaryLaw:
        return BoundaryLaw(
            self.direction,
            self.law,
            self.multiplier,
            self.length_multiplier,
            slip,
            contradictions=self._placed.contradictions if self._placed else None,
        )

    @override
    def implausible(self, largest: Evaluate, sizes: Sizes) -> tuple[str, ...]:
        """A traction that is negative somewhere: it pushes the body on."""
        lowest = _lowest_traction(self.law)
        if lowest >= -1e-9 * self.law.traction_scale:
            return ()
        return (
            f"the law's traction falls to {lowest:.3g} N/m² at a positive displacement, where it does not resist but "
            "pushes the body on; is a sign wrong?",
        )

    @override
    def stress_scale(self, largest: Evaluate, sizes: Sizes) -> float:
        """The law's own, times its multiplier."""
        return self.law.traction_scale * largest(self.multiplier)
