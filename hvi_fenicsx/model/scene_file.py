"""Scene files: TOML with the line of each key, single values overridden, read as a model."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..schema import Keys, Mistake, require_path, shown, unknown
from .content import dotted
from .model import Mistakes, Model
from .reader import KEYS, read_tables

_KEY = re.compile(rf"((?:{'|'.join(KEYS)})\.[^:]+): ")
"""How a message begins that names a key of the scene."""
_MOST_MISTAKES = 10
"""Mistakes that one message lists."""


def read_scene(path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Model:
    """The model of a scene file, with single values overridden; not collective, each rank reads it.

    Args:
        path: a TOML file; a mesh file that it names is looked for beside it.
        overrides: ``dotted.key=TOML-VALUE`` each, in order; a list's entries go by number from 0.

    Raises:
        InputError: the file cannot be read or is not a valid scene; up to ten mistakes, one a line, each
            with its line in the file, the key, what is allowed and how to mend it.
    """
    require_path("path", path)
    source = _Source.read(Path(path), overrides)
    try:
        huge = "is a whole number beyond 64 bits, which TOML does not have; write 1e20 for 100000000000000000000"
        if wrong := [p for p, value in _places(source.tables) if isinstance(value, int) and abs(value) >= 2**63]:
            raise Mistakes([Mistake(place, huge) for place in wrong])
        return read_tables(source.tables, source.file.absolute().parent)
    except Mistakes as error:
        raise InputError(source.listed(error.found)) from None


def with_place(message: str, path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> str:
    """A message that begins with a key of the scene, with that key's place in front: file and line, or ``--set``.

    Args:
        message: of an error that was found after the scene had been read, like ``solver.method: ...``.
        path: the scene file.
        overrides: values that were overridden.
    """
    key = _KEY.match(message)
    if key is None:
        return message
    try:
        source = _Source.read(Path(path), overrides)
    except InputError:
        return message
    return source.place(key[1])[1] + message[key.end(1) :]


@dataclass(frozen=True)
class _Source:
    """A scene file that is valid TOML.

    Attributes:
        file: its name.
        text: what it holds.
        tables: the same as tables, values overridden.
        overridden: the places of these values.
    """

    file: Path
    text: str
    tables: dict[str, Any]
    overridden: Sequence[Keys]

    @classmethod
    def read(cls, file: Path, overrides: Sequence[str]) -> _Source:
        text = _text(file)
        tables = _toml(file, text)
        return cls(file, text, tables, [override(tables, assignment) for assignment in overrides])

    def listed(self, mistakes: Iterable[Mistake]) -> str:
        """The mistakes in the order of the file, a line each."""
        found = sorted(((*self.place(dotted(m.where)), m.text) for m in mistakes), key=lambda one: one[0])
        texts = [f"{place}: {text}" for _, place, text in found]
        rest = len(texts) - _MOST_MISTAKES
        return "\n".join(texts[:_MOST_MISTAKES] + ([f"... and {rest} more"] if rest > 0 else []))

    def place(self, key: str) -> tuple[int, str]:
        """The line of the nearest place that is known, and what messages name: file and line, or ``--set``; the key."""
        if any(
            f"{key}.".startswith(f"boundary{known[9:]}.") for known in self._known if known.startswith("interface.")
        ):
            key = f"interface{key[8:]}"  # within the program an interface is a boundary part
        nearest = max((known for known in self._known if f"{key}.".startswith(f"{known}.")), key=len, default="")
        line, start = self._known.get(nearest, (0, f"{self.file}:"))
        return line, f"{start} {key}"

    @cached_property
    def _known(self) -> Mapping[str, tuple[int, str]]:
        """The line of each key in the file, and how messages begin; also of tables that only overridden values make."""
        found = {dotted(place[:n]): (0, "--set") for place in self.overridden for n in range(1, len(place) + 1)}
        for place, line in lines_of(self.text).items():
            if not any(place[: len(other)] == other for other in self.overridden):
                found[dotted(place)] = line, f"{self.file}:{line}:"
        return found


def _text(file: Path) -> str:
    try:
        str(file.absolute()).encode("utf-8")  # the result names its scene, and files beside it
        strange = file.exists() and not file.is_file()
        raw = b"" if strange else file.read_bytes()
    except UnicodeEncodeError:
        raise InputError(f"{file.absolute()}: this name is not UTF-8; rename the file or folder") from None
    except FileNotFoundError:
        raise InputError(f"{file}: does not exist") from None
    except (OSError, ValueError) as error:  # the latter is about a null byte in the name
        raise InputError(f"{str(file)!r}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if strange:
        raise InputError(f"{file}: is {'a folder; give the scene file in it' if file.is_dir() else 'no ordinary file'}")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{file}:{line}: is not UTF-8; save the scene as UTF-8") from None


def _toml(file: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        reason = re.sub(r" \(at .*\)$", "", str(error), flags=re.DOTALL)
        found = re.search(r"\(at line (\d+), column (\d+)\)$", str(error))
        line, column = found.groups() if found else (str(text.count("\n") + 1), "1")
        content = "".join(text.splitlines()[int(line) - 1 :][:1]).strip()[:60]
        mend = "; texts need quotes" if reason.startswith("Invalid value") else ""
        shown_line = f": {content}" if content else ""
        raise InputError(f"{file}:{line}:{column}: not valid TOML: {reason}{mend}{shown_line}") from None
    except (ValueError, RecursionError) as error:
        reason = "is nested too deep" if isinstance(error, RecursionError) else "has a number of too many digits"
        raise InputError(f"{file}: {reason}") from None


def lines_of(text: str) -> Mapping[Keys, int]:
    """The line of each key and table by its way through the tables, for messages.

    Statement by statement: that of a text which tomllib reads is over with the first line up to which it can be read.
    """
    found: dict[Keys, int] = {}
    table: Keys = ()
    statement, first = "", 1
    for number, line in enumerate(text.split("\n"), 1):
        statement += line + "\n"
        if line.rstrip().endswith(","):  # within a list
            continue
        try:
            places = [place for place, _ in _places(tomllib.loads(statement))]
        except (ValueError, RecursionError):
            continue
        if is_table := statement.lstrip().startswith("["):
            table = places[-1]
        for place in places:
            found.setdefault(place if is_table else (*table, *place), first)
        statement, first = "", number + 1
    return found


def _places(value: Any, place: Keys = ()) -> Iterator[tuple[Keys, Any]]:
    """The places within tables and lists, with what stands there."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        yield (*place, key), entry
        yield from _places(entry, (*place, key))


