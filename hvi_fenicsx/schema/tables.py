"""The table: strict, frozen, and refused in plain words at the right place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, Self, TypeVar

from pydantic import BaseModel, ConfigDict, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic_core import InitErrorDetails

from ..errors import InputError
from .messages import Keys, message_of, refusal, shown, suggestion, unknown

Kind = TypeVar("Kind", bound=BaseModel)


class Mistake(NamedTuple):
    """What is wrong with the user's tables, and where.

    Attributes:
        where: the place.
        text: what is wrong, what is allowed, how to mend it.
    """

    where: Keys
    text: str


def validation_error(mistakes: Iterable[Mistake]) -> ValidationError:
    """The mistakes as pydantic's own error, which keeps the place of each when tables are nested."""
    details = [InitErrorDetails(type=refusal(m.text), loc=m.where, input=None) for m in mistakes]
    return ValidationError.from_exception_data("scene", details)


def mistakes_of(
    error: ValidationError, model: type[BaseModel] | None = None, also: tuple[str, ...] = ()
) -> list[Mistake]:
    """What pydantic found, in plain words.

    Args:
        error: pydantic's error.
        model: the table that was read, for its allowed keys.
        also: keys that the table allows beside those of the model.
    """
    found = error.errors(include_url=False)
    meant = {(*e["loc"][:-1], suggestion(e, model)) for e in found if e["type"] == "extra_forbidden"}
    # A misspelt key is one mistake: that the right one is missing then goes without saying.
    found = [e for e in found if e["type"] != "missing" or e["loc"] not in meant]
    return [Mistake(tuple(e["loc"]), message_of(e, model, also)) for e in found]


def input_error(error: ValidationError, model: type[BaseModel] | None = None) -> InputError:
    """What pydantic found as one line for the user.

    Args:
        error: pydantic's error.
        model: the table that was read, for its allowed keys.
    """
    return InputError("; ".join(m.text for m in mistakes_of(error, model)))


def located_error(error: ValidationError, model: type[BaseModel] | None = None) -> InputError:
    """What pydantic found, a line each, with the key before it.

    Args:
        error: pydantic's error.
        model: the table that was read, for its allowed keys.
    """
    found = mistakes_of(error, model)
    lines = ((".".join(str(key) for key in mistake.where if key != ""), mistake.text) for mistake in found)
    return InputError("\n".join(f"{where}: {text}" if where else text for where, text in lines))


class Table(BaseModel):
    """A table of the scene file: frozen, no unknown keys, no silent conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        return cls._read_or_refuse(lambda: handler(data), [])

    @classmethod
    def _read_or_refuse(cls, read: Callable[[], Any], mistakes: list[Mistake]) -> Any:
        """What ``read`` returns; all mistakes together if it finds some or some were found before."""
        try:
            table = read()
        except ValidationError as error:
            mistakes = [*mistakes, *mistakes_of(error, cls)]
        if mistakes:
            raise validation_error(mistakes)
        return table

    def changed(self, **values: Any) -> Self:
        """A copy with other values, validated like a new table; what was left to its default still is.

        Args:
            **values: the new values by their keys.

        Raises:
            ValidationError: the values are not allowed, or do not fit the others.
        """
        given = {key: value for key, value in self if key in self.model_fields_set}
        return type(self).model_validate({**given, **values})


def choose(data: Any, key: str, classes: Mapping[str, type[Kind]], context: Any = None) -> Any:
    """The table read by the class that its ``key`` names.

    Args:
        data: a table, or what shall be one.
        key: whose value is the name of the class.
        classes: the classes by name.
        context: handed on to pydantic.

    Raises:
        ValidationError: no table, no such key, an unknown name, or what the class itself refuses.
    """
    if isinstance(data, BaseModel):
        return data
    if not isinstance(data, dict):
        raise validation_error([Mistake((), f"must be a table with a {key} (is {shown(data)})")])
    name = data.get(key)
    if name is None:
        raise validation_error([Mistake((key,), f"is missing; allowed: {', '.join(classes)}")])
    if not isinstance(name, str) or name not in classes:
        raise validation_error([Mistake((key,), unknown(key, name, classes))])
    return classes[name].model_validate(data, context=context)
