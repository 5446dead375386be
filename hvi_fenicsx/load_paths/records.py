"""The states of a path as the records of its journal, and back."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from ..paths.state import Event, PathState, Place, Position
from ..runtime.journal import Record
from .certifying import Verdict


def record(state: PathState, verdict: Verdict) -> Record:
    """What the journal keeps of a state.

    Args:
        state: the state.
        verdict: what was found of it.
    """
    found: dict[str, Any] = {field.name: getattr(state, field.name) for field in fields(state)}
    found["event"] = str(state.event)
    for name in ("place", "position", "verdict"):
        part = verdict if name == "verdict" else found[name]
        found[name] = None if part is None else {field.name: getattr(part, field.name) for field in fields(part)}
    return found


def state(kept: Record) -> tuple[PathState, Verdict]:
    """A state and what was found of it.

    Args:
        kept: as :func:`record` made it.
    """
    values = dict(kept)
    verdict = Verdict(**values.pop("verdict"))
    place, position = values.pop("place"), dict(values.pop("position"))
    numbers = np.asarray(position.pop("numbers")).astype(np.int64)
    return PathState(
        **{**values, "event": Event(values["event"])},
        place=None if place is None else Place(**place),
        position=Position(numbers=numbers, **position),
    ), verdict
