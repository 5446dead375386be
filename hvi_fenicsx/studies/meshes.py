"""The meshes of a study: those that its mesh axis names, those of the default plan, and those of the reference."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from ..mesh.shapes import DomainShape
from ..schema import input_error
from .scene_tables import Tables, setting_of
from .thresholds import DEFAULT, Thresholds


def refined(tables: Mapping[str, Any], factor: Fraction) -> Tables | None:
    """The scene's tables with cells ``factor`` times finer each way; None where there is no such mesh.

    Args:
        tables: the scene's.
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


def can_be_refined(shape: DomainShape) -> bool:
    """Whether a shape has finer meshes than its own."""
    return shape.refined(Fraction(2)) is not None


def at(tables: Mapping[str, Any], text: str) -> Tables:
    """The scene's tables with the mesh that a value of the axis names.

    Args:
        tables: the scene's.
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


def default_meshes(tables: Mapping[str, Any], thresholds: Thresholds = DEFAULT) -> list[Tables]:
    """The meshes of the default plan, coarse to fine: the scene's, halved and doubled as far as that goes.

    Args:
        tables: the scene's.
        thresholds: how many, and how large.
    """
    powers = range(-thresholds.coarser_meshes, thresholds.finer_meshes + 1)
    found = [t for k in powers if (t := refined(tables, Fraction(2) ** k)) is not None]
    return [t for t in found if _affordable(t, thresholds.largest_point)] or [dict(tables)]


def reference_meshes(tables: Mapping[str, Any], thresholds: Thresholds = DEFAULT) -> list[Tables]:
    """The reference's mesh, four times finer or twice, and the next two coarser ones.

    Args:
        tables: of the scene on the finest mesh of a plan.
        thresholds: how large the reference may be.
    """
    finest = refined(tables, Fraction(4))
    if finest is None or not _affordable(finest, thresholds.largest_reference):
        finest = refined(tables, Fraction(2)) or dict(tables)
    coarser = [refined(finest, Fraction(1, n)) for n in (2, 4)]
    return [finest, *(t for t in coarser if t is not None)]


def _affordable(tables: Tables, most: Mapping[int, int]) -> bool:
    setting = setting_of(tables)
    return setting.unknowns <= most[setting.scene.dimension]
