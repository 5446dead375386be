"""The shapes that come with the program: blocks of equal cells, and plane shapes that gmsh meshes within an outline."""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import model_validator

from ...errors import InputError
from ...geometry import ROUNDING, Outline
from ...schema import Count, Length, Mistake, validation_error, vector
from .base import FEWEST_ADAPTIVE, FEWEST_STUDY, LARGEST_PART, DomainShape

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain

_MOST_UNKNOWNS = 2**31 - 1
"""What PETSc's default integers can number."""


class Block(DomainShape):
    """An axis-parallel block from the origin. A subclass has the fields ``size`` and ``cells``."""

    dimension: ClassVar[int]

    if TYPE_CHECKING:  # each block says where they stand among its keys
        size: tuple[float, ...]
        cells: tuple[int, ...]

    @model_validator(mode="after")
    def _affordable(self) -> Self:
        unknowns = self.unknowns(self.dimension)
        if unknowns > _MOST_UNKNOWNS:
            text = f"make {unknowns:.1e} unknowns; {_MOST_UNKNOWNS:.1e} at most: use fewer cells"
            raise validation_error([Mistake(("cells",), text)])
        return self

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The block in triangles or tetrahedra. Collective."""
        from .. import blocks, domain

        domain.check_affordable(comm, self.unknowns(dimension), self.dimension, "domain.cells", "use fewer cells")
        return blocks.block(comm, self.size, self.cells)

    def build_hierarchy(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The block, which has coarser ones of its own. Collective."""
        return self.build(comm, dimension)

    def coarsest(self) -> Self:
        """The block with its cells halved as long as enough are left each way."""
        cells = self.cells
        while min(halved := tuple(math.ceil(n / 2) for n in cells)) >= FEWEST_ADAPTIVE:
            cells = halved
        return self.changed(cells=cells)

    def refined(self, factor: Fraction) -> Self | None:
        """The block with ``factor`` times as many cells each way; None where they do not come out whole."""
        cells = [n * factor for n in self.cells]
        if any(n.denominator != 1 or n < FEWEST_STUDY for n in cells):
            return None
        return self.changed(cells=tuple(map(int, cells)))

    def with_mesh(self, text: str) -> Self:
        """The block with so many cells along x, and along the other axes in proportion."""
        fewest, first = FEWEST_STUDY, self.cells[0]
        if not re.fullmatch("[0-9]{1,18}", text) or int(text) < fewest:
            raise InputError(f"{text!r} is no number of cells along x ({fewest} or more)")
        block = self.refined(Fraction(int(text), first))
        if block is None:
            others = ", ".join(map(str, self.cells[1:]))
            raise InputError(
                f"{text} cells along x instead of {first} leave no whole number along the other sides, "
                f"which have {others}; {2 * first}, say, would do"
            )
        return block

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """The cells along each axis."""
        return " × ".join(map(str, self.cells)) + " cells"

    def width(self) -> float:
        """The longest side of the cells, m."""
        return max(s / n for s, n in zip(self.size, self.cells, strict=True))

    def unknowns(self, dimension: int) -> float:
        """The number of unknowns."""
        return float(self.dimension * math.prod(n + 1 for n in self.cells))


class Rectangle(Block):
    """A rectangle from the origin to `size`, divided into right-diagonal triangles; sides left, right, bottom, top."""

    dimension = 2
    normals: ClassVar = {"left": 0, "right": 0, "bottom": 1, "top": 1}

    shape: Literal["rectangle"] = "rectangle"
    """the lower left corner is the origin"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height, m, a list of 2"""
    cells: Annotated[tuple[Count, Count], vector(2)]
    """number of cells along x and y, a list of 2 whole numbers; two triangles each"""


class Box(Block):
    """A box from the origin to `size`, in tetrahedra; sides left, right (x), front, back (y), bottom, top (z)."""

    dimension = 3
    normals: ClassVar = {"left": 0, "right": 0, "front": 1, "back": 1, "bottom": 2, "top": 2}

    shape: Literal["box"] = "box"
    """one corner is the origin"""
    size: Annotated[tuple[Length, Length, Length], vector(3)]
    """lengths along x, y, z, m, a list of 3"""
    cells: Annotated[tuple[Count, Count, Count], vector(3)]
    """number of cells along x, y, z, a list of 3 whole numbers; six tetrahedra each"""


_AREA_OF_VERTEX = math.sqrt(3) / 2
"""Area that belongs to a vertex in a mesh of equilateral triangles, over h²."""


