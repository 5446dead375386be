"""A mesh hierarchy for a mesh that has none: coarser meshes of the same body, made by gmsh.

Only the coarsest mesh is made by gmsh (:mod:`.coarsening`); the meshes between are its refinements, so the only step
that is not nested is the last, onto the mesh itself. These meshes give a start value and a preconditioner; solutions
are those of the mesh itself.

A mesh in several pieces, such as a joint in one file, has the hierarchy of each of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dolfinx import la
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..runtime.mpi import agree, total
from ..typing import Entities, Integers, Mask
from . import facets as cell_facets
from . import refinement
from .coarsening import coarsen, connected
from .domain import DEFAULT, Domain, MeshThresholds
from .joined import PlacedBody, coarsening
from .transfer import Transfer


def with_hierarchy(domain: Domain, thresholds: MeshThresholds = DEFAULT) -> Domain:
    """The domain with coarser levels, where it is large enough and gmsh can make them. Collective.

    Pieces of which gmsh can make none stay as they are.

    Args:
        domain: on any mesh; a domain that has a mesh hierarchy keeps it.
        thresholds: from which size on, and how coarse.
    """
    d, unknowns = domain.dimension, _unknowns(domain)
    if domain.coarsening is not None or unknowns < thresholds.hierarchy_from:
        return domain
    if len(found := pieces(domain)) > 1:
        domains = with_hierarchies([piece.domain for piece in found], thresholds)
        bodies = [PlacedBody(name="", domain=one, origin=np.zeros(d), rotation=np.eye(d)) for one in domains]
        return replace(domain, coarsening=coarsening(domain.mesh, bodies, [piece.numbers for piece in found]))
    domain = replace(domain, one_piece=True)  # known from now on
    factor = 2.0 ** max(1, round(np.log2(unknowns / thresholds.coarsest) / d))
    coarsest = coarsen(domain, factor)
    if coarsest is None:
        return domain
    growth = unknowns / _unknowns(coarsest)  # round bodies may need more vertices
    coarser = refinement.repeated(coarsest, max(0, round(np.log2(growth) / d) - 1))
    return replace(domain, coarsening=lambda: (coarser, Transfer()))


def with_hierarchies(domains: Sequence[Domain], thresholds: MeshThresholds = DEFAULT) -> list[Domain]:
    """The domains of bodies that are solved together, with coarser levels: it is their common size that counts.

    A small body beside a large one has coarser levels too, or it would be a large part of the coarsest common level,
    whose matrix is factorised. Collective.

    Args:
        domains: of the bodies; one that has a mesh hierarchy keeps it.
        thresholds: from which size on, and how coarse.
    """
    if sum(_unknowns(domain) for domain in domains) < thresholds.hierarchy_from:
        return list(domains)
    each = replace(thresholds, hierarchy_from=thresholds.coarsest)
    return [with_hierarchy(domain, each) for domain in domains]


def _unknowns(domain: Domain) -> int:
    """Displacements at the vertices."""
    return int(domain.dimension * domain.mesh.topology.index_map(0).size_global)


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A piece of a mesh as a mesh of its own, whose cells are on the same ranks.

    Attributes:
        domain: the piece, with those sides and regions of the whole that it has a part of.
        numbers: of its local vertices among the input's of the whole mesh.
    """

    domain: Domain
    numbers: Integers


def labels(domain: Domain) -> tuple[Integers, int]:
    """The piece of each local cell, and how many there are in all. Collective.

    Args:
        domain: on any mesh.
    """
    mesh, d, comm = domain.mesh, domain.dimension, domain.mesh.comm
    cells = mesh.topology.index_map(d)
    if domain.one_piece:
        return np.zeros(cells.size_local + cells.num_ghosts, np.int64), 1
    mesh.topology.create_connectivity(d - 1, d)
    facets = mesh.topology.connectivity(d - 1, d)
    first = facets.array[facets.offsets[:-1]]
    twice = np.flatnonzero(np.diff(facets.offsets) == 2)
    pairs = np.column_stack([first[twice], facets.array[facets.offsets[twice] + 1]])
    count, local = connected(pairs, cells.size_local + cells.num_ghosts)
    counts = agree(comm, count)
    local = local + sum(counts[: comm.rank])
    mine = local[first]
    theirs = of_owners(mesh.topology.index_map(d - 1), mine)
    apart = mine != theirs
    shared = np.unique(np.column_stack([mine[apart], theirs[apart]]), axis=0)
    whole, merged = connected(np.vstack(agree(comm, shared)), sum(counts))
    return merged[local], whole


