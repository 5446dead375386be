"""A domain refined, uniformly or where it is marked, with its named sides and regions.

Edges are bisected by Plaza's rule (Plaza and Carey 2000): the longest edge of a cell goes first, so that angles stay
bounded away from 0. Children stay on their parent's rank. New vertices of a side whose curve is known move onto it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import mesh as dmesh

from .. import compat
from ..geometry import ROUNDING, Curve
from ..typing import Array, Entities
from . import curved
from .domain import DEFAULT, Domain, check_affordable
from .facets import cell_facets, nodes_of
from .nodes import edges as edges_of
from .transfer import Halves, ParentCellTransfer

_SKEWED = np.eye(3) + ROUNDING * np.sqrt([[2, 3, 5], [3, 7, 11], [5, 11, 13]])
"""Edges are measured after this linear map: there edges of equal length differ by direction, on all ranks alike."""


@dataclass(frozen=True)
class Refinement:
    """A refined domain and the transfer to it.

    Attributes:
        domain: the refined domain.
        transfer: from the domain that was refined: the parent cell of each cell, and its place in it.
    """

    domain: Domain
    transfer: ParentCellTransfer


def uniform(domain: Domain) -> Refinement:
    """Refine every cell into 2^d. Collective."""
    return _refined(domain, None)


def repeated(domain: Domain, times: int) -> Domain:
    """Refine every cell several times; each domain knows the one that it came from as its coarser level. Collective.

    Args:
        domain: the body on the mesh to be refined.
        times: how often every cell is cut into 2^d.

    Raises:
        InputError: on all ranks alike: memory cannot suffice.
    """
    d, vertices = domain.dimension, domain.mesh.topology.index_map(0).size_global
    if times:
        unknowns = d * vertices * 2 ** (d * times)
        check_affordable(domain.mesh.comm, unknowns, d, "domain.refinements", "use fewer refinements")
    for _ in range(times):
        step = uniform(domain)
        found = domain, step.transfer
        domain = replace(step.domain, coarsening=lambda found=found: found)  # type: ignore[misc]
    return domain


def marked(domain: Domain, cells: Entities) -> Refinement:
    """Bisect the long edges of the marked cells, in the plane all, and others as far as needed. Collective.

    Args:
        domain: the body on the mesh to be refined.
        cells: the marked cells, local indices.
    """
    topology = domain.mesh.topology
    topology.create_entities(1)
    topology.create_connectivity(domain.dimension, 1)
    lengths = _edge_lengths(domain.mesh, cells)
    least = DEFAULT.bisected_edges if domain.dimension == 3 else 0.0
    long = lengths >= least * lengths.max(axis=1, keepdims=True)
    edges = topology.connectivity(domain.dimension, 1).array.reshape(-1, lengths.shape[1])[cells]
    return _refined(domain, np.unique(edges[long]).astype(np.int32))


def _edge_lengths(mesh: dmesh.Mesh, cells: Entities) -> Array:
    """Lengths of the cells' edges, in the order of the topology, m, (cells, 3 or 6)."""
    ends = np.array(edges_of(mesh.topology.dim + 1))
    corners = cell_corners(mesh)[cells]
    return np.linalg.norm(corners[:, ends[:, 0]] - corners[:, ends[:, 1]], axis=2)


def _refined(domain: Domain, edges: Entities | None) -> Refinement:
    mesh, parents, halves = _bisected(domain.mesh, edges)
    sides = _sides(domain, mesh, parents, halves)
    regions = {name: np.flatnonzero(np.isin(parents, cells)).astype(np.int32) for name, cells in domain.regions.items()}
    _bend(mesh, sides, domain.curves)
    fine = replace(domain, mesh=mesh, sides=sides, regions=regions, coarsening=None, shared=None)
    return Refinement(fine, ParentCellTransfer(parents, halves))


def _bisected(mesh: dmesh.Mesh, edges: Entities | None) -> tuple[dmesh.Mesh, Entities, Halves]:
    """Bisect edges by Plaza's rule; which of equally long edges goes first must not depend on the ranks' numbering.

    Returns:
        The refined mesh, and ``parents`` and ``halves`` of a :class:`.ParentCellTransfer`.
    """
    d, straight = mesh.geometry.dim, mesh.geometry.x.copy()
    mesh.geometry.x[:, :d] = straight[:, :d] @ _SKEWED[:d, :d]
    fine, parents = compat.refine(mesh, edges)
    halves = _halves(mesh, fine, parents)
    mesh.geometry.x[:] = straight
    fine.geometry.x[compat.geometry_dofmap(fine), :d] = 0.5 * halves @ cell_corners(mesh)[parents]
    return fine, parents, halves


def cell_corners(mesh: dmesh.Mesh) -> Array:
    """Vertices of each local cell, m, (cells, d+1, d)."""
    return mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, : mesh.geometry.dim]


def _halves(coarse: dmesh.Mesh, fine: dmesh.Mesh, parents: Entities) -> Halves:
    """Twice the barycentric coordinates of the children's vertices: whole numbers, before curved sides are bent."""
    corners = cell_corners(coarse)[parents]
    edges = corners[:, 1:] - corners[:, :1]
    inner = np.linalg.solve(edges.transpose(0, 2, 1), (cell_corners(fine) - corners[:, :1]).transpose(0, 2, 1))
    inner = inner.transpose(0, 2, 1)
    both = np.concatenate([1.0 - inner.sum(axis=2, keepdims=True), inner], axis=2)
    return np.rint(2.0 * both).astype(np.int8)


def _sides(domain: Domain, fine: dmesh.Mesh, parents: Entities, halves: Halves) -> dict[str, Entities]:
    """The children's facets that lie in those of the domain's sides."""
    own = cell_facets(fine)
    # A child's facet i lies in its parent's facet j when none of its vertices (all but i) has a part in vertex j.
    cell, i, j = np.nonzero(halves.sum(axis=1, dtype=np.int8)[:, None, :] == halves)
    inside, around = own[cell, i], cell_facets(domain.mesh)[parents[cell], j]
    return {n: np.unique(inside[np.isin(around, facets)]).astype(np.int32) for n, facets in domain.sides.items()}


def _bend(mesh: dmesh.Mesh, sides: Mapping[str, Entities], curves: Mapping[str, Curve]) -> None:
    """Move the vertices of curved sides onto their curves, on all ranks that have them. Collective."""
    d, on = mesh.geometry.dim, {name: np.unique(nodes_of(mesh, sides[name])) for name in curves}
    mesh.geometry.x[:, :d] = curved.onto_curves(mesh.geometry.index_map(), mesh.geometry.x[:, :d], on, curves)
