"""The body of a model: a dolfinx mesh with named tags, or a shape that the program meshes."""

from __future__ import annotations

import copy
import functools
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..effects import names_in_python
from ..errors import InputError, of_user
from ..mesh.boundary_part import BoundaryPart, Inequalities, InterfaceSides
from ..mesh.shapes import Box, DomainShape, GivenMesh, MeshFile, Rectangle
from ..schema import require_kind, unknown

if TYPE_CHECKING:
    from dolfinx import mesh as dmesh
    from mpi4py import MPI

    from ..mesh.domain import Domain
    from ..mesh.transfer import Transfer


class Body:
    """A body on its mesh, with names for its sides and regions; coordinates in m. Creation is collective.

    It keeps its mesh, and the coarser meshes that solvers make of it, for all models that use it.

    Args:
        mesh: of triangles or tetrahedra, on any communicator.
        facets: tags of facets (``dolfinx.mesh.MeshTags``), for the sides.
        cells: tags of cells, for the regions.
        names: tags by name. A name whose tag facets have is a side; one whose tag cells have is a region.
        regions: tags of cells by name, where a number means something else for facets; ``names`` are then sides only.

    Raises:
        InputError: on all ranks alike: cells that are no simplices, tags of another mesh, a name without a tag, a side
            with facets inside of the body.
    """

    pieces: Mapping[str, BoundaryPart] = MappingProxyType({})
    interfaces: Mapping[str, InterfaceSides] = MappingProxyType({})

    @of_user("body")
    def __init__(
        self,
        mesh: dmesh.Mesh,
        facets: Any = None,
        cells: Any = None,
        names: Mapping[str, int] | None = None,
        regions: Mapping[str, int] | None = None,
    ) -> None:
        from dolfinx import mesh as dmesh  # a scene is read without it

        from ..mesh import given

        if not isinstance(mesh, dmesh.Mesh):
            raise InputError(f"body: {mesh!r} is no dolfinx mesh; a file is read by hvi.Body.file(path)")
        given.check_tags(facets=facets, cells=cells)
        named = _by_name("names", {} if names is None else names)
        within = None if regions is None else _by_name("regions", regions)
        sides, within = _sorted_out(mesh, facets, cells, named, within)
        domain = given.domain_of(mesh, facets, cells, sides, within)
        self.shape: DomainShape = GivenMesh(shape="given mesh", given=domain)
        self.comm: MPI.Comm | None = mesh.comm
        self.check_unmoved()

    @classmethod
    @of_user("body")
    def from_shape(cls, shape: DomainShape, comm: MPI.Comm | None = None) -> Self:
        """A body of one of the program's shapes, or of your own.

        Not collective: the mesh is made when it is first used.

        Args:
            shape: the shape with its mesh.
            comm: the ranks that share the mesh; None: all.
        """
        from mpi4py import MPI

        require_kind("comm", comm, (MPI.Comm, type(None)), "a communicator of mpi4py, or None")
        return cls.of_places(shape, comm or MPI.COMM_WORLD)

    @classmethod
    def of_places(cls, shape: DomainShape, comm: MPI.Comm | None, **places: Mapping[str, Any]) -> Self:
        """A body of a shape with its places. Not collective.

        Args:
            shape: the shape with its mesh.
            comm: the ranks that share the mesh; None: that of a scene file, which each command makes on its ranks.
            **places: its ``pieces`` and ``interfaces`` by name.
        """
        for key in ("origin", "angle"):
            if getattr(shape, key) is not None:
                raise InputError(f"domain.{key}: places one of several bodies, [domain.NAME]; leave it out")
        body = cls.__new__(cls)
        body.__dict__.update(places, shape=shape, comm=comm)
        return body

    @classmethod
    def rectangle(cls, size: Sequence[float], cells: Sequence[int], comm: MPI.Comm | None = None) -> Self:
        """A rectangle [0, size] with the sides left, right, bottom and top.

        Not collective: the mesh is made when it is first used.

        Args:
            size: width and height, m.
            cells: numbers of cells each way.
            comm: the ranks that share the mesh; None: all.

        Raises:
            InputError: a number is not allowed.
        """
        return cls.from_shape(Rectangle.made({"size": size, "cells": cells}), comm)

    @classmethod
    def box(cls, size: Sequence[float], cells: Sequence[int], comm: MPI.Comm | None = None) -> Self:
        """A box [0, size] with the sides left, right, front, back, bottom and top.

        Not collective: the mesh is made when it is first used.

        Args:
            size: along x, y, z, m.
            cells: numbers of cells each way.
            comm: the ranks that share the mesh; None: all.

        Raises:
            InputError: a number is not allowed.
        """
        return cls.from_shape(Box.made({"size": size, "cells": cells}), comm)

    @classmethod
    @of_user("body")
    def file(
        cls,
        path: str | os.PathLike[str],
        *,
        scale: float = 1.0,
        refinements: int = 0,
        dimension: int = 2,
        comm: MPI.Comm | None = None,
    ) -> Self:
        """A gmsh file; its physical groups are the sides and regions.

        Not collective: the mesh is made when it is first used.

        Args:
            path: the .msh or .geo file.
            scale: m per unit of the file's coordinates.
            refinements: how often each cell is cut.
            dimension: of the cells, 2 or 3.
            comm: the ranks that share the mesh; None: all.

        Raises:
            InputError: there is no such file, or a number is not allowed.
        """
        if isinstance(dimension, bool) or dimension not in (2, 3):
            raise InputError(f"dimension: must be 2 or 3 (is {dimension!r})")
        keys = {"file": path, "scale": scale, "refinements": refinements}
        body = cls.from_shape(MeshFile.made(keys), comm)
        body.dimension = dimension
        return body

    @of_user("piece")
    def piece(self, name: str, side: str | Sequence[str], where: str) -> Self:
        """The body with one more side: a piece of a side, of the facets whose midpoints lie in it. Collective.

        Args:
            name: of the piece.
            side: of which it is a piece, or a list of sides.
            where: inequalities in x, y, z (m), like ``"x > 0.3"`` or ``"0.1 < x < 0.2 and y < 1"``.

        Raises:
            InputError: the name is taken, there is no such side, or these are no inequalities.
        """
        sides = names_in_python(side)
        self._check_new("piece", name, *sides)
        body = copy.copy(self)
        body.pieces = {**self.pieces, name: BoundaryPart(sides, Inequalities(where))}
        return body

    @of_user("interface")
    def interface(self, name: str, first: str, second: str, *, tied: bool = False) -> Self:
        """The body with one more place: where two of its sides meet, which no cells or vertices join. Collective.

        Effects there act on the displacement of the first side relative to the second.

        Args:
            name: of the interface.
            first: the side whose vertices carry contact and laws: that of the finer mesh, or that within the other.
            second: the other side.
            tied: whether the sides are glued for ever; then no effect acts between them.

        Raises:
            InputError: the name is taken, or there is no such side.
        """
        self._check_new("interface", name, first, second)
        if not isinstance(tied, bool | np.bool_):
            raise InputError(f"interface: tied must be True or False (is {tied!r})")
        body = copy.copy(self)
        body.interfaces = {**self.interfaces, name: InterfaceSides(first=first, second=second, tied=tied)}
        return body

    def _check_new(self, kind: str, name: str, *sides: str) -> None:
        """Refuse a name that is no text or is taken, and sides that are none."""
        for text in (name, *sides):
            require_kind(kind, text, (str,), "a text")
        for side in sides:
            if side not in self.sides:
                raise InputError(f"{kind}: {unknown('side', side, self.sides)}")
        if name in (*self.sides, *self.pieces, *self.interfaces):
            raise InputError(f"{kind}: there is a side {name!r} already; choose another name")

    @cached_property
    def dimension(self) -> int:
        """2 or 3; not collective."""
        return self.shape.space_dimension() or 2

    @cached_property
    def domain(self) -> Domain:
        """The mesh with its named sides and regions, and coarser meshes. Collective when first used."""
        from mpi4py import MPI

        return _remembering(self.shape.build_hierarchy(self.comm or MPI.COMM_WORLD, self.dimension))

    @cached_property
    def _at_first(self) -> int:
        """Where the nodes of the mesh were, as a number."""
        return hash(self.mesh.geometry.x.tobytes())

    def check_unmoved(self) -> None:
        """Refuse a mesh whose nodes have been moved: what is kept of the body would be another one's. Collective.

        Raises:
            InputError: on all ranks alike.
        """
        from ..runtime.mpi import refuse

        moved = hash(self.mesh.geometry.x.tobytes()) != self._at_first
        text = "body: the nodes of its mesh have been moved since it was made; make a new Body of the moved mesh"
        refuse(self.mesh.comm, [text] * moved)

    @property
    def mesh(self) -> dmesh.Mesh:
        """The mesh. Collective when first used."""
        return self.domain.mesh

    @property
    def sides(self) -> tuple[str, ...]:
        """The names of the sides, without pieces of them. Collective when first used."""
        return tuple(self.domain.sides)

    @property
    def regions(self) -> tuple[str, ...]:
        """The names of the regions. Collective when first used."""
        return tuple(self.domain.regions)

    def __repr__(self) -> str:
        return f"Body({self.shape.shape}, {self.dimension}D)"


