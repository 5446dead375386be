"""What all tables of a scene file share: strict and frozen, with refusals in plain words at the right place.

Light: it loads pydantic and nothing heavier, and knows no particular table.
"""

from __future__ import annotations

import ast
import inspect
import json
import os
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    ModelWrapValidatorHandler,
    PlainSerializer,
    SerializationInfo,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails, InitErrorDetails, PydanticCustomError, core_schema

from .class_registry import closest
from .errors import InputError

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


def plain(given: Any) -> Any:
    """NumPy's numbers and arrays, however deep in lists and tables, as Python's; all else as it is.

    Args:
        given: what a program gave.
    """
    if hasattr(given, "tolist"):
        return given.tolist()
    if isinstance(given, list | tuple):
        return [plain(one) for one in given]
    return {key: plain(value) for key, value in given.items()} if isinstance(given, dict) else given


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


def _message(error: ErrorDetails, table: type[Table]) -> str:
    """What is allowed and what is there, without pydantic's own terms."""
    kind, value, context = error["type"], error.get("input"), error.get("ctx", {})
    if kind == "missing":
        meaning = meanings(table).get(str(error["loc"][-1]))
        return "is missing" + (f": {meaning}" if meaning else "")
    if kind == "extra_forbidden":
        return unknown("key", str(error["loc"][-1]), table.allowed_keys())
    if kind == "literal_error":
        names = re.findall(r"'([^']*)'", context["expected"])  # else numbers
        return unknown("value", value, names) if names else f"must be {context['expected']} (is {shown(value)})"
    if kind == "value_error":
        return str(context["error"])
    if text := _TEXTS.get(kind) or _KINDS.get(kind.split("_")[0]):
        return f"{text.format(**context)} (is {shown(value)}){_mend(kind, value)}"
    return str(error["msg"])


_TEXTS = {
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be {le:g} or less",
    "finite_number": "must be a finite number",
    "too_long": "must have {max_length} entries, not {actual_length}",
    "too_short": "must have {min_length} entries, not {actual_length}",
    "string_too_long": "must have {max_length} characters at most",
}
"""Messages by pydantic's kind of error."""
_KINDS = {
    "float": "must be a number",
    "int": "must be a whole number",
    "bool": "must be true or false",
    "callable": "must be a function",
    "string": "must be a text in quotes",
    "tuple": "must be a list, as in [..., ...]",
    "list": "must be a list, as in [..., ...]",
    "dict": "must be a table",
    "model": "must be a table",
}
"""The same on a value of another kind, by the first word of pydantic's."""


def _mend(kind: str, value: Any) -> str:
    if kind in ("float_type", "int_type") and isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return "; no formula can stand here" if re.search(r"\b[xyz]\b", value) else ""
        return "; write it without quotes"
    return ""


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


def mistakes_of(error: ValidationError, table: type[Table]) -> list[Mistake]:
    """What pydantic found, in plain words.

    Args:
        error: pydantic's error.
        table: the table that was read, for its allowed keys.
    """
    found = error.errors(include_url=False)
    keys = table.allowed_keys()
    meant = {closest(str(e["loc"][-1]), keys) for e in found if e["type"] == "extra_forbidden"}
    # A misspelt key is one mistake: that the right one is missing then goes without saying.
    found = [e for e in found if e["type"] != "missing" or e["loc"][-1] not in meant]
    return [Mistake(tuple(e["loc"]), _message(e, table)) for e in found]


def meanings(table: type[Table]) -> dict[str, str]:
    """What the source says below the fields of a table, where there is one; read when it is asked for: it takes long.

    Args:
        table: the table.
    """
    found: dict[str, str] = {}
    for kind in (kind for kind in reversed(table.__mro__) if issubclass(kind, Table)):
        body: list[ast.stmt] = []
        with suppress(OSError, TypeError, SyntaxError):  # a class that was typed in has no source
            body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # type: ignore[attr-defined]
        for pair in pairwise(body):
            match pair:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                    found[name] = inspect.cleandoc(text)
    return found


