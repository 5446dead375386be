"""The mesh in gmsh's model as arrays. Light: no MPI, no dolfinx, since a process of its own makes some of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..typing import Array, Entities, Integers


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
