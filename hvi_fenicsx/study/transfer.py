"""Fields from one mesh onto the nodes of another, in bodies and along Γc: exact where the meshes are nested.

A node takes the field of its own body: where two meet, both have cells at it. Where the meshes are not nested (curved
boundaries, meshes made anew) a node outside of all cells takes its nearest cell's field, continued.
"""

from __future__ import annotations

from collections.abc import Collection

import basix
import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI
from scipy import sparse
from scipy.sparse import csgraph

from .. import compat
from ..mesh import nodes, transfer
from ..report.contact_part import ContactPart
from ..report.solution_arrays import SolutionArrays
from ..typing import Array, Integers

_KINDS = {1: "interval", 2: "triangle", 3: "tetrahedron"}


def cells_of(arrays: SolutionArrays) -> Integers:
    """The cells of a solution by their nodes, corners first, (c, nodes)."""
    return arrays.cells if arrays.degree == 1 else nodes.joined(arrays.cells)


def edge_ends(arrays: SolutionArrays) -> Integers:
    """The vertices whose middle each node is, (n, 2); a vertex is named twice."""
    cells, d = cells_of(arrays), arrays.points.shape[1]
    found = np.repeat(np.arange(len(arrays.points))[:, None], 2, axis=1)
    edges = basix.topology(basix.CellType[_KINDS[d]])[1]
    for node, ends in zip(cells.T[d + 1 :], edges, strict=False):
        found[node] = cells[:, list(ends)]
    return found


def mesh_width(arrays: SolutionArrays) -> float:
    """The edge of an equilateral cell as large as the largest one, m: it halves where a mesh is refined uniformly."""
    d = arrays.points.shape[1]
    corners = arrays.points[cells_of(arrays)[:, : d + 1]]
    largest = float(np.max(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])), initial=0.0))
    return float((largest * (2.0 / np.sqrt(3.0) if d == 2 else np.sqrt(2.0))) ** (1.0 / d))


class Targets:
    """The nodes of a solution, and the places on the other side of its joints, each with its body.

    Args:
        arrays: the solution.
        joints: the parts of Γc at which two bodies meet.

    Attributes:
        points: m, (n + k, d): the nodes, then the vertices of the joints as places in the other body.
        bodies: a number of the body of each of these, (n + k,).
        middles: the middle of each cell, m, (c, d).
        cell_bodies: the body of each cell, (c,).
        others: by joint, the rows of ``points`` of its vertices in the other body.
    """

    def __init__(self, arrays: SolutionArrays, joints: Collection[str]) -> None:
        cells, own = cells_of(arrays), _bodies(arrays)
        self.middles = arrays.points[cells[:, : arrays.points.shape[1] + 1]].mean(axis=1)
        self.cell_bodies = own[cells[:, 0]]
        self.points, self.bodies = arrays.points, own
        self.others: dict[str, Integers] = {}
        for name in sorted(arrays.parts.keys() & set(joints)):
            vertices = arrays.parts[name].vertices
            beyond = cells[self.cell_bodies != own[vertices[0]]]
            holding = beyond[
                _Mesh(arrays.points, beyond).containing(arrays.points[vertices]), : self.middles.shape[1] + 1
            ]
            corners = arrays.points[holding]
            weights = transfer.clipped(transfer.barycentric_weights(corners, arrays.points[vertices]))
            self.others[name] = np.arange(len(self.points), len(self.points) + len(vertices))
            self.points = np.vstack([self.points, np.einsum("mc,mcd->md", weights, corners)])
            self.bodies = np.append(self.bodies, own[holding[:, 0]])


