"""Types of fields that several effects have, and the checks they share."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer

from ..errors import InputError
from ..formula import Formula, SpatialValue
from ..schema import refusal


def as_formula(value: Any) -> SpatialValue:
    """A value as a scene or a program gives it, for a validator.

    Args:
        value: a number, a formula's text, or a value already.

    Raises:
        PydanticCustomError: it is none of these.
    """
    try:
        return value if isinstance(value, SpatialValue) else Formula(value)
    except InputError as error:
        raise refusal(str(error)) from None


FormulaField = Annotated[
    SpatialValue,
    BeforeValidator(as_formula),
    PlainSerializer(lambda f: f.source),
]
"""A number or a formula in x, y, z (SI), as a field of a scene model."""


def require_components(formulas: tuple[Any, ...], dimension: int, key: str) -> None:
    """Refuse a vector of the wrong length.

    Args:
        formulas: its components.
        dimension: how many there must be.
        key: its name in the message.

    Raises:
        InputError: with the number of components wanted.
    """
    if len(formulas) != dimension:
        raise InputError(f"{key} has {len(formulas)} components; in {dimension}D it has {dimension}")
