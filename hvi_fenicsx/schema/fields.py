"""Types of fields that several tables have: names, lengths, counts, vectors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, PlainSerializer
from pydantic_core import CoreSchema, core_schema

from .messages import refusal, shown, unknown


@dataclass(frozen=True)
class OneOf:
    """Marks a field whose value is the name of a registered class; plugins may have registered more.

    Attributes:
        registered: the classes by their names, asked for whenever a scene is read.
    """

    registered: Callable[[], Mapping[str, type]]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self._check, handler(source))

    def _check(self, value: Any) -> Any:
        names = tuple(self.registered())
        if value is not None and value not in names:
            raise refusal(unknown("value", value, names))
        return value


def vector(length: int) -> BeforeValidator:
    """A validator that reads TOML's list of ``length`` entries as a tuple."""

    def read(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise refusal(f"must be a list of {length}, as in [{', '.join(['...'] * length)}] (is {shown(value)})")
        if len(value) != length:
            raise refusal(f"must have {length} entries, not {len(value)}")
        return tuple(value)

    return BeforeValidator(read)


def names_of(value: Any) -> tuple[str, ...]:
    """One name or a list of names as a tuple.

    Args:
        value: as a scene file or a Python program has it.

    Raises:
        PydanticCustomError: it is something else, empty, or has a name twice.
    """
    names = (value,) if isinstance(value, str) else value
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) and n.strip() for n in names):
        raise refusal('must be a name or a list of names in quotes, like "left" or ["left", "top"]')
    if not names:
        raise refusal("is an empty list; name at least one")
    if len(set(names)) < len(names):
        raise refusal("names the same thing twice")
    return tuple(names)


Names = Annotated[
    tuple[str, ...],
    BeforeValidator(names_of),
    PlainSerializer(lambda names: names[0] if len(names) == 1 else list(names)),
]
"""One name or a list of names."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
"""A finite number."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
"""A finite number above 0."""
SHORTEST, LONGEST = 1e-9, 1e9
"""Lengths of a body, m: beyond them, squares and cubes of lengths exceed what double precision resolves."""
Length = Annotated[float, Field(ge=SHORTEST, le=LONGEST)]
"""A length of a body, m."""
Count = Annotated[int, Field(gt=0)]
"""A whole number above 0."""
