"""The shape of a body whose mesh a Python program brings. No scene file can name it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import ConfigDict, Field

from .base import DEFAULT, Thresholds
from .fixed_mesh import FixedMesh, Refinements

if TYPE_CHECKING:
    from mpi4py import MPI

    from ..domain import Domain


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
