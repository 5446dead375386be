"""Superpotentials as fields of a scene, and what every effect that brings one to Γc shares."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)
from typing_extensions import override

from .. import laws
from ..errors import InputError
from ..formula import Formula
from ..schema import refusal, shown
from ..spatial_value import SpatialValue
from .base import Effect, Evaluate, FormContext, Place, Sizes
from .contribution import ONE, BoundaryLaw, Contribution, Direction
from .formula_field import FormulaField


def _law(value: Any) -> laws.Superpotential:
    if isinstance(value, laws.Superpotential):
        return value
    if not isinstance(value, dict):
        raise refusal('must be a table, like { law = "name", ... }')
    parameters = dict(value)
    name = parameters.pop("law", None)
    if not isinstance(name, str):
        raise refusal(f'the law\'s name is missing: law = "name"; allowed: {", ".join(laws.available())}')
    try:
        return laws.create(name, parameters)
    except InputError as error:
        if isinstance(error.__cause__, ValidationError):
            _refuse_formulas(error.__cause__)
            raise error.__cause__ from None  # it knows the place of each wrong parameter
        raise refusal(str(error)) from None


def _refuse_formulas(error: ValidationError) -> None:
    """Say how a law changes from place to place, where a formula stands for one of its numbers."""
    for found in error.errors():
        given = found["input"]
        if found["type"] == "float_type" and isinstance(given, str) and _is_formula(given):
            key = ".".join(map(str, found["loc"]))
            raise refusal(
                f"{key} = {shown(given)}: the parameters of a law are numbers. Where its tractions change from place "
                'to place, state them once and what they are multiplied by: multiplier = "1 + x"'
            )


def _is_formula(text: str) -> bool:
    """Whether a text is a formula, and no number in quotes."""
    try:
        formula = Formula(text)
    except InputError:
        return False
    try:
        return float(text) != formula.at(np.zeros((1, 3)))[0]
    except ValueError:
        return True


LawField = Annotated[
    laws.Superpotential,
    BeforeValidator(_law),
    PlainSerializer(lambda law: laws.describe(law)),
]
"""A superpotential as a field of a scene model: ``{ law = "name", ...parameters }``."""


def _positive(value: SpatialValue) -> SpatialValue:
    if value.is_number and not float(value.source) > 0.0:
        raise refusal(f"multiplier = {value.source} must be positive; leave the law out where there is none")
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

    @model_validator(mode="before")
    @classmethod
    def _from_table(cls, data: Any) -> Any:
        law = data.get("law") if isinstance(data, dict) else None
        if isinstance(data, cls) or isinstance(law, laws.Superpotential):
            return data
        if not isinstance(data, dict):
            return {"law": _law(data)}
        own = {key: data[key] for key in cls.model_fields if key != "law" and key in data}
        return {"law": _law({key: value for key, value in data.items() if key not in own}), **own}

    @model_serializer(mode="wrap")
    def _as_table(self, handler: SerializerFunctionWrapHandler) -> Any:
        table = handler(self)
        if self.multiplier == ONE:
            del table["multiplier"]
        return {**table.pop("law"), **table}

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on its displacement."""
        return Contribution(laws=(self._brought(),))

    def _brought(self, slip: float = 1.0) -> BoundaryLaw:
        return BoundaryLaw(self.direction, self.law, self.multiplier, slip)

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