def _by_name(what: str, tags: Any) -> dict[str, int]:
    """Tags by name, as a user gives them."""
    named = isinstance(tags, Mapping) and all(isinstance(name, str) for name in tags)
    if not named or any(isinstance(tag, bool) or not isinstance(tag, int | np.integer) for tag in tags.values()):
        raise InputError(f'body: {what} are numbers of tags by name, such as {what}={{"wall": 1}}, not {tags!r}')
    return {name: int(tag) for name, tag in tags.items()}


def _sorted_out(
    mesh: dmesh.Mesh, facets: Any, cells: Any, names: dict[str, int], regions: dict[str, int] | None
) -> tuple[dict[str, int], dict[str, int]]:
    """The sides and the regions among names. Collective."""
    from ..mesh import given

    if regions is not None:
        return names, regions
    on_facets, on_cells = given.tags_present(mesh, facets), given.tags_present(mesh, cells)
    within = {name: tag for name, tag in names.items() if tag in on_cells}
    sides = {name: tag for name, tag in names.items() if tag in on_facets or tag not in on_cells}
    return sides, within


def _remembering(domain: Domain) -> Domain:
    """The domain for many problems, whose coarser ones are made once."""
    from ..mesh.domain import SharedObjects

    domain = replace(domain, shared=SharedObjects())
    if domain.coarsening is None:
        return domain
    make = domain.coarsening

    @functools.cache
    def coarser() -> tuple[Domain, Transfer]:
        found, transfer = make()
        return _remembering(found), transfer

    return replace(domain, coarsening=coarser)