def _bodies(arrays: SolutionArrays) -> Integers:
    """Numbers of the connected meshes that the nodes belong to, (n,)."""
    cells = cells_of(arrays)
    first, size = np.repeat(cells[:, 0], cells.shape[1]), len(arrays.points)
    graph = sparse.coo_array((np.ones(cells.size, dtype=np.int8), (first, cells.ravel())), shape=(size, size))
    return np.asarray(csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


class BodyTransfer:
    """From the nodes of a mesh to points in its bodies. On this process alone.

    Args:
        source: a solution on the mesh.
        targets: the points.
    """

    def __init__(self, source: SolutionArrays, targets: Targets) -> None:
        self._shape = targets.points.shape
        own, cells = _bodies(source), cells_of(source)
        everything = _Mesh(source.points, cells)
        holding = own[cells[everything.containing(targets.middles), 0]]
        self._pieces: list[tuple[Integers, _Mesh, Array, Integers]] = []
        for body in np.unique(targets.bodies):
            same = np.bincount(holding[targets.cell_bodies == body]).argmax()
            mesh_of = everything if own.max() == 0 else _Mesh(source.points, cells[own[cells[:, 0]] == same])
            rows = np.flatnonzero(targets.bodies == body)
            points = targets.points[rows]
            self._pieces.append((rows, mesh_of, points, mesh_of.local(points)))

    def __call__(self, values: Array) -> Array:
        """Vectors at the points, from those at the nodes."""
        found = np.empty(self._shape)
        for rows, mesh_of, points, cells in self._pieces:
            found[rows] = mesh_of.at(values, points, cells)
        return found


class _Mesh:
    """A mesh of cells by their nodes, on this process alone; its functions have the degree of the cells."""

    def __init__(self, points: Array, cells: Integers) -> None:
        self._kept, local = np.unique(cells, return_inverse=True)
        d, count = points.shape[1], cells.shape[1]
        self._mesh = compat.simplex_mesh(
            MPI.COMM_SELF, local.reshape(cells.shape), points[self._kept], _KINDS[d], degree=1 if count == d + 1 else 2
        )
        self._space: fem.FunctionSpace | None = None

    def containing(self, points: Array) -> Integers:
        """The number, as they were given, of the cell that holds each point, or of the nearest one."""
        return np.asarray(self._mesh.topology.original_cell_index[self.local(points)])

    def local(self, points: Array) -> Integers:
        """The number in the mesh of the cell that holds each point, or of the nearest one."""
        return transfer.containing_cells(self._mesh, _in_space(points))

    def at(self, values: Array, points: Array, cells: Integers) -> Array:
        """Vectors (m, d) at points in cells, from those at all nodes."""
        d = values.shape[1]
        if self._space is None:
            self._space = fem.functionspace(self._mesh, ("Lagrange", compat.geometry_degree(self._mesh), (d,)))
        field, numbers = fem.Function(self._space), self._mesh.geometry.input_global_indices
        dofs = compat.geometry_dofmap(self._mesh)
        field.x.array.reshape(-1, d)[self._space.dofmap.list] = values[self._kept[numbers[dofs]]]
        return np.asarray(field.eval(_in_space(points), cells.astype(np.int32))).reshape(-1, d)


def rows_of(arrays: SolutionArrays, part: ContactPart) -> Integers:
    """The row that each node of a solution has in a part, (n,); any number where it has none.

    Args:
        arrays: the solution.
        part: of it.
    """
    found = np.empty(len(arrays.points), dtype=np.int64)
    found[part.vertices] = np.arange(len(part.vertices))
    return found


def surface(source: SolutionArrays, part: ContactPart, points: Array) -> sparse.csr_array:
    """The matrix from a part's rows (n) to points on it (m) of what is linear between neighbouring nodes, as tractions.

    Args:
        source: the solution.
        part: of it.
        points: m, (m, d).
    """
    kept, local = np.unique(part.facets, return_inverse=True)
    d = points.shape[1]
    line = compat.simplex_mesh(MPI.COMM_SELF, local.reshape(-1, d), source.points[kept], _KINDS[d - 1])
    tree = geometry.bb_tree(line, d - 1)
    middles = geometry.create_midpoint_tree(line, d - 1, np.arange(len(part.facets), dtype=np.int32))
    nearest = geometry.compute_closest_entity(tree, middles, line, _in_space(points))
    corners = part.facets[line.topology.original_cell_index[nearest]]
    weights = transfer.clipped(transfer.barycentric_weights(source.points[corners], points))
    starts = np.arange(0, corners.size + 1, d)
    return sparse.csr_array(
        (weights.ravel(), rows_of(source, part)[corners].ravel(), starts), (len(points), len(part.vertices))
    )


def _in_space(points: Array) -> Array:
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
