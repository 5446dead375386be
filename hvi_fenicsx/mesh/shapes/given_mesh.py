"""The shape of a body whose mesh a Python program brings. No scene file can name it."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, Self

from pydantic import ConfigDict, Field

from ...errors import InputError
from .base import DEFAULT, Thresholds
from .fixed_mesh import FixedMesh, Refinements

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain
    from ..thresholds import Thresholds as MeshThresholds


class GivenMesh(FixedMesh):
    """A mesh that exists already. It is not registered: ``shape`` is "given mesh"."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    dimension: ClassVar[None] = None
    normals: ClassVar[None] = None
    regions: ClassVar[None] = None

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

    def unknowns(self, dimension: int, thresholds: Thresholds = DEFAULT) -> float:
        """How many the mesh has."""
        vertices = self.given.mesh.topology.index_map(0).size_global
        return float(dimension * vertices * 2 ** (dimension * self.refinements))


class OnlyMesh(GivenMesh):
    """A mesh that exists already and cannot be another, since a model has data on it."""

    def build_hierarchy(self, comm: MPI.Comm, dimension: int, thresholds: MeshThresholds) -> Domain:
        """The mesh with the coarser ones that it has."""
        return self.build(comm, dimension)

    def refined(self, factor: Fraction, thresholds: Thresholds = DEFAULT) -> Self | None:
        """None: there is no other mesh."""
        return self if factor == 1 else None

    def with_mesh(self, text: str, thresholds: Thresholds = DEFAULT) -> Self:
        """Refused."""
        raise InputError(
            "the model has data on its mesh (UFL, a fem.Function, an energy with such data), so it has no other mesh; "
            "give loads, gaps and displacements as formulas or Python functions, energies without such data"
        )

    def mesh_text(self, length: Callable[[float], str]) -> str:
        """There is one."""
        return "the body's mesh"
