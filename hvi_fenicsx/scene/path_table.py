"""The load path of ``hvi path``: the ``[path]`` table."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainSerializer

from ..schema import Names, Table, refusal, shown

_LARGEST = 1e100
"""A factor beyond this makes work of which squares are no numbers."""


def _factors(value: Any) -> tuple[float, ...]:
    entries = value if isinstance(value, list | tuple) else [value]
    for entry in entries:
        if isinstance(entry, bool) or not isinstance(entry, int | float) or not abs(entry) <= _LARGEST:
            text = f"must be a number up to {_LARGEST:g}, or a list of numbers like [1.0, 0.2, 1.5]"
            raise refusal(f"{text} (is {shown(value)})")
    return tuple(float(entry) for entry in entries)


def _programme(value: Any) -> tuple[float, ...]:
    factors = _factors(value)
    if trouble := next(_standstill(factors), None):
        raise refusal(trouble)
    return factors


def _standstill(factors: tuple[float, ...]) -> Iterator[str]:
    """Where a programme goes nowhere."""
    if not factors:
        yield "is an empty list; give the factor to go to, like 1.5"
    elif factors[0] == 0.0:
        yield "begins with 0, where every path starts; give the factor to go to first"
    for one, other in pairwise(factors):
        if one == other:
            yield f"goes from {one:g} to {other:g}, which is no way; leave one of them out"


def _written(factors: tuple[float, ...]) -> Any:
    return factors[0] if len(factors) == 1 else list(factors)


class PathTable(Table):
    """The load path that `hvi path` follows. A factor grows from 0 and multiplies what drives the body."""

    to: Annotated[tuple[float, ...], BeforeValidator(_programme), PlainSerializer(_written)] = (1.0,)
    """the factor at which the path ends; or a programme with turns: [1.0, 0.2, 1.5] loads, unloads, loads again"""
    scaled: Names | None = None
    """what the factor multiplies: loads, prescribed displacements and moved obstacles by name, such as
    ["pull.traction", "lid.contact"]; all others are constant; by default all"""
    follow: Literal["stable", "exact"] = "stable"
    """stable: as a testing machine does, at a limit point on to the next stable equilibrium; exact: the path itself,
    through limit points, where the factor falls and rises again"""
    memory: bool = True
    """whether bonds remember: true: they unload along the secant, and what is broken stays broken; false: the laws as
    they are, which heal"""
    contact_at: Annotated[tuple[float, ...], BeforeValidator(_factors), PlainSerializer(list)] = ()
    """factors at which the state of Γc is written into path_contact.csv, each time the path crosses them"""
    states: Annotated[int, Field(ge=2)] = 50
    """how many states displacement.pvd shows at most, start, limit points, jumps and end among them"""
