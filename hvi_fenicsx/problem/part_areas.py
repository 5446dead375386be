"""Lengths and areas of boundary parts, lumped at their vertices."""

from __future__ import annotations

import dolfinx
import numpy as np
from dolfinx import fem, la

from ..mesh import nodes
from ..typing import Array, Entities
from . import spaces
from .problem import Problem


def vertices(problem: Problem, facets: Entities) -> Entities:
    """The vertices of facets that this rank owns, ascending. Collective.

    Args:
        problem: the problem.
        facets: local facets.
    """
    dofs = fem.locate_dofs_topological(problem.space, problem.domain.dimension - 1, facets)
    return np.unique(dofs[dofs < problem.space.dofmap.index_map.size_local])


def lumped(problem: Problem, facets: Entities) -> Array:
    """The lumped length (m) or area (m²) of facets at each vertex that this rank owns, (n,). Collective.

    Args:
        problem: the problem.
        facets: local facets.
    """
    mesh, d = problem.domain.mesh, problem.scales.dimension
    own = facets[facets < mesh.topology.index_map(d - 1).size_local]
    found = la.vector(problem.space.dofmap.index_map)
    if len(own):  # dolfinx divides by their number
        corners = mesh.geometry.x[dolfinx.mesh.entities_to_geometry(mesh, d - 1, own)]
        edges = corners[:, 1:] - corners[:, :1]
        sizes = np.linalg.norm(edges[:, 0] if d == 2 else np.cross(edges[:, 0], edges[:, 1]) / 2, axis=1)
        np.add.at(found.array, nodes.facet_nodes(problem.space, own), spaces.facet_weights(problem.space, sizes))
    found.scatter_reverse(la.InsertMode.add)
    return np.asarray(found.array[: problem.space.dofmap.index_map.size_local], dtype=np.float64)
