"""Cells with curved edges: at degree 2 the mesh of a body whose sides lie on known curves.

It has the topology of the straight mesh, so that cells, facets and dofs have the same numbers, and one node more on
each edge: on the curve where the edge lies on a curved side, else in the middle.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import basix
import numpy as np
from dolfinx import common, fem, la
from dolfinx import mesh as dmesh

from .. import compat
from ..geometry import Curve
from ..runtime.mpi import total
from ..typing import Array, Entities
from . import nodes
from .domain import Domain
from .thresholds import DEFAULT, Thresholds

_MORE_SWEEPS = 2
"""Projections, from one side to the next, that bring a node of two sides onto both; each gains some digits."""


class CurvedMesh(dmesh.Mesh):
    """A mesh of degree 2.

    Args:
        mesh: of second order.
        straight_cells: how many of its cells, on all ranks, are straight since their curve would turn them over.

    Attributes:
        straight_cells: as given.
    """

    def __init__(self, mesh: dmesh.Mesh, straight_cells: int) -> None:
        super().__init__(mesh._cpp_object, mesh.ufl_domain())
        self.straight_cells = straight_cells


def mesh_of(domain: Domain, degree: int, thresholds: Thresholds = DEFAULT) -> dmesh.Mesh:
    """The mesh that displacements of a degree live on. Collective.

    Args:
        domain: the body.
        degree: of the elements; at degree 1 cells are straight.
        thresholds: how much a cell may be bent; a cell that would be bent more has straight edges.
    """
    if degree == 1 or not (domain.curves and domain.bends):
        return domain.mesh
    return domain.once("curved cells", None, lambda: _curved(domain, sorted(domain.curves), thresholds.least_jacobian))


def _curved(domain: Domain, names: Collection[str], least: float) -> CurvedMesh:
    space = fem.functionspace(domain.mesh, ("Lagrange", 2))
    before, d = nodes.points(space)[:, : domain.dimension], domain.dimension
    on = {name: np.unique(nodes.facet_nodes(space, domain.sides[name])) for name in names}
    after = onto_curves(space.dofmap.index_map, before, on, domain.curves)
    for _ in range(_MORE_SWEEPS if domain.dimension == 3 else 0):  # in space sides share edges
        after = onto_curves(space.dofmap.index_map, after, _shared(on), domain.curves)
    after, straight = _straightened(space, before, after, least)
    points = np.pad(after, ((0, 0), (0, 3 - d)))
    return CurvedMesh(compat.quadratic_mesh(domain.mesh, space.dofmap, points), straight)


def _straightened(space: fem.FunctionSpace, before: Array, after: Array, least: float) -> tuple[Array, int]:
    """The nodes (n, d), those of cells back that would be bent too much, and the number of these. Collective.

    A straight edge changes the cells beside it, so they are looked at again.
    """
    topology, count = space.mesh.topology, 0
    owned = topology.index_map(topology.dim).size_local
    while True:
        moved = np.flatnonzero(np.any((after != before)[space.dofmap.list], axis=(1, 2)))
        cells = space.dofmap.list[moved]
        turned = np.any(_jacobians(after[cells]) < least * _jacobians(before[cells]), axis=1)
        found = round(total(space.mesh.comm, np.count_nonzero(moved[turned] < owned)))
        if found == 0:
            return after, count
        back = la.vector(space.dofmap.index_map, 1)
        back.array[:] = 0.0
        back.array[cells[turned]] = 1.0
        back.scatter_reverse(la.InsertMode.add)
        back.scatter_forward()
        after, count = np.where(back.array[:, None] > 0.0, before, after), count + found


def _shared(on: Mapping[str, Entities]) -> dict[str, Entities]:
    """Those of the nodes of each side that are on several of them."""
    found, count = np.unique(np.concatenate(list(on.values())), return_counts=True)
    return {name: np.intersect1d(nodes_of, found[count > 1]) for name, nodes_of in on.items()}


def onto_curves(
    index_map: common.IndexMap, points: Array, on: Mapping[str, Entities], curves: Mapping[str, Curve]
) -> Array:
    """Points, those of curved sides moved onto their curves, on all ranks that have them. Collective.

    Args:
        index_map: of the points.
        points: all local ones, m, (n, d).
        on: the local points of curved sides that this rank knows of, by name.
        curves: by name; the others are left out.
    """
    found, d = points.copy(), points.shape[1]
    for name, nodes_of in on.items():
        x = found[nodes_of]
        shared = la.vector(index_map, d + 1)
        shared.array[:] = 0.0
        shared.array.reshape(-1, d + 1)[nodes_of] = np.column_stack([curves[name].nearest(x) - x, np.ones(len(x))])
        shared.scatter_reverse(la.InsertMode.add)
        shared.scatter_forward()
        total = shared.array.reshape(-1, d + 1)
        found += total[:, :d] / np.maximum(total[:, d:], 1.0)
    return found


def _jacobians(points: Array) -> Array:
    """The Jacobian determinants of cells (c, n, d) at their nodes, (c, n); positive where they are straight."""
    kind = {6: basix.CellType.triangle, 10: basix.CellType.tetrahedron}[points.shape[1]]
    element = basix.create_element(basix.ElementFamily.P, kind, 2, basix.LagrangeVariant.gll_warped)
    slopes = np.asarray(element.tabulate(1, np.asarray(element.points)))[1:, :, :, 0]
    straight = np.linalg.det(points[:, 1 : points.shape[2] + 1] - points[:, :1])
    signed = np.linalg.det(np.einsum("iqn,cnd->cqid", slopes, points))
    return np.asarray(signed * np.sign(straight)[:, None])
