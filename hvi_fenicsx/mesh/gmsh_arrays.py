"""What gmsh holds, as arrays, and whether it makes a mesh at all: dolfinx takes that for granted, or crashes.

A mesh is folded where two cells lie on the same side of their common facet. The order in which a file lists the
vertices of a cell is no fold. Two bodies that lie on each other are none either. Light: gmsh's own process uses it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import ROUNDING, spot
from ..typing import Array, Entities, Integers, together

_SIMPLEX = {1: {1: 1, 2: 2, 3: 4}, 2: {1: 8, 2: 9, 3: 11}}
"""Gmsh's element type of the simplex, by order and dimension."""
_BASIX = {3: [0, 1, 2], 6: [0, 1, 2, 4, 5, 3], 10: [0, 1, 2, 3, 8, 9, 5, 7, 6, 4]}
"""Where basix has the nodes of an edge, a triangle and a tetrahedron of order 2, by their number."""


@dataclass(frozen=True)
class MeshArrays:
    """A mesh of simplices with the tags of its physical groups.

    Attributes:
        points: coordinates of the nodes, (n, 3).
        cells: nodes of the cells, counted from 0, corners first, then midpoints in the order of basix, (c, nodes).
        cell_tags: physical group of each cell, (c,).
        facets: nodes of the facets in physical groups, likewise, (f, nodes).
        facet_tags: physical group of each facet, (f,).
    """

    points: Array
    cells: Integers
    cell_tags: Entities
    facets: Integers
    facet_tags: Entities


@contextmanager
def session() -> Iterator[Any]:
    """The gmsh module without the user's settings and its own messages; it is finalised in the end."""
    import gmsh

    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def close_gaps(gmsh: Any) -> None:
    """Number the nodes without gaps."""
    tags = gmsh.model.mesh.getNodes()[0]
    if len(tags) and np.max(tags) != len(tags):
        gmsh.model.mesh.renumberNodes()


def extract(gmsh: Any, dimension: int) -> MeshArrays:
    """The mesh that is open in gmsh; its nodes are numbered without gaps.

    Args:
        gmsh: the module.
        dimension: of the cells.
    """
    return MeshArrays(points(gmsh), *_grouped(gmsh, dimension), *_grouped(gmsh, dimension - 1))


