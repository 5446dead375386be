"""What acts on the sides of a built-in shape, from the scene: loads and supports, where they can be drawn.

A mesh file's parts are not in the result folder; there, nothing is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import HviError
from ..expressions import Formula
from .inputs import Result
from .mesh import Array, Body, Ints

_NORMALS = {"left": (0, -1), "right": (0, 1), "bottom": (-1, -1), "top": (-1, 1), "front": (1, -1), "back": (1, 1)}
"""Axis (the last one is upwards) and sense."""


@dataclass(frozen=True)
class Side:
    """Vertices (m,) of a side, along it, and its outward normal (3,)."""

    vertices: Ints
    normal: Array


@dataclass(frozen=True)
class Load:
    """Tractions (m, 3) at the vertices of a side, N/m²."""

    side: Side
    traction: Array


@dataclass(frozen=True)
class Support:
    """A side whose normal displacement is prescribed; ``rolling`` if it is free along the side."""

    side: Side
    rolling: bool


def loads(result: Result, body: Body) -> list[Load]:
    """The tractions on sides of a built-in shape that are not zero."""
    found = []
    for side, table in _tables(result, body):
        traction = _traction(table.get("traction"), body.points[side.vertices])
        if traction is not None and np.any(traction):
            found.append(Load(side, traction))
    return found


def supports(result: Result, body: Body) -> list[Support]:
    """The sides of a built-in shape that are held along their normal."""
    found = []
    for side, table in _tables(result, body):
        given = table.get("displacement")
        axis = int(np.argmax(np.abs(side.normal)))
        if isinstance(given, list) and len(given) == body.dimension and given[axis] != "free":
            found.append(Support(side, any(v == "free" for i, v in enumerate(given) if i != axis)))
    return found


def _tables(result: Result, body: Body) -> Iterator[tuple[Side, Mapping[str, Any]]]:
    if (result.scene.get("domain") or {}).get("shape") == "file":
        return
    for table in (result.scene.get("boundary") or {}).values():
        names = table.get("on", ())
        for name in [names] if isinstance(names, str) else names:
            if name in _NORMALS:
                yield _side(body, *_NORMALS[name]), table


def _side(body: Body, axis: int, sense: int) -> Side:
    axis %= body.dimension
    candidates = np.unique(body.boundary)
    along = body.points[candidates]
    level = along[:, axis].max() if sense > 0 else along[:, axis].min()
    on = np.abs(along[:, axis] - level) <= 1e-9 * body.size
    order = np.lexsort(np.round(along[on] / body.size, 9).T)  # along the side, whatever rounding says across it
    normal = np.zeros(3)
    normal[axis] = sense
    return Side(candidates[on][order], normal)


def _traction(given: Any, points: Array) -> Array | None:
    """By component, a number or a formula; what cannot be read is not drawn."""
    if not isinstance(given, list):
        return None
    traction = np.zeros((len(points), 3))
    try:
        for i, component in enumerate(given[:3]):
            traction[:, i] = np.nan_to_num(Formula(component).at(points.astype(np.float64)))
    except HviError:
        return None
    return traction
