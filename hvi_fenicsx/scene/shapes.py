"""The body's shape: what the ``[domain]`` table may say."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, ValidationInfo, model_validator

from ..schema import Count, Length, Mistake, Positive, Table, choose, refusal, validation_error, vector
from .plane_shapes import Disk, HalfDisk, LShape, NotchedStrip

_MOST_UNKNOWNS = 2**31 - 1  # PETSc's default integers
MOST_REFINEMENTS = 10
"""Of a mesh file: a million cells or more from each of its own."""


class _Block(Table):
    """A built-in shape: an axis-parallel block from the origin."""

    dimension: ClassVar[int]
    normals: ClassVar[Mapping[str, int | None]]
    """The axis normal to each named side."""

    @model_validator(mode="after")
    def _affordable(self) -> Any:
        cells: tuple[int, ...] = getattr(self, "cells")  # noqa: B009 (each shape has its own number of them)
        unknowns = self.dimension * math.prod(n + 1 for n in cells)
        if unknowns > _MOST_UNKNOWNS:
            text = f"make {unknowns:.1e} unknowns; {_MOST_UNKNOWNS:.1e} at most: use fewer cells"
            raise validation_error([Mistake(("cells",), text)])
        return self


class Rectangle(_Block):
    """[0, size] cut into right-diagonal triangles."""

    dimension: ClassVar[int] = 2
    normals: ClassVar[Mapping[str, int | None]] = {"left": 0, "right": 0, "bottom": 1, "top": 1}

    shape: Literal["rectangle"] = "rectangle"
    """a rectangle with its lower left corner at the origin"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height in m, a list of 2"""
    cells: Annotated[tuple[Count, Count], vector(2)]
    """cells along width and height, a list of 2 whole numbers"""


class Box(_Block):
    """[0, size] cut into tetrahedra; z is upwards: bottom and top are its ends, front and back those of y."""

    dimension: ClassVar[int] = 3
    normals: ClassVar[Mapping[str, int | None]] = {
        "left": 0,
        "right": 0,
        "front": 1,
        "back": 1,
        "bottom": 2,
        "top": 2,
    }

    shape: Literal["box"] = "box"
    """a box with a corner at the origin"""
    size: Annotated[tuple[Length, Length, Length], vector(3)]
    """lengths along x, y, z in m, a list of 3"""
    cells: Annotated[tuple[Count, Count, Count], vector(3)]
    """cells along x, y, z, a list of 3 whole numbers"""


def _mesh_path(value: Any, info: ValidationInfo) -> Path:
    if not isinstance(value, str | Path) or not str(value).strip() or "\0" in str(value):
        raise refusal('must be the name of a mesh file in quotes, like "part.msh"')
    folder = (info.context or {}).get("folder", ".")
    path = Path(os.path.abspath(Path(folder) / value))
    if not path.is_file():
        reason = "is a folder" if path.is_dir() else "does not exist"
        raise refusal(f"{path} {reason}")
    return path


class MeshFile(Table):
    """A gmsh file; its physical groups are the boundary parts and regions."""

    shape: Literal["file"] = "file"
    """a gmsh file"""
    file: Annotated[Path, BeforeValidator(_mesh_path), PlainSerializer(str)]
    """name of the gmsh file (.msh, or .geo, which is meshed then), relative to the scene file"""
    scale: Positive = 1.0
    """m per unit of the file's coordinates: 1e-3 for a mesh in mm"""
    refinements: Annotated[int, Field(ge=0, le=MOST_REFINEMENTS)] = 0
    """how often each cell is cut, in 4 triangles or 8 tetrahedra; the coarser meshes make the fine one fast to solve"""


Shape = Rectangle | Box | LShape | Disk | HalfDisk | NotchedStrip | MeshFile
SHAPES: Mapping[str, type[Shape]] = {
    "rectangle": Rectangle,
    "box": Box,
    "l_shape": LShape,
    "disk": Disk,
    "half_disk": HalfDisk,
    "notched_strip": NotchedStrip,
    "file": MeshFile,
}


def _domain(value: Any, info: ValidationInfo) -> Any:
    return choose(value, "shape", SHAPES, info.context)


Domain = Annotated[Shape, BeforeValidator(_domain)]
"""The ``[domain]`` table: the class follows from ``shape``."""
