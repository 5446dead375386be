"""What acts on Γc: unilateral contact with gap (paper: K) and nonmonotone friction (paper: j)."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import (
    BeforeValidator,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from .. import laws
from ..errors import InputError
from ..expressions import Formula
from .base import (
    BoundaryLaw,
    Contribution,
    Direction,
    Effect,
    Evaluate,
    FormulaField,
    NormalBounds,
    Place,
    Stage,
    refusal,
)


class Contact(Effect):
    """Unilateral contact: gap - u·n ≥ 0 at every vertex of the part, n outward, gap in m."""

    key: ClassVar[str] = "contact"
    place: ClassVar[Place] = Place.BOUNDARY
    exclusive: ClassVar[bool] = True
    term: ClassVar[str] = "K: gap - u·n ≥ 0 on Γc"

    gap: FormulaField
    """gap in m, a number or a formula in x, y, z"""

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


class Friction(Effect):
    """A law of the tangential displacement: -σ_t in ∂j(u_t); on lifted vertices too, as in the paper."""

    key: ClassVar[str] = "friction"
    place: ClassVar[Place] = Place.BOUNDARY
    exclusive: ClassVar[bool] = True
    term: ClassVar[str] = "∫ j⁰(u_t; v_t - u_t) ds on Γc, vertex quadrature"

    law: LawField
    """the law's name; its parameters stand beside it"""

    @model_validator(mode="before")
    @classmethod
    def _from_table(cls, data: Any) -> Any:
        law = data.get("law") if isinstance(data, dict) else None
        made = isinstance(data, cls) or isinstance(law, laws.Superpotential)
        return data if made else {"law": _law(data)}

    @model_serializer(mode="wrap")
    def _as_table(self, handler: SerializerFunctionWrapHandler) -> Any:
        return handler(self)["law"]

    def contribute(self, stage: Stage, where: str | None) -> Contribution:
        """The law, acting on the slip."""
        return Contribution(laws=(BoundaryLaw(Direction.SLIP, self.law),))

    def stress_scale(self, largest: Evaluate, length: float, modulus: float) -> float:
        """The law's own."""
        return self.law.traction_scale

    def check(self, dimension: int) -> None:
        """In 3D the law acts on |u_t| and must be even."""
        if dimension == 3 and not self.law.even:
            reason = "is one-sided; in 3D friction acts on |u_t| and must be even"
            raise InputError(f'law = "{self.law.name}" {reason}')
