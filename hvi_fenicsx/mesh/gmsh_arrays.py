"""What gmsh holds, as arrays, and whether it makes a mesh at all: dolfinx takes that for granted, or crashes.

Light: gmsh's own process uses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import spot
from ..typing import Array, Entities, Integers
from . import cell_checks
from .thresholds import ROUNDING

_SIMPLEX = {1: 1, 2: 2, 3: 4}
"""Gmsh's element type of the linear simplex, by dimension."""


_LARGEST = 1e12
"""The largest coordinate, in the file's unit."""


def check(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse a mesh that dolfinx cannot take. Rank 0 only.

    Args:
        gmsh: the module, the file being open in it.
        path: of the file, for messages.
        dimension: of the cells, 2 or 3.

    Raises:
        InputError: with the node or element tags of the first fault.
    """
    _check_cells(gmsh, path, dimension)
    _check_points(gmsh, path, dimension)
    _check_quality(gmsh, path, dimension)
    _check_connections(gmsh, path, dimension)
    _check_folds(gmsh, path, dimension)


def _check_cells(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse cells of another dimension, or that are no linear simplices."""
    found = gmsh.model.getDimension()
    if found < 0:
        raise InputError(f"mesh file {path}: it holds neither a mesh nor a geometry; give a file that gmsh has saved")
    if found != dimension:
        raise InputError(f"mesh file {path}: its cells have dimension {found}, the material's model wants {dimension}")
    if not gmsh.model.getPhysicalGroups(dimension):
        kind, command = ("surface", "Physical Surface") if dimension == 2 else ("volume", "Physical Volume")
        raise InputError(
            f"mesh file {path}: no physical group holds cells (dimension {dimension}), so gmsh leaves them out; put "
            f'every {kind} into one: {command}("body") = {{...}};'
        )
    cells, sides = (set(gmsh.model.mesh.getElements(d)[0]) for d in (dimension, dimension - 1))
    if cells != {_SIMPLEX[dimension]} or not sides <= {_SIMPLEX[dimension - 1]}:
        shape = "triangles" if dimension == 2 else "tetrahedra"
        orders = [gmsh.model.mesh.getElementProperties(kind)[2] for kind in cells | sides]
        way = "with -order 2" if max(orders) > 2 else "without recombination"
        raise InputError(f"mesh file {path}: linear {shape} only, or those of order 2; remesh {way}")


def _check_points(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse coordinates that are not finite, too large, or not in the plane."""
    points = np.asarray(gmsh.model.mesh.getNodes()[1]).reshape(-1, 3)
    if not np.all(np.isfinite(points)):
        raise InputError(f"mesh file {path}: a node's coordinates are not finite numbers")
    if np.max(np.abs(points)) > _LARGEST:
        raise InputError(f"mesh file {path}: a node's coordinate is beyond ±{_LARGEST:g}; remesh near the origin")
    if dimension == 2 and np.ptp(points[:, 2]) > ROUNDING * np.ptp(points[:, :2]):
        raise InputError(f"mesh file {path}: a 2D mesh must lie in a plane z = constant")


def _check_quality(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse cells without volume."""
    tags = gmsh.model.mesh.getElements(dimension)[1][0]
    quality = np.abs(gmsh.model.mesh.getElementQualities(tags, "gamma"))
    if not np.all(quality > ROUNDING):
        raise InputError(f"mesh file {path}: cell {tags[int(np.argmin(quality))]} has no volume; remesh")


def _check_connections(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse lost nodes, elements listed twice, facets of more than two cells, sides that lie on no cell."""
    cells, sides = (_elements(gmsh, d) for d in (dimension, dimension - 1))
    facets = np.concatenate([cells[:, list(c)] for c in combinations(range(dimension + 1), dimension)])
    lost = np.setdiff1d(np.concatenate([cells.ravel(), sides.ravel()]), gmsh.model.mesh.getNodes()[0])
    if len(lost):
        raise InputError(f"mesh file {path}: node {lost[0]} of an element is not there; remesh")
    for rows in (cells, sides):
        _refuse_more_than(1, rows, f"mesh file {path}: the element of nodes", "is listed twice, or in two groups")
    _refuse_more_than(2, facets, f"mesh file {path}: the facet of nodes", "has more than two cells")
    distinct, _ = _counted(facets)
    together, counts = _counted(np.concatenate([distinct, distinct, sides]))
    if np.any(counts == 1):
        first = ", ".join(map(str, together[np.argmax(counts == 1)]))
        raise InputError(f"mesh file {path}: the boundary element of nodes {first} lies on no cell; remesh")


def _check_folds(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse cells that lie over each other."""
    found = extract(gmsh, dimension)
    folded = cell_checks.folded_cells(found.points[:, :dimension], found.cells)
    if len(folded):
        nodes = found.cells[folded[0]]
        where = spot(found.points[nodes].mean(axis=0)[:dimension])
        text = f"the mesh is folded at {where}: the cell of nodes {', '.join(map(str, nodes + 1))} lies over another"
        raise InputError(f"mesh file {path}: {text} one; remesh")


def _elements(gmsh: Any, dimension: int) -> Integers:
    """Node tags of the simplices in groups, shape (n, dimension + 1), sorted in each row."""
    return np.sort(grouped(gmsh, dimension)[0] + 1, axis=1)


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


@dataclass(frozen=True)
class MeshArrays:
    """A mesh of simplices with the tags of its physical groups.

    Attributes:
        points: coordinates of the nodes, (n, 3).
        cells: nodes of the cells, counted from 0, (c, d+1).
        cell_tags: physical group of each cell, (c,).
        facets: nodes of the facets in physical groups, (f, d).
        facet_tags: physical group of each facet, (f,).
        curved: the nodes of facets of second order, corners first, then midpoints of edges in the order of basix; of
            groups some of whose facets are curved, (k, n, 3).
        curved_tags: physical group of each of these, (k,).
    """

    points: Array
    cells: Integers
    cell_tags: Entities
    facets: Integers
    facet_tags: Entities
    curved: Array
    curved_tags: Entities

    @classmethod
    def empty(cls, dimension: int) -> MeshArrays:
        """What the ranks have that gmsh does not run on."""
        return cls(np.empty((0, 3)), *_joined([], dimension), *_joined([], dimension - 1), *no_curves(dimension))


def start(gmsh: Any) -> None:
    """Start gmsh without the user's settings, and without its own messages."""
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)


def close_gaps(gmsh: Any) -> None:
    """Number the nodes without gaps."""
    tags = gmsh.model.mesh.getNodes()[0]
    if len(tags) and np.max(tags) != len(tags):
        gmsh.model.mesh.renumberNodes()


def no_curves(dimension: int) -> tuple[Array, Entities]:
    """The curved facets and their groups of a mesh that has none.

    Args:
        dimension: of the cells.
    """
    return np.empty((0, {2: 3, 3: 6}[dimension], 3)), np.empty(0, dtype=np.int32)


def extract(gmsh: Any, dimension: int, curves: tuple[Array, Entities] | None = None) -> MeshArrays:
    """The mesh that is open in gmsh; its nodes are numbered without gaps.

    Args:
        gmsh: the module.
        dimension: of the cells.
        curves: curved facets and their groups, if there are any.
    """
    tags, points, _ = gmsh.model.mesh.getNodes()
    ordered = points.reshape(-1, 3)[np.argsort(tags)]
    groups = *grouped(gmsh, dimension), *grouped(gmsh, dimension - 1)
    return MeshArrays(ordered, *groups, *(curves or no_curves(dimension)))


def grouped(gmsh: Any, dimension: int) -> tuple[Integers, Entities]:
    """The simplices in physical groups.

    Args:
        gmsh: the module.
        dimension: of the simplices.

    Returns:
        Their nodes, counted from 0, shape (n, dimension + 1), and their groups, shape (n,).
    """
    found: list[tuple[Integers, int]] = []
    for _, group in gmsh.model.getPhysicalGroups(dimension):
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for nodes in gmsh.model.mesh.getElements(dimension, entity)[2]:
                found.append((np.asarray(nodes, dtype=np.int64).reshape(-1, dimension + 1) - 1, group))
    return _joined(found, dimension)


def _joined(found: list[tuple[Integers, int]], dimension: int) -> tuple[Integers, Entities]:
    nodes = [np.empty((0, dimension + 1), dtype=np.int64), *(rows for rows, _ in found)]
    tags = [np.empty(0, dtype=np.int32), *(np.full(len(rows), group, dtype=np.int32) for rows, group in found)]
    return np.concatenate(nodes), np.concatenate(tags)
