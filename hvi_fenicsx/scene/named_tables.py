"""``[material]`` as one table, or ``[material.NAME]`` as several by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel

WHOLE = ""
"""Name of the only table where ``[material]`` or ``[body]`` is not split into named ones."""


def named_or_whole(data: Any, own_keys: Iterable[str]) -> Any:
    """``[material]`` as it stands, or ``[material.NAME]``: in either case named tables.

    A table of tables is taken for named ones, unless one of its keys is a key of the table itself.

    Args:
        data: what the scene file has.
        own_keys: the keys that a single table may have.
    """
    if not isinstance(data, dict):
        return {WHOLE: data}
    tables = all(isinstance(value, dict | BaseModel) for value in data.values())
    return data if tables and not set(own_keys) & set(data) else {WHOLE: data}
