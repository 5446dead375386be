"""Lengths and areas of boundary parts, lumped at their vertices."""

from __future__ import annotations

import numpy as np
from dolfinx import fem, la

from ..mesh import facets as facet_sizes
from ..mesh import nodes
from ..typing import Array, Entities
from . import facet_integrals, spaces
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
    own = facet_sizes.owned(problem.domain.mesh, facets)
    found = la.vector(problem.space.dofmap.index_map)
    if len(own):
        np.add.at(found.array, nodes.facet_nodes(problem.space, own), _weights(problem.space, own))
    found.scatter_reverse(la.InsertMode.add)
    return np.asarray(found.array[: problem.space.dofmap.index_map.size_local], dtype=np.float64)


def _weights(space: fem.FunctionSpace, facets: Entities) -> Array:
    """The integrals of the basis functions over facets, m or m², (f, nodes)."""
    if facet_integrals.is_curved(space):
        _, weights, functions = facet_integrals.samples(space, facets)
        return np.asarray(weights @ functions)
    return spaces.facet_weights(space, facet_sizes.areas(facet_sizes.corners(space.mesh, facets)))
