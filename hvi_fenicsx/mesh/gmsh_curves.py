"""Meshes of second order in gmsh: their sides remain as curves, their cells become straight. Light, as gmsh_arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..typing import Array, Entities, Integers
from . import gmsh_arrays, second_order

_QUADRATIC = {1: 8, 2: 9, 3: 11}
"""Gmsh's element type of the simplex of second order, by dimension."""
_ORDER = {1: [0, 1, 2], 2: [0, 1, 2, 4, 5, 3]}
"""Where basix has the nodes of a facet, by its dimension."""


def straightened(gmsh: Any, path: Path, dimension: int) -> tuple[Array, Entities]:
    """Make a mesh of second order one of first order; its curved facets (k, n, 3), and their groups (k,).

    Facets of a group all of whose midpoints are in the middle of their edges are left out.

    Args:
        gmsh: the module, the file being open in it.
        path: of the file, for messages.
        dimension: of the cells, 2 or 3.

    Raises:
        InputError: a midpoint is so far from the middle of its edge that the curve turns back.
    """
    cells = set(gmsh.model.mesh.getElements(dimension)[0]) if gmsh.model.getDimension() == dimension else set()
    if cells != {_QUADRATIC[dimension]}:
        return gmsh_arrays.no_curves(dimension)
    found = [_facets(gmsh, path, dimension - 1, group) for _, group in gmsh.model.getPhysicalGroups(dimension - 1)]
    gmsh.model.mesh.setOrder(1)
    gmsh_arrays.close_gaps(gmsh)
    points, groups = zip(gmsh_arrays.no_curves(dimension), *found, strict=True)
    return np.concatenate(points), np.concatenate(groups)


def _facets(gmsh: Any, path: Path, dimension: int, group: int) -> tuple[Array, Entities]:
    """The facets of a group and the group of each; none where they are straight.

    Raises:
        InputError: a midpoint is too far from the middle of its edge.
    """
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags.tolist(), points.reshape(-1, 3), strict=True))
    rows: list[Integers] = [np.empty((0, len(_ORDER[dimension])), dtype=np.int64)]
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
            if kind == _QUADRATIC[dimension]:
                rows.append(np.asarray(nodes, dtype=np.int64).reshape(-1, len(_ORDER[dimension])))
    nodes = np.concatenate(rows)[:, _ORDER[dimension]]
    found = np.array([[place[node] for node in facet] for facet in nodes.tolist()]).reshape(*nodes.shape, 3)
    if len(bad := second_order.turning_back(found)):
        names = ", ".join(map(str, nodes[bad[0]]))
        raise InputError(f"mesh file {path}: the boundary element of nodes {names} has a {second_order.TURNING_BACK}")
    if not second_order.is_curved(found):
        found = found[:0]
    return found, np.full(len(found), group, dtype=np.int32)
