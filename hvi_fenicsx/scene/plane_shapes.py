"""Plane shapes that gmsh meshes: what their ``[domain]`` tables may say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from ..schema import Length, Mistake, Table, validation_error, vector

_MOST_CELLS = 2e8
"""Beyond this gmsh, which meshes on one rank, needs more memory than machines have."""


class Meshed(Table):
    """A plane shape cut into triangles of about one size."""

    dimension: ClassVar[int] = 2
    normals: ClassVar[Mapping[str, int | None]]
    """The axis normal to each named side; None where that is slanted or curved."""

    def area(self) -> float:
        """Of a box around it, m²."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _affordable(self) -> Any:
        h: float = getattr(self, "mesh_size")  # noqa: B009 (each shape says where it stands among its keys)
        if self.area() / h**2 > _MOST_CELLS:
            raise validation_error(
                [Mistake(("mesh_size",), f"makes more than {_MOST_CELLS:.0e} cells; make it larger")]
            )
        return self


class LShape(Meshed):
    """A rectangle without a rectangle at its upper right corner."""

    normals: ClassVar[Mapping[str, int | None]] = {
        **{"left": 0, "right": 0, "bottom": 1, "top": 1},
        **{"inner_right": 0, "inner_top": 1},
    }

    shape: Literal["l_shape"] = "l_shape"
    """an L; sides left, right, bottom, top, and at the re-entrant corner inner_right and inner_top"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height in m, a list of 2; the lower left corner is the origin"""
    cut: Annotated[tuple[Length, Length], vector(2)]
    """width and height in m of what is cut off at the upper right, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    def area(self) -> float:
        """Of the whole rectangle."""
        return self.size[0] * self.size[1]

    @model_validator(mode="after")
    def _leaves_an_l(self) -> LShape:
        if self.cut[0] >= self.size[0] or self.cut[1] >= self.size[1]:
            raise validation_error([Mistake(("cut",), "must be smaller than size in both directions")])
        return self


class _Round(Meshed):
    """A disk or a part of it that touches y = 0 at the origin."""

    def area(self) -> float:
        """Of the square around the disk."""
        return 4.0 * getattr(self, "radius") ** 2  # noqa: B009


class Disk(_Round):
    """A disk that touches y = 0 at the origin."""

    normals: ClassVar[Mapping[str, int | None]] = {"lower_arc": None, "upper_arc": None}

    shape: Literal["disk"] = "disk"
    """a disk around (0, radius); sides lower_arc and upper_arc"""
    radius: Length
    """m"""
    mesh_size: Length
    """edge length of the triangles, m"""
    mesh_size_below: Length | None = None
    """edge length at the lowest point, m, growing with the distance from there; mesh_size if it is left out"""


class HalfDisk(_Round):
    """The lower half of a disk that touches y = 0 at the origin."""

    normals: ClassVar[Mapping[str, int | None]] = {"arc": None, "top": 1}

    shape: Literal["half_disk"] = "half_disk"
    """the lower half of a disk around (0, radius); sides arc and top, the flat one"""
    radius: Length
    """m"""
    mesh_size: Length
    """edge length of the triangles, m"""
    mesh_size_below: Length | None = None
    """edge length at the lowest point, m, growing with the distance from there; mesh_size if it is left out"""


class NotchedStrip(Meshed):
    """A rectangle with a V-notch in the middle of its top."""

    normals: ClassVar[Mapping[str, int | None]] = {"left": 0, "right": 0, "bottom": 1, "top": 1, "notch": None}

    shape: Literal["notched_strip"] = "notched_strip"
    """a strip with a notch; sides left, right, bottom, top (both pieces), notch"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height in m, a list of 2; the lower left corner is the origin"""
    notch: Annotated[tuple[Length, Length], vector(2)]
    """width and depth in m of the notch, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    def area(self) -> float:
        """Of the whole rectangle."""
        return self.size[0] * self.size[1]

    @model_validator(mode="after")
    def _leaves_a_strip(self) -> NotchedStrip:
        if self.notch[0] >= self.size[0] or self.notch[1] >= self.size[1]:
            raise validation_error([Mistake(("notch",), "must be smaller than size in both directions")])
        return self