class Table(BaseModel):
    """A table of the scene file: frozen, no unknown keys, no silent conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @model_validator(mode="wrap")
    @classmethod
    def _in_plain_words(cls, data: Any, handler: ModelWrapValidatorHandler[Any]) -> Any:
        try:
            return handler(data)
        except ValidationError as error:
            raise validation_error(mistakes_of(error, cls)) from None

    def files(self) -> tuple[Path, ...]:
        """The files that it reads: those among its fields, and of the tables in it."""
        values = [value for _, value in self]
        inner = (file for table in values if isinstance(table, Table) for file in table.files())
        return (*(value for value in values if isinstance(value, Path)), *inner)

    @classmethod
    def allowed_keys(cls) -> list[str]:
        """All keys that it may have."""
        return list(cls.model_fields)

    @classmethod
    def made(cls, keys: Mapping[str, Any]) -> Self:
        """A table by its keys.

        Args:
            keys: as a scene file or a program has them.

        Raises:
            InputError: what is wrong, a line each, with the key before it.
        """
        try:
            return cls.model_validate(plain(keys))
        except ValidationError as error:
            raise located_error(error) from None

    def changed(self, **values: Any) -> Self:
        """A copy with other values, checked like a new table; what was left to its default still is.

        Args:
            **values: the new values by their keys.

        Raises:
            InputError: the values are not allowed, or do not fit the others.
        """
        return self.made({**{key: value for key, value in self if key in self.model_fields_set}, **values})


def located_error(error: ValidationError) -> InputError:
    """What is wrong with a table, a line each, with the key before it.

    Args:
        error: of a :class:`Table`.
    """
    found = [(".".join(map(str, e["loc"])), e["msg"]) for e in error.errors(include_url=False)]
    return InputError("\n".join(f"{where}: {text}" if where else text for where, text in found))


def choose(data: Any, key: str, classes: Mapping[str, type[Kind]], context: Any = None, default: str = "") -> Any:
    """The table read by the class that its ``key`` names.

    Args:
        data: a table, or what shall be one.
        key: whose value is the name of the class; of classes without such a field it is taken out.
        classes: the classes by name.
        context: handed on to pydantic.
        default: the name where there is none.

    Raises:
        ValidationError: no table, no such key, an unknown name, or what the class itself refuses.
    """
    if isinstance(data, BaseModel):
        return data
    if not isinstance(data, dict):
        raise validation_error([Mistake((), f"must be a table with a {key} (is {shown(data)})")])
    name = data.get(key, default)
    if not isinstance(name, str) or name not in classes:
        text = unknown(key, name, classes) if name != "" else f"is missing; allowed: {', '.join(classes)}"
        raise validation_error([Mistake((key,), text)])
    kind = classes[name]
    own = {k: value for k, value in data.items() if k != key or key in kind.model_fields}
    return kind.model_validate(own, context=context)


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


def _existing(value: Any, info: ValidationInfo) -> Path:
    if not isinstance(value, str | Path) or not str(value).strip() or "\0" in str(value):
        raise refusal('must be the name of a file in quotes, like "part.msh"')
    folder = (info.context or {}).get("folder", ".")
    path = Path(os.path.abspath(Path(folder) / value))
    if not path.is_file():
        raise refusal(f"{path} {'is a folder' if path.is_dir() else 'does not exist'}")
    return path


def _written(path: Path, info: SerializationInfo) -> str:
    """The path from the folder that the scene is written into; absolute where that is not known."""
    folder = (info.context or {}).get("folder")
    return str(path) if folder is None else os.path.relpath(path, folder)


ExistingFile = Annotated[Path, BeforeValidator(_existing), PlainSerializer(_written)]
"""A file that exists, absolute; its context has the folder that its name is relative to."""


def require_kind(name: str, given: Any, kinds: tuple[type, ...], wanted: str) -> None:
    """Refuse anything but a value of some kinds; a boolean is no number.

    Args:
        name: of the argument.
        given: what the user gave.
        kinds: those that are allowed.
        wanted: the same in words.

    Raises:
        InputError: it is something else.
    """
    if isinstance(given, bool) or not isinstance(given, kinds):
        raise InputError(f"{name}: must be {wanted} (is {given!r})")


def require_path(name: str, given: Any) -> None:
    """Refuse anything but a path.

    Args:
        name: of the argument.
        given: what the user gave.

    Raises:
        InputError: it is something else.
    """
    require_kind(name, given, (str, os.PathLike), "a path, as a text or a pathlib.Path")
