"""Cells with curved edges: at degree 2 the mesh of a body whose sides lie on known curves.

It has the topology of the straight mesh, so that cells, facets and dofs have the same numbers, and one node more on
each edge: on the curve where the edge lies on a curved side, else in the middle.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import common, fem, la
from dolfinx import mesh as dmesh
from scipy.spatial import KDTree

from .. import compat
from ..errors import InputError
from ..geometry import ROUNDING, Curve, in_space, spot
from ..runtime.mpi import agree, total
from ..typing import Array, Entities, Integers
from . import nodes, transfer
from .domain import DEFAULT, Domain
from .nodes import edges, lagrange, middles, to_barycentric

_SWEEPS = 3
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


def mesh_of(domain: Domain, degree: int) -> dmesh.Mesh:
    """The mesh that displacements of a degree live on. Collective.

    Args:
        domain: the body.
        degree: of the elements; at degree 1 cells are straight.
    """
    if degree == 1 or not (domain.curves and domain.bends):
        return domain.mesh
    return domain.once("curved cells", None, lambda: _curved(domain, sorted(domain.curves)))


def _curved(domain: Domain, names: Collection[str]) -> CurvedMesh:
    space = fem.functionspace(domain.mesh, ("Lagrange", 2))
    before = nodes.points(space)[:, : domain.dimension]
    on = {name: np.unique(nodes.facet_nodes(space, domain.sides[name])) for name in names}
    after = before
    for _ in range(_SWEEPS if domain.dimension == 3 else 1):  # in space sides share edges
        after = onto_curves(space.dofmap.index_map, after, on, domain.curves)
    after, straight = _straightened(space, before, after)
    return CurvedMesh(compat.quadratic_mesh(domain.mesh, space.dofmap, in_space(after)), straight)


def _straightened(space: fem.FunctionSpace, before: Array, after: Array) -> tuple[Array, int]:
    """The nodes (n, d), those of cells back that would be bent too much, and the number of these. Collective.

    A straight edge changes the cells beside it, so they are looked at again.
    """
    topology, count = space.mesh.topology, 0
    owned = topology.index_map(topology.dim).size_local
    while True:
        moved = np.flatnonzero(np.any((after != before)[space.dofmap.list], axis=(1, 2)))
        cells = space.dofmap.list[moved]
        turned = np.any(_jacobians(after[cells]) < DEFAULT.least_jacobian * _jacobians(before[cells]), axis=1)
        found = round(total(space.mesh.comm, np.count_nonzero(moved[turned] < owned)))
        if found == 0:
            return after, count
        back = la.vector(space.dofmap.index_map, 1)
        back.array[:] = 0.0
        back.array[cells[turned]] = 1.0
        back.scatter_reverse(la.InsertMode.add)
        back.scatter_forward()
        after, count = np.where(back.array[:, None] > 0.0, before, after), count + found


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
    element = lagrange(points.shape[2] + 1, 2)
    slopes = np.asarray(element.tabulate(1, np.asarray(element.points)))[1:, :, :, 0]
    straight = np.linalg.det(points[:, 1 : points.shape[2] + 1] - points[:, :1])
    signed = np.linalg.det(np.einsum("iqn,cnd->cqid", slopes, points))
    return signed * np.sign(straight)[:, None]


def is_curved(facets: Array) -> bool:
    """Whether any midpoint is off the middle of its edge.

    Args:
        facets: by their nodes, corners first, then midpoints in the order of basix, (k, n, d).
    """
    off, edge = _offsets(facets)
    return bool(np.any(np.linalg.norm(off, axis=-1) > ROUNDING * np.linalg.norm(edge, axis=-1)))


def _turning_back(facets: Array) -> Integers:
    """The facets that have a midpoint beyond the middle half of its edge: from there on the curve turns back."""
    off, edge = _offsets(facets)
    return np.flatnonzero(np.any(4 * np.abs(np.sum(off * edge, axis=-1)) >= np.sum(edge**2, axis=-1), axis=1))


def _offsets(facets: Array) -> tuple[Array, Array]:
    """Midpoints from the middles of their edges, and the edges as vectors, (k, edges, d)."""
    d = facets.shape[2]
    first, last = (facets[:, ends] for ends in np.array(edges(d)).T)
    return facets[:, d:] - (first + last) / 2, last - first


def straightened(
    mesh: dmesh.Mesh, sides: Mapping[str, Entities], regions: Mapping[str, Entities], place: str
) -> tuple[dmesh.Mesh, Mapping[str, Entities], Mapping[str, Entities], dict[str, Curve]]:
    """What makes a domain of a mesh whose cells may be curved: they become straight, curved sides stay. Collective.

    Args:
        mesh: of first or second order.
        sides: local facets by name.
        regions: local cells by name.
        place: where it comes from, for messages.

    Raises:
        InputError: a curve turns back within a facet.
    """
    if compat.geometry_degree(mesh) == 1:
        return mesh, sides, regions, {}
    space, curves = fem.functionspace(mesh, ("Lagrange", 2)), dict[str, Curve]()
    points = nodes.points(space)[:, : mesh.geometry.dim]
    for name, facets in sides.items():
        side = np.concatenate(agree(mesh.comm, points[nodes.facet_nodes(space, facets)]))
        if len(turning := _turning_back(side)):
            raise InputError(
                f"{place}: the side {name!r} has at {spot(side[turning[0]].mean(axis=0))} a midpoint that lies beyond "
                "the middle half of its edge, where a curve of second order turns back; remesh"
            )
        if is_curved(side):
            curves[name] = CurvedFacets(side)
    return compat.linear_mesh(mesh), sides, regions, curves


_STEPS = 12
"""Gauss-Newton steps from the projection onto the straight facet; the bend of a facet is a small part of its size."""


@dataclass(frozen=True)
class CurvedFacets:
    """A side of k facets of second order in d dimensions.

    Attributes:
        points: the nodes of each facet, corners first, then midpoints of edges in the order of basix, m, (k, n, d).
    """

    points: Array

    def nearest(self, x: Array) -> Array:
        """The points of the side nearest to the points x, both (m, d), m; of the middle of an edge its own node.

        So an edge between two sides stays on both.
        """
        if not len(x):
            return np.array(x, dtype=np.float64)
        facet, point = self._pairs(x)
        found, away = self._projected(facet, x[point])
        order = np.argsort(-away, kind="stable")  # of several facets of one point, the last one stays
        result = np.array(x, dtype=np.float64)
        result[point[order]] = found[order]
        straight, own = self._middles()
        away, number = KDTree(straight).query(x)
        same = away <= ROUNDING * np.linalg.norm(np.ptp(self.points, axis=(0, 1)))
        result[same] = own[number[same]]
        return result

    def moved(self, origin: Array, rotation: Array) -> CurvedFacets:
        """The side turned about the origin of coordinates, and then moved.

        Args:
            origin: where the origin of coordinates comes to lie, m, (d,).
            rotation: (d, d).
        """
        return CurvedFacets(self.points @ rotation.T + origin)

    def _middles(self) -> tuple[Array, Array]:
        """The middles of the edges if they were straight, and their nodes, (e, d) both."""
        d = self.points.shape[2]
        return middles(self.points[:, :d]).reshape(-1, d), self.points[:, d:].reshape(-1, d)

    def _pairs(self, x: Array) -> tuple[Integers, Integers]:
        """Facets, and points that may be nearest to them; all facets for points that are near none."""
        centres = self.points.mean(axis=1)
        radii = 1.5 * np.linalg.norm(self.points - centres[:, None], axis=2).max(axis=1)
        near = KDTree(x).query_ball_point(centres, radii, return_sorted=True)
        facet = np.repeat(np.arange(len(near)), [len(one) for one in near])
        point = np.concatenate([np.empty(0), *near]).astype(np.int64)
        lost = np.setdiff1d(np.arange(len(x)), point)
        everything = np.arange(len(centres))
        facet = np.concatenate([facet, np.tile(everything, len(lost))])
        return facet, np.concatenate([point, np.repeat(lost, len(centres))])

    def _projected(self, facet: Integers, x: Array) -> tuple[Array, Array]:
        """The points of facets nearest to points (p, d), and how far they are away, (p,)."""
        d = x.shape[1]
        element = lagrange(d, 2)
        nodes = self.points[facet]
        place = transfer.clipped(transfer.barycentric_weights(nodes[:, :d], x))[:, 1:]
        for _ in range(_STEPS):
            found, slopes = _at(element, nodes, place)
            gram = np.einsum("ipd,jpd->pij", slopes, slopes)
            right = np.einsum("ipd,pd->pi", slopes, x - found)
            place = place + np.linalg.solve(gram, right[:, :, None])[:, :, 0]
            place = transfer.clipped(to_barycentric(place))[:, 1:]
        found, _ = _at(element, nodes, place)
        return found, np.linalg.norm(found - x, axis=1)


def _at(element: basix.finite_element.FiniteElement, nodes: Array, place: Array) -> tuple[Array, Array]:
    """Points of facets (p, d) and their derivatives by the reference coordinates (d-1, p, d)."""
    table = np.asarray(element.tabulate(1, np.ascontiguousarray(place)))[:, :, :, 0]
    values = np.einsum("ipn,pnd->ipd", table, nodes)
    return values[0], values[1:]
