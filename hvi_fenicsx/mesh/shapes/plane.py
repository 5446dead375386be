"""Plane shapes that gmsh meshes within an outline."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import model_validator

from ...errors import InputError
from ...geometry import Outline
from ...schema import Mistake, validation_error
from .base import DEFAULT, DomainShape, Thresholds

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain

_MOST_CELLS = 2e8
"""Beyond this gmsh, which meshes on one rank, needs more memory than machines have."""
_AREA_OF_VERTEX = math.sqrt(3.0) / 2.0
"""Area that belongs to a vertex in a mesh of equilateral triangles, over h²."""


class PlaneShape(DomainShape):
    """A plane shape cut into triangles of about one size.

    A subclass has the field ``mesh_size`` (m) and says its outline; a mesh comes from that.

    Class attributes:
        mesh_sizes: the fields that are mesh sizes.
    """

    dimension: ClassVar[int] = 2
    mesh_sizes: ClassVar[tuple[str, ...]] = ("mesh_size",)

    if TYPE_CHECKING:  # each shape says where it stands among its keys
        mesh_size: float

    @abstractmethod
    def outline(self) -> Outline:
        """The boundary, with the mesh size at its corners."""

    def box_area(self) -> float:
        """Area of a box around the shape, m²."""
        return self.outline().box_area

    @model_validator(mode="after")
    def _affordable(self) -> Self:
        if self.box_area() / self.mesh_size**2 > _MOST_CELLS:
            text = f"makes more than {_MOST_CELLS:.0e} cells; make it larger"
            raise validation_error([Mistake(("mesh_size",), text)])
        return self

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh that gmsh makes on rank 0. Collective."""
        from .. import domain, gmsh_shapes

        domain.check_affordable(comm, self.unknowns(2), 2, "domain.mesh_size", "make it larger")
        return gmsh_shapes.build(comm, self.outline(), self.mesh_size)

    def coarsest(self, thresholds: Thresholds = DEFAULT) -> Self:
        """The shape with its mesh size doubled as long as the cells stay small beside its extent."""
        largest = math.sqrt(self.box_area()) * thresholds.largest_part
        return self._finer(Fraction(1, 2 ** max(0, math.floor(math.log2(largest / self.mesh_size)))))

    def refined(self, factor: Fraction, thresholds: Thresholds = DEFAULT) -> Self | None:
        """The shape with its mesh sizes divided by ``factor``."""
        return self._finer(factor)

    def _finer(self, factor: Fraction) -> Self:
        sizes = {name: getattr(self, name) for name in self.mesh_sizes}
        return self.changed(**{name: float(h / factor) for name, h in sizes.items() if h is not None})

    def with_mesh(self, text: str, thresholds: Thresholds = DEFAULT) -> Self:
        """The shape with this mesh size (m), its other sizes in proportion."""
        try:
            size = float(text)
        except ValueError:
            size = 0.0
        if not (math.isfinite(size) and size > 0.0):
            raise InputError(f"{text!r} is no mesh size in m, like {self.mesh_size}")
        return self._finer(Fraction(self.mesh_size) / Fraction(size))

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """The mesh size."""
        return f"mesh size {length(self.mesh_size)}"

    def width(self) -> float:
        """The mesh size, m."""
        return self.mesh_size

    def unknowns(self, dimension: int, thresholds: Thresholds = DEFAULT) -> float:
        """About how many unknowns the mesh has, if all its cells have one size."""
        return 2.0 * vertices(self.outline().area, self.mesh_size, self.mesh_size)


def vertices(area: float, coarse: float, fine: float) -> float:
    """About how many vertices a mesh has: one for √3/2 h², h growing evenly from the centre of half a disk to its rim.

    Args:
        area: of the half-disk, m².
        coarse: h at its rim, m.
        fine: h at its centre, m.
    """
    radius = math.sqrt(2.0 * area / math.pi)
    growth = (coarse - fine) / radius
    if growth <= 1e-3 * coarse / radius:
        return area / (_AREA_OF_VERTEX * coarse**2)
    whole = (math.log(coarse / fine) + fine / coarse - 1.0) / growth**2
    return math.pi * whole / _AREA_OF_VERTEX
