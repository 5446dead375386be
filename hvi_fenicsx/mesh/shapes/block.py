"""Axis-parallel blocks from the origin, in equal cells: rectangle and box."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import model_validator

from ...errors import InputError
from ...schema import Count, Length, Mistake, validation_error, vector
from .base import FEWEST_ADAPTIVE, FEWEST_STUDY, DomainShape

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain
    from ..thresholds import MeshThresholds

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
        unknowns = self._unknowns()
        if unknowns > _MOST_UNKNOWNS:
            text = f"make {unknowns:.1e} unknowns; {_MOST_UNKNOWNS:.1e} at most: use fewer cells"
            raise validation_error([Mistake(("cells",), text)])
        return self

    def _unknowns(self) -> int:
        return self.dimension * math.prod(n + 1 for n in self.cells)

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The block in triangles or tetrahedra. Collective."""
        from .. import blocks, domain

        domain.check_affordable(comm, self._unknowns(), self.dimension, "domain.cells", "use fewer cells")
        return blocks.block(comm, self.size, self.cells)

    def build_hierarchy(self, comm: MPI.Comm, dimension: int, thresholds: MeshThresholds) -> Domain:
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
        return float(self._unknowns())


class Rectangle(Block):
    """A rectangle from the origin to `size`, divided into right-diagonal triangles; sides left, right, bottom, top."""

    dimension: ClassVar[int] = 2
    normals: ClassVar[Mapping[str, int | None]] = {"left": 0, "right": 0, "bottom": 1, "top": 1}

    shape: Literal["rectangle"] = "rectangle"
    """the lower left corner is the origin"""
    size: Annotated[tuple[Length, Length], vector(2)]
    """width and height, m, a list of 2"""
    cells: Annotated[tuple[Count, Count], vector(2)]
    """number of cells along x and y, a list of 2 whole numbers; two triangles each"""


class Box(Block):
    """A box from the origin to `size`, in tetrahedra; sides left, right (x), front, back (y), bottom, top (z)."""

    dimension: ClassVar[int] = 3
    normals: ClassVar[Mapping[str, int | None]] = {
        **{"left": 0, "right": 0},
        **{"front": 1, "back": 1},
        **{"bottom": 2, "top": 2},
    }

    shape: Literal["box"] = "box"
    """one corner is the origin"""
    size: Annotated[tuple[Length, Length, Length], vector(3)]
    """lengths along x, y, z, m, a list of 3"""
    cells: Annotated[tuple[Count, Count, Count], vector(3)]
    """number of cells along x, y, z, a list of 3 whole numbers; six tetrahedra each"""
