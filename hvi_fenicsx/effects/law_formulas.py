"""Laws whose numbers are formulas: one law of numbers, and by what its tractions and lengths are multiplied.

A law j of numbers gives the laws c m j(· / c) of all places, with m for the tractions and c for the lengths. A number
whose unit is lengthᵃ tractionᵇ then is cᵃ mᵇ times what it is in j. Two of them tell c and m; all others must agree.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import laws
from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..geometry import spot
from ..typing import Array
from .contribution import ONE

_PLACES = np.outer([0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, -1e-2, -0.1, -1.0, -10.0], np.ones(3))
"""Where formulas are evaluated, m, until the law takes the numbers."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number of a law, or a formula in its place.

    Attributes:
        key: where it stands in the law's table.
        given: what it is at a place.
        number: what it is in the law of numbers, not 0.
        powers: of length and of traction in its unit.
    """

    key: str
    given: Formula
    number: float
    powers: tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class FormulaLaw:
    """A law of numbers, and what it is multiplied by from place to place.

    Attributes:
        law: the law.
        length_multiplier: of its lengths.
        multiplier: of its tractions.
        parameters: its numbers that have a unit.
    """

    law: laws.Superpotential
    length_multiplier: SpatialValue
    multiplier: SpatialValue
    parameters: tuple[Parameter, ...]

    def contradictions(self, points: Array) -> list[str]:
        """What keeps the formulas from being one law, in words.

        Args:
            points: the vertices, m, (n, 3).
        """
        lengths, tractions = self.length_multiplier.at(points), self.multiplier.at(points)
        found = []
        for parameter in self.parameters:
            length, traction = parameter.powers
            value = parameter.given.at(points)
            wanted = parameter.number * lengths**length * tractions**traction
            for i in np.flatnonzero(~np.isclose(value, wanted, rtol=1e-9, atol=0.0))[:1]:
                found.append(
                    f"{parameter.key} is {value[i]:.6g} at {spot(points[i])}, where the other parameters multiply the "
                    f"lengths by {lengths[i]:.6g} and the tractions by {tractions[i]:.6g}: the law would have another "
                    "shape there. State all tractions, and all lengths, with one formula each, or make pieces with "
                    "laws of their own: `where`"
                )
        return found


def create(name: str, table: Mapping[str, Any]) -> FormulaLaw | None:
    """A law of a scene some of whose numbers are formulas; None where none is.

    Args:
        name: of the law.
        table: its parameters.

    Raises:
        InputError: it is no law, or formulas cannot stand for its numbers.
    """
    formulas = {key: formula for key, value in _leaves(table) if (formula := _formula(value)) is not None}
    if not formulas:
        return None
    law = _at_some_place(name, table)
    parameters = _parameters(law, formulas)
    if missing := formulas.keys() - {p.key for p in parameters}:
        raise InputError(
            f"law {name!r}: {min(missing)}: no formula can stand here, as it is not known how this number grows with "
            'lengths and tractions; state a number, and multiplier = "1 + x" or length_multiplier = "1 + x"'
        )
    told = [p for p in parameters if not p.given.is_number] + [p for p in parameters if p.given.is_number]
    pair = told[:1] + [p for p in told if np.linalg.det([told[0].powers, p.powers]) != 0.0][:1]
    lengths, tractions = (_product(pair, row) for row in np.linalg.pinv(np.array([p.powers for p in pair], float)))
    return FormulaLaw(law=law, length_multiplier=lengths, multiplier=tractions, parameters=tuple(parameters))


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
    """A text as a formula; None where it is none, or a number in quotes.

    Raises:
        InputError: it has coordinates and is no formula.
    """
    if not isinstance(value, str) or not re.search(r"\b[xyz]\b", value):
        return None
    return Formula(value)


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
    refused: InputError | None = None
    for point in _PLACES:
        try:
            with np.errstate(all="ignore"):
                return laws.create(name, _at(table, point))
        except InputError as error:
            refused = refused or error
    assert refused is not None
    raise refused


def _parameters(law: laws.Superpotential, formulas: Mapping[str, Formula]) -> list[Parameter]:
    """The numbers of a law that have a unit, with the powers of it."""
    return [
        Parameter(key=key, given=formulas.get(key) or Formula(float(number)), number=float(number), powers=powers)
        for key, number in _leaves(laws.describe(law))
        if (powers := law.powers.get(re.sub(r"\[\d+\]", "[]", key, count=1))) is not None and number
    ]


def _product(pair: list[Parameter], powers: Array) -> SpatialValue:
    """The product of what two numbers are multiplied by, with given powers, as a formula."""
    factors = [
        f"(({p.given.source})/{p.number!r})**({float(power)!r})"
        for p, power in zip(pair, np.round(powers, 12), strict=True)
        if power != 0.0 and not p.given.is_number
    ]
    return Formula("*".join(factors)) if factors else ONE


def times(one: SpatialValue, other: SpatialValue) -> SpatialValue:
    """The product of two multipliers.

    Args:
        one: of the effect, a number or any value in space.
        other: of formulas, a number or a formula.
    """
    if ONE in (one, other):
        return one if other == ONE else other
    return Formula(f"({one.source})*({other.source})")
