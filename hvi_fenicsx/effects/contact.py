"""What acts on Γc: unilateral contact with gap (paper: K) and nonmonotone friction (paper: j)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from .. import laws
from ..errors import InputError
from ..expressions import Formula
from .base import BoundaryLaw, Contribution, Direction, Effect, FormulaField, NormalBounds, Place, Stage


class Contact(Effect):
    """Unilateral contact: gap - u·n ≥ 0 at every vertex of the part, n outward, gap in m."""

    key: ClassVar[str] = "contact"
    place: ClassVar[Place] = Place.BOUNDARY
    term: ClassVar[str] = "K: gap - u·n ≥ 0 on Γc"

    gap: FormulaField

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The bound on the normal displacement."""
        return Contribution(bounds=(NormalBounds(lower=_negative(self.gap), upper=None),))


def _negative(formula: Formula) -> Formula:
    source = formula.source
    return Formula(f"-({source})") if isinstance(source, str) else Formula(-source)


def _law(value: Any) -> laws.Superpotential:
    if isinstance(value, laws.Superpotential):
        return value
    if not isinstance(value, dict):
        raise PydanticCustomError("law", 'a law is a table: {{ law = "name", ... }}')
    parameters = dict(value)
    name = parameters.pop("law", None)
    if not isinstance(name, str):
        allowed = ", ".join(laws.available())
        raise PydanticCustomError("law", 'law = "name" is missing; allowed: {allowed}', {"allowed": allowed})
    try:
        return laws.create(name, parameters)
    except InputError as error:
        raise PydanticCustomError("law", "{reason}", {"reason": str(error)}) from None


LawField = Annotated[
    laws.Superpotential,
    BeforeValidator(_law),
    PlainSerializer(laws.describe),
    WithJsonSchema({"type": "object", "title": "a law: { law = name, ...its parameters }"}),
]
"""A superpotential as a field of a scene model: ``{ law = "name", ...parameters }``."""


class Friction(Effect):
    """A law of the tangential displacement: -σ_t in ∂j(u_t). It acts on lifted vertices too, as in the paper."""

    model_config = {"arbitrary_types_allowed": True}

    key: ClassVar[str] = "friction"
    place: ClassVar[Place] = Place.BOUNDARY
    term: ClassVar[str] = "∫ j⁰(u_t; v_t - u_t) ds on Γc, vertex quadrature"

    law: LawField

    @model_validator(mode="before")
    @classmethod
    def _from_table(cls, data: Any) -> Any:
        return {"law": _law(data)} if isinstance(data, dict) and isinstance(data.get("law"), str) else data

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The law, acting on the slip."""
        return Contribution(laws=(BoundaryLaw(Direction.SLIP, self.law),))

    def check(self, dimension: int) -> None:
        """In 3D the law acts on |u_t| and must be even."""
        if dimension == 3 and not self.law.even:
            raise InputError(f'law = "{self.law.name}" is one-sided; in 3D friction acts on |u_t| and must be even')
