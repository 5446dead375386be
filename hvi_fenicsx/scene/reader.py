"""Scene files: TOML into a :class:`Scene`, and everything wrong with one into a single readable error."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from ..schema import Mistake, mistakes_of
from .model import Scene
from .named_tables import WHOLE
from .overrides import override
from .toml_lines import line_of, lines_of

_LARGEST = 1_000_000
_KEY = re.compile(r"((?:title|plugins|domain|material|body|boundary|solver)(?:\.[\w-]+)+): ")
"""How a message begins that names a key of the scene."""
_MOST_PROBLEMS = 10
_Place = tuple[str | int, ...]


def read_scene(path: str | os.PathLike[str], overrides: Sequence[str] = ()) -> Scene:
    """The scene of a file, with single values overridden.

    Args:
        path: a TOML file; a mesh file that it names is looked for beside it.
        overrides: ``dotted.key=TOML-VALUE`` each, in order; a list's entries go by number from 0.

    Raises:
        InputError: the file cannot be read or is no valid scene; up to ten mistakes, one a line, each
            with its line in the file, the key, what is allowed and how to mend it.
    """
    file = Path(path)
    text = _text(file)
    data = _toml(file, text)
    changed = [override(data, assignment) for assignment in overrides]
    return _scene(file, text, data, changed)


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
    file = Path(path)
    try:
        text = _text(file)
        data = _toml(file, text)
        changed = [override(data, assignment) for assignment in overrides]
    except InputError:
        return message
    return _where(file, lines_of(text), tuple(key[1].split(".")), changed) + message[key.end(1) :]


def _text(file: Path) -> str:
    raw = _bytes(file)
    if len(raw) > _LARGEST:
        raise InputError(f"{file}: has more than {_LARGEST // 1_000_000} MB; that is no scene file")
    if b"\0" in raw:
        raise InputError(f"{file}: is no text file; a scene is TOML in UTF-8")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{file}:{line}: is not UTF-8; save the scene as UTF-8") from None
    if not text.strip():
        raise InputError(f"{file}: is empty; a scene has at least [domain] and [material]")
    return text.replace("\r\n", "\n")


def _bytes(file: Path) -> bytes:
    try:
        if stat.S_ISDIR(os.stat(file).st_mode):
            raise InputError(f"{file}: is a folder; give the scene file in it")
        if not stat.S_ISREG(os.stat(file).st_mode):
            raise InputError(f"{file}: is no ordinary file")
        with open(file, "rb") as stream:
            return stream.read(_LARGEST + 1)
    except FileNotFoundError:
        raise InputError(f"{file}: does not exist{_nearby(file)}") from None
    except (OSError, ValueError) as error:  # ValueError: a null byte in the name
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(file)!r}: cannot be read: {reason}") from None


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


def _broken(file: Path, text: str, message: str) -> str:
    """Tomllib's message with its place in front."""
    reason = re.sub(r" \(at .*\)$", "", message, flags=re.DOTALL)
    found = re.search(r"\(at line (\d+), column (\d+)\)$", message)
    line, column = found.groups() if found else (str(text.count("\n") + 1), "1")
    content = text.splitlines()[int(line) - 1 :][:1]
    hint = f": {content[0].strip()[:60]}" if content and content[0].strip() else ""
    mend = "; texts need quotes" if "Invalid value" in reason else ""
    return f"{file}:{line}:{column}: not valid TOML: {reason}{mend}{hint}"


def _scene(file: Path, text: str, data: dict[str, Any], changed: Sequence[_Place]) -> Scene:
    try:
        return Scene.model_validate(data, context={"folder": file.absolute().parent})
    except ValidationError as error:
        mistakes = mistakes_of(error, Scene)
    raise InputError(_listed(file, lines_of(text), mistakes, changed))


def _listed(file: Path, lines: Mapping[_Place, int], mistakes: Iterable[Mistake], changed: Sequence[_Place]) -> str:
    found = [(Mistake(tuple(s for s in p.where if s != WHOLE), p.text)) for p in mistakes]
    found.sort(key=lambda p: line_of(lines, p.where) or 0)
    texts = [f"{_where(file, lines, p.where, changed)}: {p.text}" for p in found]
    rest = len(texts) - _MOST_PROBLEMS
    return "\n".join(texts[:_MOST_PROBLEMS] + ([f"... and {rest} more"] if rest > 0 else []))


def _where(file: Path, lines: Mapping[_Place, int], where: _Place, changed: Sequence[_Place]) -> str:
    key = ".".join(map(str, where))
    if any(where[: len(place)] == place for place in changed):
        return f"--set {key}"
    line = line_of(lines, where)
    return f"{file}:{line}: {key}" if line else f"{file}: {key}"