class PlaneShape(DomainShape):
    """A plane shape cut into triangles of about one size.

    A subclass has the field ``mesh_size`` (m) and says its outline; a mesh comes from that.

    Class attributes:
        mesh_sizes: the fields that are mesh sizes.
    """

    dimension = 2
    mesh_sizes: ClassVar[tuple[str, ...]] = ("mesh_size",)

    if TYPE_CHECKING:  # each shape says where it stands among its keys
        mesh_size: float

    @abstractmethod
    def outline(self) -> Outline:
        """The boundary, with the mesh size at its corners."""

    def box_area(self) -> float:
        """Area of a box around the shape, m²."""
        return self.outline().box_area

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh that gmsh makes on rank 0. Collective."""
        from .. import domain, gmsh_file

        domain.check_affordable(comm, self.unknowns(2), 2, "domain.mesh_size", "make it larger")
        return gmsh_file.build(comm, self.outline(), self.mesh_size)

    def coarsest(self) -> Self:
        """The shape with its mesh size doubled as long as the cells stay small beside its extent."""
        largest = math.sqrt(self.box_area()) * LARGEST_PART
        return self.refined(Fraction(1, 2 ** max(0, math.floor(math.log2(largest / self.mesh_size)))))

    def refined(self, factor: Fraction) -> Self:
        """The shape with its mesh sizes divided by ``factor``."""
        sizes = {name: getattr(self, name) for name in self.mesh_sizes}
        return self.changed(**{name: float(h / factor) for name, h in sizes.items() if h is not None})

    def with_mesh(self, text: str) -> Self:
        """The shape with this mesh size (m), its other sizes in proportion."""
        try:
            size = float(text)
        except ValueError:
            size = 0.0
        if not (math.isfinite(size) and size > 0.0):
            raise InputError(f"{text!r} is no mesh size in m, like {self.mesh_size}")
        return self.refined(Fraction(self.mesh_size) / Fraction(size))

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """The mesh size."""
        return f"mesh size {length(self.mesh_size)}"

    def width(self) -> float:
        """The mesh size, m."""
        return self.mesh_size

    def unknowns(self, dimension: int) -> float:
        """About how many unknowns the mesh has, if all its cells have one size."""
        return 2.0 * self.outline().area / (_AREA_OF_VERTEX * self.mesh_size**2)


class Round(PlaneShape):
    """A disk or a part of it that touches y = 0 at the origin, where its mesh may be finer.

    Class attributes:
        order: the sides between the corners of the outline, counterclockwise from the left one.
    """

    mesh_sizes = ("mesh_size", "mesh_size_below")
    order: ClassVar[tuple[str, ...]]

    radius: Length
    """radius of the disk, m"""
    mesh_size: Length
    """edge length of the triangles, m"""
    mesh_size_below: Length | None = None
    """edge length at the lowest point, m; it grows with the distance from there; by default `mesh_size`"""

    @property
    def finest(self) -> float:
        """The mesh size at the lowest point, m."""
        return self.mesh_size_below or self.mesh_size

    def outline(self) -> Outline:
        """The arcs, the lowest point being a corner, and the flat side of a part."""
        r, coarse = self.radius, self.mesh_size
        sides = [(name, None if name == "top" else (0.0, r)) for name in self.order]
        count, points = len(sides), [(-r, r), (0.0, 0.0), (r, r), (0.0, 2 * r)]
        return Outline(points[:count], sides, [coarse, self.finest, coarse, coarse][:count])

    def box_area(self) -> float:
        """Area of the square around the whole disk, m²."""
        return 4.0 * self.radius**2

    def unknowns(self, dimension: int) -> float:
        """About how many unknowns the mesh has, if the size of its cells grows evenly up to half the disk's extent."""
        growth = 1.0 - self.finest / self.mesh_size
        graded = 2.0 * (-math.log(1.0 - growth) - growth) / growth**2 if growth**2 > ROUNDING else 1.0
        return graded * super().unknowns(dimension)


class Disk(Round):
    """A disk whose lowest point is the origin."""

    normals: ClassVar = {"lower_arc": None, "upper_arc": None}
    order = ("lower_arc", "lower_arc", "upper_arc", "upper_arc")

    shape: Literal["disk"] = "disk"
    """the centre is (0, radius); sides lower_arc, upper_arc"""


class HalfDisk(Round):
    """The lower half of a disk whose lowest point is the origin."""

    normals: ClassVar = {"arc": None, "top": 1}
    order = ("arc", "arc", "top")

    shape: Literal["half_disk"] = "half_disk"
    """the centre is (0, radius); sides arc, top (the flat side)"""


class _Cut(PlaneShape):
    """A rectangle without a part of it, whose size is the field ``part``."""

    part: ClassVar[str]

    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height, m, a list of 2; the lower left corner is the origin"""

    @model_validator(mode="after")
    def _leaves_something(self) -> Self:
        width, height = getattr(self, self.part)
        if width >= self.size[0] or height >= self.size[1]:
            raise validation_error([Mistake((self.part,), "must be smaller than size in both directions")])
        return self


class LShape(_Cut):
    """An L: a rectangle without a smaller rectangle at its upper right corner."""

    normals: ClassVar = {"left": 0, "right": 0, "bottom": 1, "top": 1, "inner_right": 0, "inner_top": 1}
    part = "cut"

    shape: Literal["l_shape"] = "l_shape"
    """sides left, right, bottom, top, and inner_right, inner_top, which meet at the re-entrant corner"""
    cut: Annotated[tuple[Length, Length], vector(2)]
    """width and height of the smaller rectangle, m, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    def outline(self) -> Outline:
        """The six sides."""
        (w, h), (a, b) = self.size, self.cut
        points = [(0.0, 0.0), (w, 0.0), (w, h - b), (w - a, h - b), (w - a, h), (0.0, h)]
        return Outline.polygon(points, ["bottom", "right", "inner_top", "inner_right", "top", "left"], self.mesh_size)


class NotchedStrip(_Cut):
    """A rectangle with a V-shaped notch in the middle of its top side."""

    normals: ClassVar = {"left": 0, "right": 0, "bottom": 1, "top": 1, "notch": None}
    part = "notch"

    shape: Literal["notched_strip"] = "notched_strip"
    """sides left, right, bottom, top (both pieces), notch (both flanks)"""
    notch: Annotated[tuple[Length, Length], vector(2)]
    """width and depth of the notch, m, a list of 2"""
    mesh_size: Length
    """edge length of the triangles, m"""

    def outline(self) -> Outline:
        """The seven sides, two of which are the notch and two the top."""
        (w, h), (a, b) = self.size, self.notch
        notch = [((w + a) / 2, h), (w / 2, h - b), ((w - a) / 2, h)]
        points = [(0.0, 0.0), (w, 0.0), (w, h), *notch, (0.0, h)]
        names = ["bottom", "right", "top", "notch", "notch", "top", "left"]
        return Outline.polygon(points, names, self.mesh_size)
