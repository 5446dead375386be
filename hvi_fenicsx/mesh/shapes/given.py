"""Shapes whose mesh is given and can only be refined, each cell in all: mesh files, and meshes of a user's program."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field

from ...errors import InputError
from ...schema import ExistingFile, Positive
from .base import UNKNOWNS_OF_FILE, DomainShape

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain


MOST_REFINEMENTS = 10
"""A million cells or more from each of the mesh's own."""
Refinements = Annotated[int, Field(ge=0, le=MOST_REFINEMENTS)]
"""How often each cell of a given mesh is cut."""


class FixedMesh(DomainShape):
    """A given mesh, refined so often. A subclass has the field ``refinements``."""

    dimension = None
    normals = None
    regions = None

    if TYPE_CHECKING:  # each shape says where it stands among its keys
        refinements: int

    def build_hierarchy(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh refined so often, with coarser meshes below it. Collective."""
        from .. import refinement

        return refinement.repeated(super().build_hierarchy(comm, dimension), self.refinements)

    def coarsest(self) -> Self:
        """The mesh as it is given."""
        return self.changed(refinements=0)

    def refined(self, factor: Fraction) -> Self | None:
        """The mesh refined more or less often; ``factor`` is a power of two."""
        often = self.refinements + factor.numerator.bit_length() - factor.denominator.bit_length()
        return self.changed(refinements=often) if 0 <= often <= MOST_REFINEMENTS else None

    def with_mesh(self, text: str) -> Self:
        """The mesh refined so often."""
        if not text.isdigit() or int(text) > MOST_REFINEMENTS:
            raise InputError(f"{text!r} is no number of refinements (0 to {MOST_REFINEMENTS})")
        return self.changed(refinements=int(text))

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """How often it is refined."""
        often = self.refinements
        if often < 2:
            return f"{self.shape}, {'refined once' if often else 'as it is'}"
        return f"{self.shape}, refined {often} times"

    def unknowns(self, dimension: int) -> float:
        """A guess: the mesh is not opened for it."""
        return UNKNOWNS_OF_FILE * 2.0 ** (dimension * self.refinements)


LONG = 20.0
"""A body (m) from a file that is longer than this may be one in mm."""


class MeshFile(FixedMesh):
    """A gmsh file. Its physical groups are the sides and regions that the scene can name.

    It may hold a mesh or describe one, and do nothing else: see docs/tutorial.md.
    """

    shape: Literal["file"] = "file"
    """the mesh comes from a gmsh file"""
    file: ExistingFile
    """the gmsh file, relative to the scene file: .msh, or .geo, which gmsh meshes first; a .geo can start no
    program and write no file"""
    scale: Positive = 1.0
    """length in m of one unit of the coordinates in the file: 1e-3 for a mesh in mm"""
    refinements: Refinements = 0
    """number of uniform refinements: each divides a cell into 4 triangles or 8 tetrahedra; multigrid uses all meshes"""

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh of the file, unrefined. Collective."""
        from .. import gmsh_file

        return gmsh_file.read(comm, self.file, dimension, self.scale)

    def implausible(self, length: float) -> tuple[str, ...]:
        """A long body whose unit nobody has stated."""
        if length <= LONG or "scale" in self.model_fields_set:
            return ()
        return (
            f"domain.file: the body is {length:.3g} m long, and meshes are often in mm: give scale = 1e-3, or "
            "scale = 1.0 if the file is in m",
        )


class GivenMesh(FixedMesh):
    """A mesh that exists already. It is not registered: ``shape`` is "given mesh"."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    given: Any = Field(exclude=True)
    """the domain, unrefined"""
    refinements: Refinements = 0
    """number of uniform refinements"""

    def space_dimension(self) -> int:
        """The mesh's."""
        return int(self.given.dimension)

    def build(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh as it was given."""
        domain: Domain = self.given
        return domain

    def unknowns(self, dimension: int) -> float:
        """How many the mesh has."""
        vertices = self.given.mesh.topology.index_map(0).size_global
        return float(dimension * vertices * 2 ** (dimension * self.refinements))


class OnlyMesh(GivenMesh):
    """A mesh that exists already and cannot be another, since a model has data on it."""

    def build_hierarchy(self, comm: MPI.Comm, dimension: int) -> Domain:
        """The mesh with the coarser ones that it has."""
        return self.build(comm, dimension)

    def refined(self, factor: Fraction) -> Self | None:
        """None: there is no other mesh."""
        return self if factor == 1 else None

    def with_mesh(self, text: str) -> Self:
        """Refused."""
        raise InputError(
            "the model has data on its mesh (UFL, a fem.Function, an energy with such data), so it has no other mesh; "
            "give loads, gaps and displacements as formulas or Python functions, energies without such data"
        )

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """There is one."""
        return "the body's mesh"
