"""The vertices of a mesh as the (block) dofs of a P1 space on it."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from .. import compat
from ..typing import Array, Entities


def dof_of_node(space: fem.FunctionSpace) -> Entities:
    """The (block) dof at each geometry node of a P1 space on simplices, (nodes,)."""
    nodes, dofs = _by_cell(space)
    result = np.zeros(space.mesh.geometry.x.shape[0], dtype=np.int32)
    result[nodes] = dofs
    return result


def points(space: fem.FunctionSpace) -> Array:
    """The local vertices (owned and ghost) of a P1 space on simplices, m, (n, 3).

    They are the nodes of the geometry; ``tabulate_dof_coordinates`` maps each from each of its cells, four times as
    slowly.
    """
    nodes, dofs = _by_cell(space)
    index_map = space.dofmap.index_map
    node = np.zeros(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    node[dofs] = nodes
    return np.asarray(space.mesh.geometry.x[node], dtype=np.float64)


def _by_cell(space: fem.FunctionSpace) -> tuple[Entities, Entities]:
    """Geometry nodes and dofs of each local cell (owned and ghost)."""
    cells = space.mesh.topology.index_map(space.mesh.topology.dim)
    count = cells.size_local + cells.num_ghosts
    return compat.geometry_dofmap(space.mesh)[:count], space.dofmap.list[:count]