def points(gmsh: Any) -> Array:
    """The nodes by their tags, (n, 3)."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    return flat.reshape(-1, 3)[np.argsort(tags)]


def _grouped(gmsh: Any, dimension: int) -> tuple[Integers, Entities]:
    """The nodes of the simplices in physical groups, (n, nodes), and their groups, (n,)."""
    rows, tags = [], []
    for _, group in gmsh.model.getPhysicalGroups(dimension):
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for kind, _, found in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
                count = gmsh.model.mesh.getElementProperties(kind)[3]
                rows.append(np.asarray(found, dtype=np.int64).reshape(-1, count) - 1)
                tags.append(np.full(len(rows[-1]), group, dtype=np.int32))
    nodes = np.concatenate(rows) if rows else np.empty((0, dimension + 1), dtype=np.int64)
    order = _BASIX[nodes.shape[1]] if nodes.shape[1] > dimension + 1 else slice(None)
    return nodes[:, order], together(tags)


def check(gmsh: Any, path: Path, dimension: int) -> MeshArrays:
    """The mesh that is open in gmsh, if dolfinx can take it.

    Args:
        gmsh: the module.
        path: of the file, for messages.
        dimension: of the cells, 2 or 3.

    Raises:
        InputError: with the node or element tags of the first fault.
    """
    file = f"mesh file {path}:"
    _check_cells(gmsh, file, dimension)
    found = extract(gmsh, dimension)
    _check_points(gmsh, file, found, dimension)
    _check_connections(file, found, dimension)
    folded = folded_cells(found.points[:, :dimension], found.cells[:, : dimension + 1])
    if len(folded):
        nodes = found.cells[folded[0], : dimension + 1]
        where = spot(found.points[nodes].mean(axis=0)[:dimension])
        text = f"the mesh is folded at {where}: the cell of nodes {', '.join(map(str, nodes + 1))} lies over another"
        raise InputError(f"{file} {text} one; remesh")
    return found


def _check_cells(gmsh: Any, file: str, dimension: int) -> None:
    """Refuse cells of another dimension, or that are no simplices of order 1 or 2."""
    found = gmsh.model.getDimension()
    if found < 0:
        raise InputError(f"{file} it holds neither a mesh nor a geometry; give a file that gmsh has saved")
    if found != dimension:
        raise InputError(f"{file} its cells have dimension {found}, the material's model wants {dimension}")
    if not gmsh.model.getPhysicalGroups(dimension):
        kind, command = ("surface", "Physical Surface") if dimension == 2 else ("volume", "Physical Volume")
        raise InputError(
            f"{file} no physical group holds cells (dimension {dimension}), so gmsh leaves them out; put "
            f'every {kind} into one: {command}("body") = {{...}};'
        )
    cells, sides = (set(gmsh.model.mesh.getElements(d)[0]) for d in (dimension, dimension - 1))
    if not any(cells == {kinds[dimension]} and sides <= {kinds[dimension - 1]} for kinds in _SIMPLEX.values()):
        shape = "triangles" if dimension == 2 else "tetrahedra"
        orders = [gmsh.model.mesh.getElementProperties(kind)[2] for kind in cells | sides]
        way = "with -order 2" if max(orders) > 2 else "without recombination"
        raise InputError(f"{file} linear {shape} only, or those of order 2; remesh {way}")


def _check_points(gmsh: Any, file: str, found: MeshArrays, dimension: int) -> None:
    """Refuse coordinates that are not finite, or not in the plane, and cells without volume."""
    points = found.points
    if not np.all(np.isfinite(points)):
        raise InputError(f"{file} a node's coordinates are not finite numbers")
    if dimension == 2 and np.ptp(points[:, 2]) > ROUNDING * np.ptp(points[:, :2]):
        raise InputError(f"{file} a 2D mesh must lie in a plane z = constant")
    tags = gmsh.model.mesh.getElements(dimension)[1][0]
    quality = np.abs(gmsh.model.mesh.getElementQualities(tags, "gamma"))
    if not np.all(quality > ROUNDING):
        raise InputError(f"{file} cell {tags[int(np.argmin(quality))]} has no volume; remesh")


def _check_connections(file: str, found: MeshArrays, dimension: int) -> None:
    """Refuse lost nodes, elements listed twice, facets of more than two cells, sides that lie on no cell."""
    lost = np.concatenate([found.cells.ravel(), found.facets.ravel()]) >= len(found.points)
    if np.any(lost):
        raise InputError(f"{file} a node of an element is not there; remesh")
    cells, sides = (np.sort(rows[:, : dimension + 1 - i] + 1) for i, rows in enumerate((found.cells, found.facets)))
    facets = np.concatenate([cells[:, list(c)] for c in combinations(range(dimension + 1), dimension)])
    for rows in (cells, sides):
        _refuse_more_than(1, rows, f"{file} the element of nodes", "is listed twice, or in two groups")
    _refuse_more_than(2, facets, f"{file} the facet of nodes", "has more than two cells")
    distinct, _ = _counted(facets)
    together, counts = _counted(np.concatenate([distinct, distinct, sides]))
    if np.any(counts == 1):
        first = ", ".join(map(str, together[np.argmax(counts == 1)]))
        raise InputError(f"{file} the boundary element of nodes {first} lies on no cell; remesh")


def _refuse_more_than(most: int, rows: Integers, what: str, fault: str) -> None:
    distinct, counts = _counted(rows)
    if np.any(counts > most):
        first = ", ".join(map(str, distinct[np.argmax(counts > most)]))
        raise InputError(f"{what} {first} {fault}; remesh")


def _counted(rows: Integers) -> tuple[Integers, Integers]:
    """The distinct ones among sorted rows, and how often each is there (``np.unique`` takes four times as long)."""
    ordered = rows[np.lexsort(rows.T)]
    first = np.flatnonzero(np.append(len(rows) > 0, np.any(ordered[1:] != ordered[:-1], axis=1)))
    return ordered[first], np.diff(np.append(first, len(rows)))


def folded_cells(points: Array, cells: Integers) -> Integers:
    """The two cells at each fold, those that lie on the same side of their common facet; empty where there is none.

    Args:
        points: the vertices, (n, d).
        cells: the vertices of each simplex, (c, d+1).
    """
    corners = range(cells.shape[1])
    facets = np.sort(np.concatenate([np.delete(cells, i, axis=1) for i in corners]), axis=1)
    opposite = np.concatenate([cells[:, i] for i in corners])
    edges = points[np.column_stack([facets[:, 1:], opposite])] - points[facets[:, :1]]
    side = np.sign(_volumes(edges))
    order = np.lexsort(facets.T)
    same = np.all(facets[order[1:]] == facets[order[:-1]], axis=1) & (side[order[1:]] == side[order[:-1]])
    return np.unique(np.concatenate([order[1:][same], order[:-1][same]]) % len(cells))


def _volumes(edges: Array) -> Array:
    """The determinants of (k, d, d): much faster than NumPy's for so small ones."""
    if edges.shape[1] == 2:
        return edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    return np.einsum("ki,ki->k", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2])
