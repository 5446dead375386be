"""Scene files: TOML with the line of each key, single values overridden, read as a model."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..runtime.argument_checks import require_path
from ..schema import Keys, Mistake
from .content import WHOLE, dotted
from .model import Mistakes, Model
from .overrides import override
from .reader import KEYS, read_tables
from .toml_lines import line_of, lines_of

_LARGEST = 1_000_000
"""Bytes of a scene file at most."""
_KEY = re.compile(rf"((?:{'|'.join(KEYS)})\.[^:]+): ")
"""How a message begins that names a key of the scene."""
_MOST_MISTAKES = 10
"""Mistakes that one message lists."""
_TOO_LARGE = "is a whole number beyond 64 bits, which TOML does not have; write 1e20 for 100000000000000000000"


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
    return _Source.read(path, overrides).scene()


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
        source = _Source.read(path, overrides)
    except InputError:
        return message
    return source.place(source.path(key[1])) + message[key.end(1) :]


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
    def read(cls, path: str | os.PathLike[str], overrides: Sequence[str]) -> _Source:
        file = Path(path)
        text = _text(file)
        tables = _toml(file, text)
        return cls(file, text, tables, [override(tables, assignment) for assignment in overrides])

    def scene(self) -> Model:
        if too_large := [Mistake(place, _TOO_LARGE) for place in _large_numbers(self.tables, ())]:
            raise InputError(self._listed(too_large))
        try:
            return read_tables(self.tables, self.file.absolute().parent)
        except Mistakes as error:
            raise InputError(self._listed(error.found)) from None

    @cached_property
    def _lines(self) -> Mapping[Keys, int]:
        return lines_of(self.text)

    def _listed(self, mistakes: Iterable[Mistake]) -> str:
        """The mistakes in the order of the file, a line each."""
        found = [Mistake(tuple(key for key in m.where if key != WHOLE), m.text) for m in mistakes]
        found.sort(key=lambda m: line_of(self._lines, m.where) or 0)
        texts = [f"{self.place(m.where)}: {m.text}" for m in found]
        rest = len(texts) - _MOST_MISTAKES
        return "\n".join(texts[:_MOST_MISTAKES] + ([f"... and {rest} more"] if rest > 0 else []))

    def path(self, key: str) -> Keys:
        """The keys down to a place that a message names, joined by dots; names may have dots in them, too."""
        known = {".".join(map(str, place)): place for place in (*self._lines, *self.overridden)}
        known |= self._aliases()
        begins = [text for text in known if f"{key}.".startswith(f"{text}.")]
        nearest = max(begins, key=len, default="")
        rest = key[len(nearest) :].strip(".")
        return (*known.get(nearest, ()), *(rest.split(".") if rest else ()))

    def _aliases(self) -> dict[str, Keys]:
        """Places as errors that the mesh shows name them: what acts in a region, and interfaces among the parts."""
        model = self.scene()
        found: dict[str, Keys] = {f"boundary.{name}": ("interface", name) for name in model.body.interfaces}
        for where, effect in model.acting():
            if effect.name != (where or WHOLE):
                key = tuple(step for step in model.key(effect) if step != WHOLE)
                found[dotted((effect.place.value, where or WHOLE, effect.key))] = key
        return found

    def place(self, where: Keys) -> str:
        """A place as messages name it: file and line, or ``--set``; then the key."""
        key = ".".join(map(str, where))
        known = max((n for n in range(1, len(where) + 1) if where[:n] in self._lines), default=0)
        if any(where[: len(place)] == place or _shared(place, where) > known for place in self.overridden):
            return f"--set {key}"  # also in a table that only an overridden value has made
        return f"{self.file}:{line_of(self._lines, where)}: {key}" if known else f"{self.file}: {key}"


def _shared(one: Keys, other: Keys) -> int:
    """How many keys two places begin with alike."""
    return next((n for n, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


def _large_numbers(value: Any, place: Keys) -> Iterator[Keys]:
    """Where whole numbers stand that TOML does not have, however deep."""
    waiting = [(value, place)]
    while waiting:
        found, where = waiting.pop()
        if isinstance(found, int) and not -(2**63) <= found < 2**63:
            yield where
        entries = found.items() if isinstance(found, dict) else enumerate(found) if isinstance(found, list) else ()
        waiting += [(entry, (*where, key)) for key, entry in entries]


def _text(file: Path) -> str:
    _check_name(file)
    raw = _bytes(file)
    if len(raw) > _LARGEST:
        raise InputError(f"{file}: has more than {_LARGEST // 1_000_000} MB; a scene file is smaller")
    if b"\0" in raw:
        raise InputError(f"{file}: is not a text file; a scene is TOML in UTF-8")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{file}:{line}: is not UTF-8; save the scene as UTF-8") from None
    if not text.strip():
        raise InputError(f"{file}: is empty; a scene has at least [domain] and [material]")
    return text.replace("\r\n", "\n")


def _check_name(file: Path) -> None:
    """Refuse a name that is no text: the result names its scene, and files beside it."""
    try:
        str(file.absolute()).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{file.absolute()}: this name is not UTF-8; rename the file or folder") from None


def _bytes(file: Path) -> bytes:
    try:
        kind = os.stat(file).st_mode
    except (OSError, ValueError) as error:
        raise _unreadable(file, error) from None
    if stat.S_ISDIR(kind):
        raise InputError(f"{file}: is a folder; give the scene file in it")
    if not stat.S_ISREG(kind):
        raise InputError(f"{file}: is not an ordinary file")
    try:
        with open(file, "rb") as stream:
            return stream.read(_LARGEST + 1)
    except OSError as error:
        raise _unreadable(file, error) from None


def _unreadable(file: Path, error: OSError | ValueError) -> InputError:
    """The message on a file that cannot be read; a ValueError is about a null byte in its name."""
    if isinstance(error, FileNotFoundError):
        return InputError(f"{file}: does not exist{_nearby(file)}")
    return InputError(f"{str(file)!r}: cannot be read: {getattr(error, 'strerror', None) or error}")


def _nearby(file: Path) -> str:
    try:
        scenes = sorted(f.name for f in file.parent.glob("*.toml"))[:5]
    except OSError:
        return ""
    return f"; {file.parent} has {', '.join(scenes)}" if scenes else ""


def _toml(file: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_broken(file, text, str(error))) from None
    except (ValueError, RecursionError) as error:
        reason = "is nested too deep" if isinstance(error, RecursionError) else "has a number of too many digits"
        raise InputError(f"{file}: {reason}") from None


_MENDS = {
    "Invalid value": "texts need quotes",
    "Cannot declare": "give each table a name of its own, or join the two",
}
"""How to mend what tomllib says."""


def _broken(file: Path, text: str, message: str) -> str:
    """Tomllib's message with its place in front."""
    reason = re.sub(r" \(at .*\)$", "", message, flags=re.DOTALL)
    found = re.search(r"\(at line (\d+), column (\d+)\)$", message)
    line, column = found.groups() if found else (str(text.count("\n") + 1), "1")
    content = text.splitlines()[int(line) - 1 :][:1]
    hint = f": {content[0].strip()[:60]}" if content and content[0].strip() else ""
    mend = next((f"; {mend}" for start, mend in _MENDS.items() if reason.startswith(start)), "")
    return f"{file}:{line}:{column}: not valid TOML: {reason}{mend}{hint}"
