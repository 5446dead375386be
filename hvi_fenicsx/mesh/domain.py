"""The body: mesh, named boundary parts and regions, in SI. Knows no effect and no solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ..errors import InputError
from ..geometry import Arc
from ..runtime import memory
from ..runtime.mpi import agree
from ..typing import Array, Entities
from . import blocks, gmsh_model

_LEAST_MEMORY = 300.0
"""Bytes for one unknown: its row of the matrix and its share of the mesh, without any solver."""
Halves = npt.NDArray[np.int8]
_AXIS_OF_SIDE = {"left": (0, 0), "right": (0, 1), "bottom": (-1, 0), "top": (-1, 1), "front": (1, 0), "back": (1, 1)}
"""Axis (-1: the last, the vertical one) and end of each named side."""


@dataclass(frozen=True)
class Domain:
    """A mesh with named sides and regions.

    Attributes:
        mesh: the dolfinx mesh, SI coordinates.
        sides: local facet indices by name (built-in sides, or physical groups of a file).
        regions: local cell indices by name (physical groups of a file).
        lower, upper: corners of the bounding box, shape (d,), the same on all ranks.
        curves: the true curve of a side by its name, where that is known and not straight; the facets of all other
            sides, those of mesh files among them, are taken for the geometry itself.
        one_piece: whether the mesh is known to be connected; else one has to look (:mod:`.bodies`).
        origin: the coarser domain that serves as the rung below, and how it was refined (None: it was not, but is
            another mesh of the same body); None where there is none.
    """

    mesh: dmesh.Mesh
    sides: Mapping[str, Entities]
    regions: Mapping[str, Entities]
    lower: Array
    upper: Array
    curves: Mapping[str, Arc] = field(default_factory=dict)
    one_piece: bool = False
    origin: tuple[Domain, Refinement | None] | None = None

    @classmethod
    def from_mesh(
        cls,
        mesh: dmesh.Mesh,
        sides: Mapping[str, Entities],
        regions: Mapping[str, Entities] | None = None,
        curves: Mapping[str, Arc] | None = None,
        *,
        one_piece: bool = False,
    ) -> Domain:
        """The domain of a mesh. Collective.

        Args:
            mesh: SI coordinates.
            sides: local facet indices by name.
            regions: local cell indices by name.
            curves: the true curve of a side by its name, where that is known and not straight.
            one_piece: whether the mesh is known to be connected.
        """
        return cls(mesh, sides, regions or {}, *_bounding_box(mesh), curves or {}, one_piece)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.mesh.geometry.dim)

    @property
    def length(self) -> float:
        """The longest edge of the bounding box, m: the length scale L."""
        return float(np.max(self.upper - self.lower))

    @property
    def centre(self) -> Array:
        """Centre of the bounding box, shape (3,), m."""
        return np.pad((self.lower + self.upper) / 2, (0, 3 - self.dimension))

    def facets(self, names: Sequence[str]) -> Entities:
        """Local facets of the named sides together, sorted.

        Raises:
            InputError: a name that the domain does not have (the same on all ranks).
        """
        for name in names:
            if name not in self.sides:
                raise InputError(f"the domain has no boundary part {name!r}; it has {', '.join(sorted(self.sides))}")
        return np.unique(np.concatenate([self.sides[name] for name in names])).astype(np.int32)

    def cells(self, names: Sequence[str]) -> Entities:
        """Local cells of the named regions together, sorted.

        Raises:
            InputError: a name that the domain does not have (the same on all ranks).
        """
        for name in names:
            if name not in self.regions:
                known = ", ".join(sorted(self.regions)) or "no named regions"
                raise InputError(f"the domain has no region {name!r}; it has {known}")
        return np.unique(np.concatenate([self.regions[name] for name in names])).astype(np.int32)


@dataclass(frozen=True)
class Refinement:
    """A refined domain and how it came from the one before.

    Attributes:
        domain: the refined one.
        parents: local parent cell of each local cell, shape (cells,).
        halves: twice the barycentric coordinates of each cell's vertices in the parent cell, shape (cells, d+1, d+1):
            a 2 for a vertex of the parent, two 1s for the middle of one of its edges.
    """

    domain: Domain
    parents: Entities
    halves: Halves


def block(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int]) -> Domain:
    """[0, size], a rectangle or a box, in cells cut into triangles or tetrahedra (:mod:`.blocks`). Collective."""
    mesh, upper = blocks.mesh(comm, size, cells), np.asarray(size, dtype=float)
    return Domain(mesh, _block_sides(mesh, upper), {}, np.zeros(len(upper)), upper, one_piece=True)


def check_affordable(comm: MPI.Comm, unknowns: int, key: str) -> None:
    """Refuse what would be killed for want of memory, half an hour later. Collective.

    Args:
        comm: all ranks. unknowns: of the mesh to be made. key: of ``[domain]``, which makes them so many.

    Raises:
        InputError: on all ranks alike.
    """
    least, room = unknowns * _LEAST_MEMORY / 2**20, memory.room(comm)
    if least > room:
        raise InputError(
            f"domain.{key}: make {unknowns:.1e} unknowns, which need {least / 1024:.3g} GB at least; there are "
            f"{room / 1024:.3g} GB: use fewer {key}"
        )


def from_file(comm: MPI.Comm, path: Path, dimension: int, scale: float = 1.0) -> Domain:
    """A gmsh file, its physical groups being sides and regions; ``scale`` is m per unit of the file. Collective.

    Raises:
        InputError: on all ranks alike, when the file cannot be read or is no usable mesh.
    """
    mesh, sides, regions = gmsh_model.read(comm, path, dimension)
    mesh.geometry.x[:] *= scale
    return Domain.from_mesh(mesh, sides, regions)


def _block_sides(mesh: dmesh.Mesh, size: Array) -> dict[str, Entities]:
    """Facets of the surface by the side that their middle lies on."""
    d = len(size)
    mesh.topology.create_connectivity(d - 1, d)
    facets, middles = dmesh.exterior_facet_indices(mesh.topology), np.empty((0, 3))
    if len(facets):  # dolfinx divides by their number
        middles = dmesh.compute_midpoints(mesh, d - 1, facets)
    ends = {n: (axis % d, end) for n, (axis, end) in _AXIS_OF_SIDE.items() if d == 3 or n not in ("front", "back")}
    return {name: facets[np.abs(middles[:, i] - end * size[i]) < 1e-9 * size[i]] for name, (i, end) in ends.items()}


def _bounding_box(mesh: dmesh.Mesh) -> tuple[Array, Array]:
    x = mesh.geometry.x[:, : mesh.geometry.dim]
    inside = x if len(x) else np.full((1, x.shape[1]), np.nan)
    lower, upper = np.fmin.reduce(inside, axis=0), np.fmax.reduce(inside, axis=0)
    gathered = agree(mesh.comm, (lower, upper))
    return np.nanmin([g[0] for g in gathered], axis=0), np.nanmax([g[1] for g in gathered], axis=0)