def of_owners(index_map: Any, values: Integers) -> Integers:
    """What the owners of shared entities hold. Collective.

    Args:
        index_map: of the entities.
        values: at the local entities, owned and ghost, (n,).
    """
    vector = la.vector(index_map, 1, dtype=np.int64)
    vector.array[:] = values
    vector.scatter_forward()
    return np.array(vector.array)


def pieces(domain: Domain) -> list[Piece]:
    """The pieces of a domain; the domain itself where it is in one piece. Collective.

    Pieces that share a vertex (a hinge) each have it.

    Args:
        domain: on any mesh.
    """
    found, count = labels(domain)
    if count == 1:
        return [Piece(domain=domain, numbers=domain.mesh.geometry.input_global_indices)]
    return [_piece(domain, found == number) for number in range(count)]


def _piece(domain: Domain, within: Mask) -> Piece:
    """The piece of some local cells. Collective."""
    whole = domain.mesh
    cells = np.flatnonzero(within[: whole.topology.index_map(whole.topology.dim).size_local])
    corners = compat.geometry_dofmap(whole)[cells]
    numbers, points = _numbered(whole, corners)
    kind = whole.topology.cell_name()
    mesh = compat.simplex_mesh(whole.comm, numbers[corners], whole.geometry.x[points, : domain.dimension], kind)
    offset = whole.comm.exscan(len(cells)) or 0
    order = mesh.topology.original_cell_index[: len(cells)] - offset
    parents = cells[order].astype(np.int32)
    own = np.empty(len(mesh.geometry.x), dtype=np.int64)
    own[compat.geometry_dofmap(mesh)] = compat.geometry_dofmap(whole)[parents]
    here = np.arange(len(parents), dtype=np.int32)
    sides = {n: cell_facets.in_copies(side, whole, parents, mesh, here) for n, side in domain.sides.items()}
    regions = {n: np.flatnonzero(np.isin(parents, own)).astype(np.int32) for n, own in domain.regions.items()}
    return Piece(
        domain=Domain.from_mesh(
            mesh, _present(whole.comm, sides), _present(whole.comm, regions), domain.curves, one_piece=True
        ),
        numbers=whole.geometry.input_global_indices[own],
    )


def _present(comm: MPI.Comm, found: Mapping[str, Entities]) -> dict[str, Entities]:
    """Those that some rank has. Collective."""
    return {name: found[name] for name in sorted(found) if total(comm, len(found[name])) > 0}


def _numbered(mesh: dmesh.Mesh, corners: Entities) -> tuple[Integers, Entities]:
    """Vertices of some cells of all ranks counted through the ranks. Collective.

    Args:
        mesh: the whole mesh.
        corners: this rank's cells by local vertices, (c, d+1).

    Returns:
        The number of each local vertex, right where it is a corner; and the local vertices that this rank counts.
    """
    index_map = mesh.geometry.index_map()
    used = la.vector(index_map, 1, dtype=np.int64)
    used.array[:] = 0
    used.array[corners] = 1
    used.scatter_reverse(la.InsertMode.add)
    points = np.flatnonzero(used.array[: index_map.size_local])
    numbers = np.zeros(len(used.array), dtype=np.int64)
    numbers[points] = np.arange(len(points)) + (mesh.comm.exscan(len(points)) or 0)
    return of_owners(index_map, numbers), points.astype(np.int32)
