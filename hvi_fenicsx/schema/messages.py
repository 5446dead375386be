"""What pydantic finds, in plain words for someone who writes scene files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails, PydanticCustomError

from ..class_registry import closest
from .descriptions import descriptions

Keys = tuple[str | int, ...]
"""A place: the keys from the outermost table down to it; the entries of a list have numbers."""
_LONGEST = 60
"""Characters of a value that a message shows."""


def refusal(text: str) -> PydanticCustomError:
    """An error for a validator to raise; the reader of the scene adds its place."""
    # Through the context, since braces in the text itself would be taken for places to fill.
    return PydanticCustomError("scene", "{text}", {"text": text})


def shown(value: Any) -> str:
    """A value as a scene file would write it, cut where it is long."""
    if isinstance(value, str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, dict):
        return "a table"
    else:
        text = _plain(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _plain(value: Any) -> str:
    try:
        return str(value)
    except ValueError:  # Python refuses to print whole numbers of thousands of digits
        return "a huge number"


def unknown(kind: str, name: Any, allowed: Iterable[str]) -> str:
    """The message on an unknown name: the closest known one, and all that are allowed.

    Args:
        kind: what the name is of, like "shape".
        name: the name, or what stands in its place.
        allowed: the names that are known.
    """
    known = list(allowed)
    if not isinstance(name, str):
        return f"must be one of {', '.join(known)} in quotes (is {shown(name)})"
    close = closest(name, known)
    hint = f"did you mean {shown(close)}? " if close else ""
    return f"unknown {kind} {shown(name)}; {hint}allowed: {', '.join(known) or 'none'}"


def suggestion(error: ErrorDetails, model: type[BaseModel] | None) -> str | None:
    """The key that was probably meant by an unknown one.

    Args:
        error: pydantic's, of the kind "extra_forbidden".
        model: the table that was read.
    """
    return closest(str(error["loc"][-1]), _keys(model, error["loc"][:-1]))


def message_of(error: ErrorDetails, model: type[BaseModel] | None, also: Iterable[str] = ()) -> str:
    """The message on one finding: what is allowed and what is there, without pydantic's own terms.

    Args:
        error: pydantic's.
        model: the table that was read, for its allowed keys.
        also: keys that the table allows beside those of the model.
    """
    kind, value, context = error["type"], error.get("input"), error.get("ctx", {})
    if kind == "missing":
        return "is missing" + _described(model, error["loc"])
    if kind == "extra_forbidden":
        return unknown("key", str(error["loc"][-1]), [*_keys(model, error["loc"][:-1]), *also])
    if kind == "literal_error":
        return _not_among(value, context.get("expected", ""))
    if kind == "value_error":
        return str(context["error"])
    if kind in _TEXTS:
        return f"{_TEXTS[kind](context)} (is {shown(value)}){_mend(kind, value)}"
    return str(error["msg"])


def _not_among(value: Any, expected: str) -> str:
    """The message on a value that is not one of those listed, numbers or names in quotes."""
    names = re.findall(r"'([^']*)'", expected)
    return unknown("value", value, names) if names else f"must be {expected} (is {shown(value)})"


_TEXTS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "greater_than": lambda c: f"must be greater than {c['gt']:g}",
    "greater_than_equal": lambda c: f"must be {c['ge']:g} or more",
    "less_than": lambda c: f"must be less than {c['lt']:g}",
    "less_than_equal": lambda c: f"must be {c['le']:g} or less",
    "finite_number": lambda c: "must be a finite number",
    "float_type": lambda c: "must be a number",
    "float_parsing": lambda c: "must be a number",
    "int_type": lambda c: "must be a whole number",
    "int_parsing": lambda c: "must be a whole number",
    "int_parsing_size": lambda c: "must be a whole number of reasonable size",
    "int_from_float": lambda c: "must be a whole number",
    "bool_type": lambda c: "must be true or false",
    "string_type": lambda c: "must be a text in quotes",
    "tuple_type": lambda c: "must be a list, as in [..., ...]",
    "list_type": lambda c: "must be a list, as in [..., ...]",
    "dict_type": lambda c: "must be a table",
    "model_type": lambda c: "must be a table",
    "model_attributes_type": lambda c: "must be a table",
    "too_long": lambda c: f"must have {c['max_length']} entries, not {c['actual_length']}",
    "too_short": lambda c: f"must have {c['min_length']} entries, not {c['actual_length']}",
    "string_too_long": lambda c: f"must have {c['max_length']} characters at most",
}


def _mend(kind: str, value: Any) -> str:
    if kind in ("float_type", "int_type") and isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return ""
        return "; write it without quotes"
    return ""


def _described(model: type[BaseModel] | None, loc: Keys) -> str:
    field = model_at(model, loc[:-1])
    known = descriptions(field).get(str(loc[-1])) if field else None
    return f": {known}" if known else ""


def _keys(model: type[BaseModel] | None, loc: Keys) -> list[str]:
    found = model_at(model, loc)
    return [info.alias or name for name, info in found.model_fields.items()] if found else []


def model_at(model: type[BaseModel] | None, loc: Keys) -> type[BaseModel] | None:
    """The table that stands at a place within another, as far as the fields' types tell.

    Args:
        model: the outermost table.
        loc: the keys down to the place.
    """
    for step in loc:
        field = model.model_fields.get(str(step)) if model else None
        model = _inner(field.annotation) if field else None
    return model


def _inner(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (_inner(argument) for argument in get_args(annotation))
    return next((model for model in found if model), None)
