"""Laws whose parameters are formulas: one law of numbers, and by what its tractions and lengths are multiplied.

A law j of numbers gives the laws c m j(· / c) of all places, with m for the tractions and c for the lengths. A
parameter whose unit is lengthᵃ tractionᵇ then is cᵃ mᵇ times its number. Two of them tell c and m; all others must
agree.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import laws
from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..geometry import spot
from ..schema import Keys
from ..typing import Array, Mask
from .contribution import ONE

_PLACES = [(0.0, 0.0, 0.0), *((s, s, s) for s in (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, -1e-2, -0.1, -1.0, -10.0))]
"""Where formulas are evaluated, m, until the law has a number for each of its parameters."""
_ROUNDING = 1e-9
"""A relative difference of parameters that is none."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number of a law that is given by a formula, or by a number.

    Attributes:
        key: where it stands in the law's table.
        given: what it is at a place.
        number: what it is in the law of numbers, not 0.
        length: the power a of the length in its unit.
        traction: the power b of the traction.
    """

    key: str
    given: Formula
    number: float
    length: int
    traction: int

    def ratio(self, points: Array) -> Array:
        """What its number is multiplied by at points (n, 3), m; (n,)."""
        return np.asarray(self.given.at(points) / self.number, dtype=np.float64)

    def differs(self, points: Array, multiplier: Array, length_multiplier: Array) -> Mask:
        """Where it is not the parameter of the law with multiplied tractions and lengths, (n,).

        Args:
            points: m, (n, 3).
            multiplier: of the tractions there, (n,).
            length_multiplier: of the lengths, (n,).
        """
        with np.errstate(all="ignore"):
            wanted = length_multiplier**self.length * multiplier**self.traction
            return np.asarray(~(np.abs(self.ratio(points) - wanted) <= _ROUNDING * np.abs(wanted)))


@dataclass(frozen=True, kw_only=True)
class PlacedLaw:
    """A law of numbers and by what it is multiplied from place to place.

    Attributes:
        law: the law.
        multiplier: of its tractions.
        length_multiplier: of its lengths.
        parameters: its numbers that have a unit, where one of them is a formula.
    """

    law: laws.Superpotential
    multiplier: SpatialValue = ONE
    length_multiplier: SpatialValue = ONE
    parameters: tuple[Parameter, ...] = ()

    def contradictions(self, points: Array) -> list[str]:
        """What keeps the formulas from being one law, in words.

        Args:
            points: the vertices, m, (n, 3).
        """
        factors = self.multiplier.at(points), self.length_multiplier.at(points)
        found = []
        for parameter in self.parameters:
            for i in np.flatnonzero(parameter.differs(points, *factors))[:1]:
                lengths, tractions = (f"{factor[i]:.6g}" for factor in factors[::-1])
                found.append(
                    f"{parameter.key} is {parameter.given.at(points[[i]])[0]:.6g} at {spot(points[i])}, "
                    f"where the other parameters multiply the lengths by {lengths} and the tractions by {tractions}: "
                    "the law would have another shape there than elsewhere, and only lengths and tractions as wholes "
                    "may change from place to place. State all tractions, and all lengths, with one formula each, or "
                    "make pieces with laws of their own: `where`"
                )
        return found


def create(name: str, table: Mapping[str, Any]) -> PlacedLaw:
    """A law of a scene, whose numbers may be formulas.

    Args:
        name: of the law.
        table: its parameters.

    Raises:
        InputError: it is no law, or formulas cannot stand for its numbers.
    """
    formulas = {place: formula for place, value in _numbers(table) if (formula := _formula(value)) is not None}
    if not formulas:
        return PlacedLaw(law=laws.create(name, table))
    return _multiplied(_with_numbers(name, table, formulas), formulas)


def _numbers(value: Any, place: Keys = ()) -> Iterator[tuple[Keys, Any]]:
    """The entries of nested tables and lists."""
    if isinstance(value, Mapping):
        entries: Any = value.items()
    elif isinstance(value, list | tuple):
        entries = enumerate(value)
    else:
        yield place, value
        return
    for key, entry in entries:
        yield from _numbers(entry, (*place, key))


def _formula(value: Any) -> Formula | None:
    """A text as a formula; None where it is none, or a number in quotes."""
    try:
        formula = Formula(value) if isinstance(value, str) else None
        float(value)
    except InputError:
        return None
    except (TypeError, ValueError):
        return formula
    return None


def _with_numbers(name: str, table: Mapping[str, Any], formulas: Mapping[Keys, Formula]) -> laws.Superpotential:
    """The law at the first place where all formulas are numbers that it can have."""
    refused: InputError | None = None
    for point in _PLACES:
        with np.errstate(all="ignore"):
            values = {place: float(formula.at(np.array([point]))[0]) for place, formula in formulas.items()}
        if not all(np.isfinite(v) and v != 0.0 for v in values.values()):
            continue
        try:
            return laws.create(name, _filled(table, values))
        except InputError as error:
            refused = error
    said = ", ".join(f"{_key(place)} = {formula.source!r}" for place, formula in formulas.items())
    raise refused or InputError(f"law {name!r}: {said}: is a finite number other than 0 at none of the places tried")


def _filled(value: Any, values: Mapping[Keys, float], place: Keys = ()) -> Any:
    """A table with numbers in the place of formulas."""
    if isinstance(value, Mapping):
        return {key: _filled(entry, values, (*place, key)) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_filled(entry, values, (*place, i)) for i, entry in enumerate(value)]
    return values.get(place, value)


def _multiplied(law: laws.Superpotential, formulas: Mapping[Keys, Formula]) -> PlacedLaw:
    found = _parameters(law, formulas)
    missing = [_key(place) for place in formulas if _key(place) not in {p.key for p in found}]
    first, second = _telling(found)
    if missing or first is None:
        raise InputError(
            f"law {law.name!r}: {missing[0] if missing else found[0].key}: no formula can stand here, as it is not "
            "known how this number grows with lengths and tractions; state numbers, and by what they are multiplied: "
            'multiplier = "1 + x" for the tractions, length_multiplier = "1 + x" for the lengths'
        )
    powers = np.array([[p.length, p.traction] for p in (first, second) if p is not None], dtype=float)
    turned = np.linalg.pinv(powers)
    pair = [p for p in (first, second) if p is not None]
    return PlacedLaw(
        law=law,
        length_multiplier=_product(pair, turned[0]),
        multiplier=_product(pair, turned[1]),
        parameters=tuple(found),
    )


def _parameters(law: laws.Superpotential, formulas: Mapping[Keys, Formula]) -> list[Parameter]:
    """The numbers of a law that have a unit, with the powers of it; formulas first."""
    longer, stronger = law.scaled(0.5, 1.0), law.scaled(1.0, 0.5)
    if not type(law) is type(longer) is type(stronger):
        return []
    tables = [dict(_numbers(laws.describe(one))) for one in (law, longer, stronger)]
    found = []
    for place, number in tables[0].items():
        if isinstance(number, bool | str) or not number:
            continue
        length, traction = (float(np.log2(table[place] / number)) for table in tables[1:])
        given = formulas.get(place) or Formula(float(number))
        one = Parameter(
            key=_key(place), given=given, number=float(number), length=round(length), traction=round(traction)
        )
        if (length, traction) == (one.length, one.traction) != (0, 0):
            found.append(one)
    return sorted(found, key=lambda p: p.given.is_number)


def _telling(found: Sequence[Parameter]) -> tuple[Parameter | None, Parameter | None]:
    """Two parameters that tell both multipliers, lengths and tractions before others; one where there are no two."""
    plain = sorted(found, key=lambda p: abs(p.length) + abs(p.traction))
    for one, other in itertools.combinations(plain, 2):
        if one.length * other.traction != other.length * one.traction:
            return one, other
    return (plain[0] if plain else None), None


def _product(parameters: Sequence[Parameter], powers: Array) -> SpatialValue:
    """The product of the ratios of parameters with given powers, as a formula."""
    factors = [
        f"(({p.given.source})/{p.number!r})" + ("" if power == 1.0 else f"**({float(power)!r})")
        for p, power in zip(parameters, np.round(powers, 12), strict=True)
        if power != 0.0 and not p.given.is_number
    ]
    return Formula("*".join(factors)) if factors else ONE


def times(one: SpatialValue, other: SpatialValue) -> SpatialValue:
    """The product of two multipliers, of which at most one is no number or formula.

    Args:
        one: of what a scene says.
        other: of formulas in the place of numbers.
    """
    if other == ONE or one == ONE:
        return one if other == ONE else other
    return Formula(f"({one.source})*({other.source})")


def _key(place: Keys) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else str(key) for key in place)
