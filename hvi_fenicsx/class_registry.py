"""Classes that are known by their name as soon as they are defined: laws, effects, shapes, methods and the like."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from collections.abc import Iterable


def enter(known: dict[str, type], cls: type, name: str, kind: str) -> None:
    """Enter a class under its name; the same class again (a notebook's cell run twice) replaces it.

    Args:
        known: the classes of this kind by their names; the class joins them.
        cls: the class.
        name: its name.
        kind: what it is, for the message.

    Raises:
        TypeError: the name is no text, or another class has it.
    """
    if not isinstance(name, str):
        raise TypeError(f"{kind} class {cls.__name__}: its name must be a text (is {name!r})")
    old = known.get(name)
    if old is not None and (old.__module__, old.__qualname__) != (cls.__module__, cls.__qualname__):
        raise TypeError(
            f"{kind} class {cls.__name__}: the name {name!r} is taken by {old.__module__}.{old.__qualname__}; "
            "choose another name"
        )
    known[name] = cls


def load_modules(package: str) -> None:
    """Load every module of a room, so that all classes in it are known; a new one then needs no edit elsewhere.

    Args:
        package: the room's full name.
    """
    for module in pkgutil.iter_modules(importlib.import_module(package).__path__):
        importlib.import_module(f"{package}.{module.name}")


def closest(name: str, known: Iterable[str]) -> str | None:
    """The known name that was probably meant; None where none is near.

    Args:
        name: as it was written.
        known: the names to choose from.
    """
    return next(iter(difflib.get_close_matches(name.lower(), list(known), 1, 0.5)), None)


def hint(name: object, known: Iterable[str]) -> str:
    """The same as the end of a message: `` (did you mean 'graph'?)``, or nothing.

    Args:
        name: what was given.
        known: the names to choose from.
    """
    meant = closest(str(name), known)
    return f" (did you mean {meant!r}?)" if meant else ""