def override(tables: dict[str, Any], assignment: str) -> Keys:
    """Set one value in the tables; tables that are not there are made.

    Args:
        tables: what a scene file holds; changed.
        assignment: ``dotted.key=TOML-VALUE``.

    Returns:
        The keys down to the value.

    Raises:
        InputError: no ``key=value``, a value that is not TOML, or a key that the tables cannot have.
    """
    steps, value = _assigned(assignment)
    place: list[str | int] = []
    inner: Any = tables
    for number, step in enumerate(steps):
        key = _entry(inner, step, f"--set {assignment}: {'.'.join(map(str, place))}")
        place.append(key)
        if number == len(steps) - 1:
            inner[key] = value
        elif isinstance(inner, dict):
            inner = inner.setdefault(key, {})
        else:
            inner = inner[key]
    return tuple(place)


def _assigned(assignment: str) -> tuple[list[str], Any]:
    """The steps of the key, and the value."""
    key, _, text = assignment.partition("=")
    steps: list[str] = []
    try:
        nested: Any = tomllib.loads(f"{key} = 0")
        parsed = tomllib.loads(f"value = {text.strip()}")
        while isinstance(nested, dict):
            ((step, nested),) = nested.items()
            steps.append(step)
        (value,) = parsed.values()
    except (ValueError, RecursionError):
        raise InputError(
            f"--set {assignment}: must be KEY=VALUE, a dotted key and a TOML value, like --set solver.tolerance=1e-10; "
            "a text needs quotes, with quotes of the shell around them: --set 'solver.method=\"branch\"'"
        ) from None
    return steps, value


def _entry(table: Any, step: str, here: str) -> str | int:
    """The step as a key of a table or an index of a list."""
    if isinstance(table, dict):
        return step
    if not isinstance(table, list):
        raise InputError(f"{here} is {shown(table)}, not a table; it has no {shown(step)}")
    allowed = [str(i) for i in range(len(table))]
    if step not in allowed:
        raise InputError(f"{here} is a list: {unknown('index', step, allowed)}")
    return int(step)
