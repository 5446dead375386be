"""Laws on Γc: friction (paper: j), adhesion, support, and cohesion of opening and slip together."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    PlainSerializer,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from .. import laws
from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..geometry import ROUNDING, spot
from ..laws import Mixity, mixities
from ..schema import Mistake, OneOf, refusal, shown, validation_error
from ..typing import Array
from .base import BodySizes, Effect, Evaluate, FormContext, Place, Sides, from_python
from .contribution import ONE, BoundaryLaw, Contribution, Direction
from .values import FormulaField, Value

_PLACES = np.outer([0, 1, -1], np.ones(3))
"""Where formulas are evaluated, m, until the law takes the numbers."""


@dataclass(frozen=True, kw_only=True)
class FormulaLaw:
    """A law some of whose numbers are formulas: a law of numbers, and what it is multiplied by from place to place.

    A law j of numbers gives the laws c m j(· / c) of all places, with m for the tractions and c for the lengths: one
    formula of each kind tells them, and all others must agree.

    Attributes:
        law: the law of numbers.
        multipliers: of its tractions and of its lengths, by these words.
        numbers: its numbers by the keys of its table: what each grows with, what it is, and its formula, or None.
    """

    law: laws.Superpotential
    multipliers: Mapping[str, SpatialValue]
    numbers: Mapping[str, tuple[str, float, Formula | None]]

    def contradictions(self, points: Array) -> list[str]:
        """What keeps the formulas from being one law, in words.

        Args:
            points: the vertices, m, (n, 3).
        """
        factors = {unit: value.at(points) for unit, value in self.multipliers.items()}
        found = []
        for key, (unit, number, formula) in self.numbers.items():
            value = Formula(number).at(points) if formula is None else formula.at(points)
            for i in np.flatnonzero(~np.isclose(value, number * factors[unit], rtol=ROUNDING, atol=0.0))[:1]:
                found.append(
                    f"{key} is {value[i]:.6g} at {spot(points[i])}, where the other parameters multiply the {unit}s by "
                    f"{factors[unit][i]:.6g}: the law would have another shape there. State all tractions, and all "
                    "lengths, with one formula each, or make pieces with laws of their own: `where`"
                )
        return found


def _formula_law(name: str, table: Mapping[str, Any]) -> FormulaLaw | None:
    """A law some of whose numbers are formulas; None where none is."""
    formulas = {key: formula for key, value in _leaves(table) if (formula := _formula(value)) is not None}
    if not formulas:
        return None
    law = _at_some_place(name, table)
    numbers = {
        key: (unit, float(number), formulas.get(key))
        for key, number in _leaves(laws.describe(law))
        if (unit := law.units.get(re.sub(r"\[\d+\]", "[]", key, count=1))) is not None and number
    }
    if missing := formulas.keys() - numbers.keys():
        raise InputError(
            f"law {name!r}: {min(missing)}: no formula can stand here, as it is not known how this number grows with "
            'lengths and tractions; state a number, and multiplier = "1 + x" or length_multiplier = "1 + x"'
        )
    multipliers: dict[str, SpatialValue] = {"traction": ONE, "length": ONE}
    for unit, number, formula in reversed(numbers.values()):
        if formula is not None:
            multipliers[unit] = Formula(f"({formula.source})/{number!r}")
    return FormulaLaw(law=law, multipliers=multipliers, numbers=numbers)


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """The entries of nested tables and lists."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            yield from _leaves(entry, str(name))
    elif isinstance(value, list | tuple):
        for i, entry in enumerate(value):
            yield from _leaves(entry, f"{key}[{i}]")
    else:
        yield key, value


def _formula(value: Any) -> Formula | None:
    """A text as a formula; None where it is none, or a number in quotes."""
    return Formula(value) if isinstance(value, str) and re.search(r"\b[xyz]\b", value) else None


def _at(value: Any, point: Array) -> Any:
    """A table with numbers in the place of formulas."""
    if isinstance(value, Mapping):
        return {key: _at(entry, point) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_at(entry, point) for entry in value]
    formula = _formula(value)
    return value if formula is None else float(formula.at(point[None])[0])


def _at_some_place(name: str, table: Mapping[str, Any]) -> laws.Superpotential:
    """The law at the first place where all formulas are numbers that it can have."""
    refused = []
    for point in _PLACES:
        try:
            return laws.create(name, _at(table, point))
        except InputError as error:
            refused.append(error)
    raise refused[0]


