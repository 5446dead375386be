"""``--set dotted.key=TOML-VALUE``: single values changed on the command line."""

from __future__ import annotations

import tomllib
from typing import Any

from ..errors import InputError
from ..schema import Keys, shown, unknown


def override(data: dict[str, Any], assignment: str) -> Keys:
    """Set one value in the tables; tables that are not there are made.

    Args:
        data: the tables, which are changed.
        assignment: ``dotted.key=TOML-VALUE``.

    Returns:
        The keys down to the value.

    Raises:
        InputError: no ``key=value``, a value that is not TOML, or a key that the tables cannot have.
    """
    key, equals, value = assignment.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {assignment}: must be KEY=VALUE, like --set solver.tolerance=1e-10")
    steps = _steps(key, assignment)
    return _put(data, steps, _value(value, assignment), assignment)


def _steps(key: str, assignment: str) -> list[str]:
    try:
        parsed: Any = tomllib.loads(f"{key} = 0")
    except (ValueError, RecursionError):
        raise InputError(
            f"--set {assignment}: {shown(key)} is not a dotted key, like boundary.floor.friction.delta"
        ) from None
    steps = []
    while isinstance(parsed, dict) and len(parsed) == 1:
        step, parsed = next(iter(parsed.items()))
        steps.append(step)
    if parsed != 0:
        raise InputError(f"--set {assignment}: {shown(key)} is not a dotted key")
    return steps


def _value(text: str, assignment: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text.strip()}")
    except (ValueError, RecursionError):
        parsed = {}
    if set(parsed) == {"value"}:
        return parsed["value"]
    raise InputError(f"--set {assignment}: {shown(text)} is not a TOML value{_mend(text, assignment)}")


def _mend(text: str, assignment: str) -> str:
    """How a text is written that has no quotes yet."""
    if '"' in text or "\n" in text:
        return ""
    key = assignment.partition("=")[0]
    return f"; a text needs quotes, with quotes of the shell around them: --set '{key}=\"{text.strip()}\"'"


def _put(data: dict[str, Any], steps: list[str], value: Any, assignment: str) -> Keys:
    table: Any = data
    place: list[str | int] = []
    for step in steps[:-1]:
        index = _index(table, step, place, assignment)
        if isinstance(table, dict):
            table.setdefault(step, {})
        table = table[index]
        place.append(index)
    index = _index(table, steps[-1], place, assignment)
    table[index] = value
    return (*place, index)


def _index(table: Any, step: str, place: list[str | int], assignment: str) -> str | int:
    """The step as a key of a table or an index of a list."""
    here = ".".join(map(str, place))
    if isinstance(table, dict):
        return step
    if not isinstance(table, list):
        raise InputError(f"--set {assignment}: {here} is {shown(table)}, not a table; it has no {shown(step)}")
    allowed = [str(i) for i in range(len(table))]
    if step not in allowed:
        raise InputError(f"--set {assignment}: {here} is a list: {unknown('index', step, allowed)}")
    return int(step)
