"""Superpotentials as fields of a scene, and what every effect that brings one to Γc shares."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import (
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
from ..schema import refusal
from .base import Effect, Evaluate, FormContext, Place, Sizes
from .contribution import BoundaryLaw, Contribution, Direction


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
            raise error.__cause__ from None  # it knows the place of each wrong parameter
        raise refusal(str(error)) from None


LawField = Annotated[
    laws.Superpotential,
    BeforeValidator(_law),
    PlainSerializer(lambda law: laws.describe(law)),
]
"""A superpotential as a field of a scene model: ``{ law = "name", ...parameters }``."""


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
        return {**table.pop("law"), **table}

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on its displacement."""
        return Contribution(laws=(BoundaryLaw(self.direction, self.law),))

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
        """The law's own."""
        return self.law.traction_scale
