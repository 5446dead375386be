"""The body: mesh, named boundary parts and regions, in SI. Knows no effect and no solver."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ..errors import InputError
from ..geometry import Curve
from ..runtime import cost
from ..runtime.mpi import agree
from ..typing import Array, Entities
from .transfer import Transfer

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Domain:
    """A mesh with named sides and regions.

    Attributes:
        mesh: the dolfinx mesh, coordinates in m.
        sides: local facets by name (built-in sides, or physical groups of a file).
        regions: local cells by name (physical groups of a file).
        lower: lower corner of the bounding box, m, shape (d,), the same on all ranks.
        upper: upper corner, likewise.
        curves: the true curve of a side by its name, where it is known and not straight; the facets of all other
            sides are taken for the geometry itself.
        one_piece: whether the mesh is known to be connected; else :mod:`.hierarchy` finds out.
        bends: whether cells may have curved edges at degree 2; not where a program has data of the straight mesh.
        coarsening: makes the next coarser domain of the mesh hierarchy; None where there is none.
        shared: what several problems on this mesh have in common; None where one problem is all.
    """

    mesh: dmesh.Mesh
    sides: Mapping[str, Entities]
    regions: Mapping[str, Entities]
    lower: Array
    upper: Array
    curves: Mapping[str, Curve] = field(default_factory=dict)
    one_piece: bool = False
    bends: bool = True
    coarsening: Coarsening | None = None
    shared: SharedObjects | None = field(default=None, compare=False, repr=False)

    @classmethod
    def from_mesh(
        cls,
        mesh: dmesh.Mesh,
        sides: Mapping[str, Entities],
        regions: Mapping[str, Entities] | None = None,
        curves: Mapping[str, Curve] | None = None,
        *,
        one_piece: bool = False,
    ) -> Domain:
        """The domain of a mesh. Collective.

        Args:
            mesh: coordinates in m.
            sides: local facet indices by name.
            regions: local cell indices by name.
            curves: the true curve of a side by its name, where that is known and not straight.
            one_piece: whether the mesh is known to be connected.
        """
        lower, upper = box(mesh.comm, mesh.geometry.x[:, : mesh.geometry.dim])
        return cls(
            mesh=mesh,
            sides=sides,
            regions=regions or {},
            lower=lower,
            upper=upper,
            curves=curves or {},
            one_piece=one_piece,
        )

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

    def coarser(self) -> tuple[Domain, Transfer] | None:
        """The next coarser domain and the transfer from it to this one; None where there is none. Collective."""
        return None if self.coarsening is None else self.coarsening()

    def once(self, name: str, origin: Any, make: Callable[[], T]) -> T:
        """What all problems on this mesh share: made once for each origin, where there may be several. Collective.

        Args:
            name: what it is.
            origin: what it is made from besides the mesh, comparable.
            make: makes it; nobody may change it afterwards. Collective.
        """
        return make() if self.shared is None else self.shared.get(self.mesh.comm, name, origin, make)

    def facets(self, names: Sequence[str]) -> Entities:
        """Local facets of the named sides together, sorted.

        Raises:
            InputError: a name that the domain does not have (the same on all ranks).
        """
        return _together(self.sides, names, "boundary part")

    def cells(self, names: Sequence[str]) -> Entities:
        """Local cells of the named regions together, sorted.

        Raises:
            InputError: a name that the domain does not have (the same on all ranks).
        """
        return _together(self.regions, names, "region")


def _together(known: Mapping[str, Entities], names: Sequence[str], kind: str) -> Entities:
    """The entities of some names, sorted."""
    for name in names:
        if name not in known:
            raise InputError(f"the domain has no {kind} {name!r}; it has {', '.join(sorted(known)) or 'none'}")
    return np.unique(np.concatenate([known[name] for name in names])).astype(np.int32)


Coarsening: TypeAlias = Callable[[], tuple[Domain, Transfer]]
"""Makes the next coarser domain, and the transfer from it. Collective."""


def check_affordable(comm: MPI.Comm, unknowns: float, dimension: int, place: str, mend: str) -> None:
    """Refuse what cannot be solved in the memory that there is, before it is made. Collective.

    Args:
        comm: all ranks.
        unknowns: how many there would be.
        dimension: 2 or 3.
        place: the key of the scene that makes them so many.
        mend: what to do about it.

    Raises:
        InputError: on all ranks alike.
    """
    needed, room = cost.memory_needed(unknowns, dimension), cost.memory_room(comm)
    if needed > room:
        raise InputError(
            f"{place}: {unknowns:.1e} unknowns need {needed / 1024:.3g} GB or more; there are "
            f"{room / 1024:.3g} GB: {mend}"
        )


def box(comm: MPI.Comm, points: Array) -> tuple[Array, Array]:
    """Lower and upper corner of all ranks' points, shape (d,), the same on all ranks. Collective.

    Args:
        comm: the ranks.
        points: this rank's, (n, d).
    """
    every = agree(comm, (points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)))
    return np.min([low for low, _ in every], axis=0), np.max([high for _, high in every], axis=0)


class SharedObjects:
    """Objects by name; of each name the last one, so that memory does not grow from problem to problem."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Any, Any]] = {}

    def get(self, comm: MPI.Comm, name: str, origin: Any, make: Callable[[], T]) -> T:
        """The object that was made from an equal origin, else a new one. Collective.

        Args:
            comm: the ranks of the mesh.
            name: what it is.
            origin: what it is made from besides the mesh; the ranks may have different ones.
            make: makes it. Collective.
        """
        known = name in self._kept and self._kept[name][0] == origin
        if not all(agree(comm, known)):
            self._kept.pop(name, None)  # first, so that there are never two of them
            self._kept[name] = (origin, make())
        found: T = self._kept[name][1]
        return found


@dataclass(frozen=True, kw_only=True)
class MeshThresholds:
    """When coarser meshes are made, which of them are used, and how far cells are bent.

    Attributes:
        coarsest_block: cells each way of a block below which a coarser level does not help.
        bisected_edges: length of the edges of a marked tetrahedron that are bisected, relative to its longest one. All
            six edges would make a step of 4 to 5 times the unknowns; the longest and, in a sixth of a cube, the
            diagonals of its faces make it about 2.
        hierarchy_from: unknowns of a mesh file from which coarser meshes pay: with fewer, one factorisation takes less
            time than gmsh. Of a larger one, so many cells tell the sizes, regions and ranks of all.
        coarsest: unknowns of the coarsest mesh of a mesh file, about; of a block of more, whose cells cannot be halved,
            a coarser one pays.
        outline_turn: angle (radian) by which an outline turns at a vertex that is kept in any case, and by which it
            turns at most between two vertices that are kept: a coarse chord must stay near its curve. Twice as
            much is an edge of a surface.
        remeshed_size: part by which a coarser mesh's volume, or the area of a side, may differ.
        gmsh_share: part of the memory that nothing uses which gmsh may take for a file.
        gmsh_seconds: seconds that gmsh has to read a mesh file, to mesh a script, and to remesh a body in space.
        least_jacobian: part of its straight size to which a curved cell may shrink anywhere.
    """

    coarsest_block: int = 4
    bisected_edges: float = 0.76
    hierarchy_from: int = 20_000
    coarsest: int = 2_500
    outline_turn: float = math.radians(20.0)
    remeshed_size: float = 0.25
    gmsh_share: float = 0.8
    gmsh_seconds: float = 300.0
    least_jacobian: float = 0.2


DEFAULT = MeshThresholds()
