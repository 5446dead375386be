"""What all tables of a scene share: strict, frozen, and refusals in plain words at the right place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, NamedTuple, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PlainSerializer,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from .messages import in_words, shown, suggestion, unknown

Model = TypeVar("Model", bound=BaseModel)
Step = str | int
WHOLE = ""
"""Name of the only table where ``[material]`` or ``[body]`` is not split into named ones."""


class Problem(NamedTuple):
    """What is wrong, and where: the way through the tables from the outermost one."""

    where: tuple[Step, ...]
    text: str


def refuse(problems: Iterable[Problem]) -> ValidationError:
    """The problems as pydantic's own error, which keeps each one's place when tables are nested."""
    details = [
        InitErrorDetails(type=PydanticCustomError("scene", "{text}", {"text": p.text}), loc=p.where, input=None)
        for p in problems
    ]
    return ValidationError.from_exception_data("scene", details)


def problems_of(
    error: ValidationError, model: type[BaseModel] | None = None, also: tuple[str, ...] = ()
) -> list[Problem]:
    """What pydantic found, in plain words.

    Args:
        error: pydantic's.
        model: the table that was read, for its allowed keys.
        also: keys that the table allows beside those of the model.
    """
    found = error.errors(include_url=False)
    meant = {(*e["loc"][:-1], suggestion(e, model)) for e in found if e["type"] == "extra_forbidden"}
    # A misspelt key is one mistake: that the right one is missing then goes without saying.
    found = [e for e in found if e["type"] != "missing" or e["loc"] not in meant]
    return [Problem(tuple(e["loc"]), in_words(e, model, also)) for e in found]


class Table(BaseModel):
    """A table of the scene file: frozen, no unknown keys, no silent conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        return cls._or_refuse(lambda: handler(data), [])

    @classmethod
    def _or_refuse(cls, make: Callable[[], Any], problems: list[Problem]) -> Any:
        """What ``make`` makes; all problems together if it or anyone before it found some."""
        try:
            made = make()
        except ValidationError as error:
            problems = [*problems, *problems_of(error, cls)]
        if problems:
            raise refuse(problems)
        return made


def choose(data: Any, key: str, classes: Mapping[str, type[Model]], context: Any = None) -> Any:
    """The table read by the class that its ``key`` names.

    Raises:
        ValidationError: no table, no such key, an unknown name, or what the class itself refuses.
    """
    if isinstance(data, BaseModel):
        return data
    if not isinstance(data, dict):
        raise refuse([Problem((), f"must be a table with a {key} (is {shown(data)})")])
    name = data.get(key)
    if name is None:
        raise refuse([Problem((key,), f"is missing; allowed: {', '.join(classes)}")])
    if not isinstance(name, str) or name not in classes:
        raise refuse([Problem((key,), unknown(key, name, classes))])
    return classes[name].model_validate(data, context=context)


def named_or_whole(data: Any, own_keys: Iterable[str]) -> Any:
    """``[material]`` as it stands, or ``[material.NAME]``: in either case named tables.

    A table of tables is taken for named ones, unless one of its keys is a key of the table itself.
    """
    if not isinstance(data, dict):
        return {WHOLE: data}
    tables = all(isinstance(value, dict | BaseModel) for value in data.values())
    return data if tables and not set(own_keys) & set(data) else {WHOLE: data}


def _names(value: Any) -> Any:
    names = (value,) if isinstance(value, str) else value
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) and n.strip() for n in names):
        raise _wrong('must be a name or a list of names in quotes, like "left" or ["left", "top"]')
    if not names:
        raise _wrong("is an empty list; name at least one")
    if len(set(names)) < len(names):
        raise _wrong("names the same thing twice")
    return tuple(names)


def _wrong(text: str) -> PydanticCustomError:
    return PydanticCustomError("scene", "{text}", {"text": text})


def vector(length: int) -> BeforeValidator:
    """Reads TOML's list of so many entries as a tuple."""

    def read(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise _wrong(f"must be a list of {length} in square brackets (is {shown(value)})")
        if len(value) != length:
            raise _wrong(f"must have {length} entries, not {len(value)}")
        return tuple(value)

    return BeforeValidator(read)


Names = Annotated[
    tuple[str, ...],
    BeforeValidator(_names),
    PlainSerializer(lambda names: names[0] if len(names) == 1 else list(names)),
]
"""One name or a list of names."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=1e-9, le=1e9)]
"""Of a body, m: beyond these, squares and cubes of lengths leave what double precision can tell apart."""
Count = Annotated[int, Field(gt=0)]