def _law(value: Any) -> laws.Superpotential | FormulaLaw:
    """The law of a table, or an object that is one."""
    if isinstance(value, laws.Superpotential):
        return value
    if not isinstance(value, dict):
        raise refusal(f'must be a table, like {{ law = "name", ... }}, or a law as an object (is {shown(value)})')
    parameters = dict(value)
    name = parameters.pop("law", None)
    if not isinstance(name, str):
        raise refusal(f'the law\'s name is missing: law = "name"; allowed: {", ".join(laws.available())}')
    try:
        return _formula_law(name, parameters) or laws.create(name, parameters)
    except InputError as error:
        if isinstance(error.__cause__, ValidationError):
            raise error.__cause__ from None  # it knows the place of each wrong parameter
        raise validation_error([Mistake(_parameter(str(error), parameters), str(error))]) from None


def _parameter(text: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    """The parameter that a law's message names first: a law refuses its parameters as a whole."""
    if text.startswith("unknown law "):
        return ("law",)
    named = re.findall(r"(\w+) = |'(\w+)'", text)
    return next(((name,) for pair in named for name in pair if name in table), ())


LawField = Annotated[
    laws.Superpotential,
    BeforeValidator(_law),
    PlainSerializer(laws.describe),
]
"""A superpotential as a field of a scene model: ``{ law = "name", ...parameters }``."""


def _positive(value: SpatialValue) -> SpatialValue:
    if value.is_number and not float(value.source) > 0.0:
        raise refusal(f"is {value.source} and must be positive; leave the law out where there is none")
    return value


Multiplier = Annotated[FormulaField, AfterValidator(_positive)]


def _times(one: SpatialValue, other: SpatialValue) -> SpatialValue:
    """The product of a multiplier and one of formulas."""
    if ONE in (one, other):
        return one if other == ONE else other
    return Formula(f"({one.source})*({other.source})")


class LawEffect(Effect):
    """A law that acts on one displacement of a boundary part.

    Class attributes:
        direction: the displacement it acts on.
    """

    place = Place.BOUNDARY
    exclusive = True
    on_interfaces = True
    direction: ClassVar[Direction]

    law: LawField
    """the name of the law; write its parameters as further keys of the same table"""
    multiplier: Multiplier = ONE
    """what all tractions of the law are multiplied by, a positive number or a formula in x, y, z"""
    length_multiplier: Multiplier = ONE
    """what all displacements of the law are multiplied by, a positive number or a formula in x, y, z"""
    _formulas: FormulaLaw | None = PrivateAttr(default=None)

    @from_python
    def __init__(
        self, side: Sides, law: laws.Superpotential, *, multiplier: Value = 1.0, length_multiplier: Value = 1.0
    ) -> None:
        self._make(side, law=law, multiplier=multiplier, length_multiplier=length_multiplier)

    @model_validator(mode="wrap")
    @classmethod
    def _from_table(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        if isinstance(data, cls) or (isinstance(data, dict) and isinstance(data.get("law"), laws.Superpotential)):
            return handler(data)
        if not isinstance(data, dict):
            return handler({"law": _law(data)})
        own = {key: data[key] for key in cls.model_fields if key != "law" and key in data}
        law = _law({key: value for key, value in data.items() if key not in own})
        if not isinstance(law, FormulaLaw):
            return handler({**own, "law": law})
        effect = handler({**own, "law": law.law})
        own = {"multiplier": effect.multiplier, "length_multiplier": effect.length_multiplier}
        told = zip(own.items(), law.multipliers.values(), strict=True)
        placed = effect.model_copy(update={key: _times(value, formula) for (key, value), formula in told})
        placed._formulas = law
        return placed

    @model_serializer(mode="wrap")
    def _as_table(self, handler: SerializerFunctionWrapHandler) -> Any:
        table = handler(self)
        unit = [key for key in ("multiplier", "length_multiplier") if getattr(self, key) == ONE]
        return {**table.pop("law"), **{key: value for key, value in table.items() if key not in unit}}

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on its displacement."""
        return Contribution(laws=(self._brought(),))

    def _brought(self, slip: float = 1.0) -> BoundaryLaw:
        check = self._formulas.contradictions if self._formulas else None
        return BoundaryLaw(
            self.direction, self.law, self.multiplier, self.length_multiplier, slip, contradictions=check
        )

    def implausible(self, largest: Evaluate, sizes: BodySizes) -> tuple[str, ...]:
        """A traction that is negative somewhere: it pushes the body on."""
        if self.law.c4 <= 1e-9 * self.law.traction_scale:
            return ()
        text = f"the law's traction falls to {-self.law.c4:.3g} N/m² at a displacement, where it does not resist but"
        return (f"{text} pushes the body on; is a sign wrong?",)

    def stress_scale(self, largest: Evaluate, sizes: BodySizes) -> float:
        """The law's own, times its multiplier."""
        return self.law.traction_scale * largest(self.multiplier)


class Friction(LawEffect):
    """A law of the tangential displacement: -σ_t ∈ ∂j(u_t). It also acts on lifted vertices, as in the paper."""

    key = "friction"
    term = "∫ j⁰(u_t; v_t - u_t) ds on Γc, vertex quadrature"
    direction = Direction.SLIP

    def check(self, dimension: int) -> None:
        """In 3D the law acts on |u_t| and must be even."""
        if dimension == 3 and not self.law.even:
            reason = "is one-sided; in 3D friction acts on |u_t| and must be even"
            raise InputError(f'law = "{self.law.name}" {reason}')


class Adhesion(LawEffect):
    """A law of the opening: σ_n ∈ ∂j(-u·n). It pulls the body back; it may act with or without unilateral contact."""

    key = "adhesion"
    term = "∫ j⁰(-u_n; -(v_n - u_n)) ds on Γc, vertex quadrature"
    direction = Direction.OPENING


class Support(LawEffect):
    """A law of the penetration (normal compliance): -σ_n ∈ ∂j(u·n). It pushes the body back."""

    key = "support"
    term = "∫ j⁰(u_n; v_n - u_n) ds on Γc, vertex quadrature"
    direction = Direction.PENETRATION


class Cohesion(LawEffect):
    """A law j = g(δ) of both modes, δ = sqrt(⟨opening⟩₊² + beta² |slip|²). Compression is contact's matter."""

    key = "cohesion"
    term = "∫ j⁰(u; v - u) ds on Γc, j = g(δ), δ² = ⟨-u_n⟩₊² + β² |u_t|², vertex quadrature"
    direction = Direction.SEPARATION

    beta: Annotated[float, Field(ge=1e-9, le=1e9)] = 1.0
    """what a slip is multiplied by beside an opening: the strength in shear is beta times that in tension, and both
    modes take the same energy"""
    mixity: Annotated[str | None, OneOf(mixities)] = None
    """the criterion by which the energy of separation depends on the mode; by default it does not"""
    energy_ratio: Annotated[float | None, Field(ge=1e-9, le=1e9)] = None
    """with mixity: the energy of slip alone over that of opening alone; the strength in shear is beta energy_ratio
    times that in tension"""
    exponent: Annotated[float | None, Field(ge=1.0, le=100.0)] = None
    """with mixity: the exponent of the criterion"""

    @from_python
    def __init__(
        self,
        side: Sides,
        law: laws.Superpotential,
        beta: float = 1.0,
        mixity: Mixity | None = None,
        *,
        multiplier: Value = 1.0,
        length_multiplier: Value = 1.0,
    ) -> None:
        keys = {"mixity": mixity.name, **asdict(mixity)} if isinstance(mixity, Mixity) else {"mixity": mixity}
        self._make(side, law=law, beta=beta, multiplier=multiplier, length_multiplier=length_multiplier, **keys)

    @model_validator(mode="after")
    def _whole(self) -> Self:
        given = [self.mixity, self.energy_ratio, self.exponent]
        if any(g is None for g in given) and any(g is not None for g in given):
            raise refusal("mixity, energy_ratio and exponent belong together: state all three of them, or none")
        return self

    @property
    def _criterion(self) -> Mixity | None:
        if self.mixity is None or self.energy_ratio is None or self.exponent is None:
            return None
        return mixities()[self.mixity](energy_ratio=self.energy_ratio, exponent=self.exponent)

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The law, acting on the effective displacement."""
        return Contribution(laws=(replace(self._brought(self.beta), mixity=self._criterion),))

    def check(self, dimension: int) -> None:
        """The law is known for δ ≥ 0 alone, and bonds do not push apart."""
        wrong = {
            "is one-sided; cohesion acts on δ, which is never negative: leave one_sided out": not self.law.even,
            "has a traction at rest, where there is no mode yet; with mixity let it rise from 0 on a short way": (
                self.mixity is not None and float(self.law.right(np.zeros(1))[0]) > 0.0
            ),
            "has negative tractions, which would push the sides apart; use adhesion and friction instead": (
                self.law.c4 > 0.0
            ),
        }
        for reason in (text for text, holds in wrong.items() if holds):
            raise InputError(f'law = "{self.law.name}" {reason}')
