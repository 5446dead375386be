"""The mesh axis of a study: which meshes of a shape are solved on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from ..mesh.shapes import DomainShape
from ..report.units import quantity
from ..scene import Scene
from ..schema import input_error

_MOST_POINT = {2: 150_000, 3: 60_000}
_MOST_REFERENCE = {2: 400_000, 3: 250_000}
"""Unknowns of the finest point of a plan's own making, and of the reference, by dimension."""
_BELOW, _ABOVE = 2, 1
"""Rungs of a plan's own making below and above the scene's mesh."""

Tables = dict[str, Any]
ADAPTIVE = "adaptive to "
"""How the words of an adaptive mesh begin."""


@dataclass(frozen=True)
class Setting:
    """What one point solves.

    Attributes:
        scene: the scene, on its own mesh.
        accuracy: instead of that mesh, one refined adaptively until the estimate is below this (`hvi run --accuracy`).
    """

    scene: Scene
    accuracy: float | None = None


def words(setting: Setting) -> str:
    """The mesh, as people name it."""
    if setting.accuracy is not None:
        return f"{ADAPTIVE}{100 * setting.accuracy:g} %"
    return setting.scene.domain.mesh_text(lambda metres: quantity(metres, "m"))


def unknowns(setting: Setting) -> float:
    """About how many there are; of a mesh file, which is not opened for it, a guess."""
    return setting.scene.domain.unknowns(setting.scene.dimension)


def refined(tables: Mapping[str, Any], factor: Fraction) -> Tables | None:
    """The scene's tables with cells ``factor`` times finer each way; None where there is no such mesh.

    Args:
        tables: the scene's, the domain as an object.
        factor: above 1 finer, below 1 coarser; of a mesh file, a power of two.

    Raises:
        InputError: the mesh would be finer than the shape allows.
    """
    shape: DomainShape = tables["domain"]
    try:
        finer = shape.refined(factor)
    except ValidationError as error:
        raise input_error(error, type(shape)) from None
    return None if finer is None else {**tables, "domain": finer}


def at(tables: Mapping[str, Any], text: str) -> Tables:
    """The scene's tables with the mesh that a value of the axis names.

    Args:
        tables: the scene's, the domain as an object.
        text: cells along the first side of a block, a mesh size in m, refinements of a file.

    Raises:
        InputError: the text names no mesh of this shape.
    """
    shape: DomainShape = tables["domain"]
    try:
        return {**tables, "domain": shape.with_mesh(text)}
    except ValidationError as error:
        raise input_error(error, type(shape)) from None
    except InputError as error:
        raise InputError(f"--axis mesh: {error}") from None


def ladder(tables: Mapping[str, Any], setting_of: Callable[[Tables], Setting]) -> list[Tables]:
    """The meshes of a plan's own making, coarse to fine: the scene's, halved and doubled as far as that goes."""
    steps = [refined(tables, Fraction(2) ** k) for k in range(-_BELOW, _ABOVE + 1)]
    found = [t for t in steps if t is not None and _affordable(setting_of(t), _MOST_POINT)]
    return found or [dict(tables)]


def reference(tables: Mapping[str, Any], setting_of: Callable[[Tables], Setting]) -> list[Tables]:
    """Three rungs from the reference down, for the finest mesh of a plan: it is four times finer, or twice."""
    finest = refined(tables, Fraction(4))
    if finest is None or not _affordable(setting_of(finest), _MOST_REFERENCE):
        finest = refined(tables, Fraction(2)) or dict(tables)
    below = [refined(finest, Fraction(1, n)) for n in (2, 4)]
    return [finest, *(t for t in below if t is not None)]


def _affordable(setting: Setting, most: Mapping[int, int]) -> bool:
    return unknowns(setting) <= most[setting.scene.dimension]
