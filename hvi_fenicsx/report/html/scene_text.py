"""The scene in words: the body, its materials, and what acts on each part, from the resolved scene file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

from ..reader import Result
from ..units import number

_PLACE = {"on", "where", "region"}


def body(result: Result) -> Iterator[tuple[str, str]]:
    """The body's shape and what it is made of, each with a name."""
    return body_of(result.scene)


def body_of(scene: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """As :func:`body`, of the scene's tables."""
    domain = dict(scene.get("domain") or {})
    if "file" in domain:
        domain["file"] = PurePath(str(domain["file"])).name
    yield "body", _entries(domain)
    for name, table in _named(scene.get("material") or {}):
        yield f"material{name}", _entries(table)
    for name, table in _named(scene.get("body") or {}):
        yield f"in the volume{name}", _entries(table)


def _named(table: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """``[material]`` itself, or each ``[material.NAME]``."""
    tables = [(f" “{name}”", t) for name, t in table.items() if isinstance(t, Mapping) and "law" not in t]
    return tables if len(tables) == len(table) else [("", table)]


def parts(result: Result) -> Iterator[dict[str, Any]]:
    """Each boundary part: its name, where it lies, and what acts on it."""
    return parts_of(result.scene)


def parts_of(scene: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """As :func:`parts`, of the scene's tables."""
    for name, table in (scene.get("boundary") or {}).items():
        on = table.get("on", ())
        acts = [(key, value_text(value)) for key, value in table.items() if key not in _PLACE]
        place = on if isinstance(on, str) else ", ".join(on)
        piece = f" where {table['where']}" if "where" in table else ""
        yield {"name": name, "on": place + piece, "acts": acts}


def effects(result: Result) -> Iterator[dict[str, str]]:
    """Each effect in force: where, what it is, what it adds to the problem."""
    for entry in result.summary.get("effects") or []:
        yield {
            "name": entry["effect"],
            "where": entry["where"] or "the whole body",
            "meaning": (entry.get("role") or {}).get("meaning", ""),
            "adds": entry["adds"],
            "share": ", ".join(_share(entry)),
        }


def _share(entry: Mapping[str, Any]) -> Iterator[str]:
    """How much of the problem it is."""
    for name in ("unknowns", "bounds"):
        if entry.get(name):
            yield f"{entry[name]:+,} {name}".replace("-", "−")
    if entry.get("solver"):
        yield f"solver: {entry['solver']}"


def _entries(table: Mapping[str, Any]) -> str:
    """``key value, key value``, without what is zero and so does nothing."""
    return ", ".join(f"{key.replace('_', ' ')} {value_text(value)}" for key, value in table.items() if value != 0.0)


def value_text(value: Any) -> str:
    """A value of a scene file as people write it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return number(value)
    if isinstance(value, list):
        return f"({', '.join(map(value_text, value))})"
    if isinstance(value, Mapping):
        return ", ".join(_pair(key, item) for key, item in value.items())
    return str(value).replace("_", " ") if str(value).isidentifier() else str(value)


def _pair(key: str, value: Any) -> str:
    text = f"({value_text(value)})" if isinstance(value, Mapping) else value_text(value)
    return text if key == "law" else f"{key} {text}"
