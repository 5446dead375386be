"""Fields from one mesh onto the nodes of another, in bodies and along Γc: exact where the meshes are nested.

A node takes the field of its own body: where two meet, both have cells at it. Where the meshes are not nested (curved
boundaries, meshes made anew) a node outside of all cells takes its nearest cell's field, continued.
"""

from __future__ import annotations

import basix
import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI
from scipy import sparse
from scipy.sparse import csgraph

from .. import compat
from ..mesh import nodes, transfer
from ..report.solution_arrays import ContactPart, SolutionArrays
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


class BodyTransfer:
    """From the nodes of a mesh to those of another one of the same bodies. On this process alone.

    Args:
        source: a solution on the mesh.
        target: one on the other mesh.
    """

    def __init__(self, source: SolutionArrays, target: SolutionArrays) -> None:
        self._shape = target.points.shape
        cells, bodies, wanted = cells_of(source), _bodies(source), _bodies(target)
        boxes = _boxes(source, bodies)
        self._pieces: list[tuple[Integers, _Body]] = []
        for body, box in enumerate(_boxes(target, wanted)):
            same = np.argmin(np.linalg.norm(boxes - box, axis=1))
            rows = np.flatnonzero(wanted == body)
            self._pieces.append((rows, _Body(source.points, cells[bodies[cells[:, 0]] == same], target.points[rows])))

    def __call__(self, values: Array) -> Array:
        """Vectors at the nodes of the target, from those at the nodes of the source."""
        found = np.empty(self._shape)
        for rows, body in self._pieces:
            found[rows] = body(values)
        return found


def _bodies(arrays: SolutionArrays) -> Integers:
    """Numbers of the connected meshes that the nodes belong to, (n,)."""
    cells = cells_of(arrays)
    first, size = np.repeat(cells[:, 0], cells.shape[1]), len(arrays.points)
    graph = sparse.coo_array((np.ones(cells.size, dtype=np.int8), (first, cells.ravel())), shape=(size, size))
    return np.asarray(csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


def _boxes(arrays: SolutionArrays, bodies: Integers) -> Array:
    """The ends of each body along the axes, m, (bodies, 2d)."""
    points = (arrays.points[bodies == body] for body in range(bodies.max() + 1))
    return np.array([np.concatenate([own.min(axis=0), own.max(axis=0)]) for own in points])


class _Body:
    """A body's mesh, on this process alone, and points in it; its functions have the degree of its cells."""

    def __init__(self, vertices: Array, cells: Integers, points: Array) -> None:
        self._kept, local = np.unique(cells, return_inverse=True)
        d, degree = vertices.shape[1], 1 if cells.shape[1] == vertices.shape[1] + 1 else 2
        mesh = compat.simplex_mesh(
            MPI.COMM_SELF, local.reshape(cells.shape), vertices[self._kept], _KINDS[d], degree=degree
        )
        self._points = _in_space(points)
        self._cells = transfer.containing_cells(mesh, self._points).astype(np.int32)
        self._field = fem.Function(fem.functionspace(mesh, ("Lagrange", degree, (d,))))
        self._nodes = self._kept[mesh.geometry.input_global_indices[compat.geometry_dofmap(mesh)]]

    def __call__(self, values: Array) -> Array:
        """Vectors (m, d) at the points, from those at all nodes of the source."""
        d = values.shape[1]
        self._field.x.array.reshape(-1, d)[self._field.function_space.dofmap.list] = values[self._nodes]
        return np.asarray(self._field.eval(self._points, self._cells)).reshape(-1, d)


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
