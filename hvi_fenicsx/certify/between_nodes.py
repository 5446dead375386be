"""How far a displacement of degree 2 goes beyond its bounds between the nodes, where nothing bounds it.

A linear function between nodes within their bounds is within them too; a quadratic one may dip. What is measured is
that of the function which interpolates u·n and the bounds at the nodes; it is exact where a part is flat and its gap
at most quadratic.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la

from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..runtime.mpi import largest
from ..typing import Array
from .contact_state import ContactState

_STEPS = 12
"""Steps of the lattice of points on a facet's edges."""


def largest_penetration(problem: Problem, states: Sequence[ContactState]) -> float | None:
    """The largest penetration anywhere on Γc, nondimensional, at least 0; None at degree 1. Collective.

    Args:
        problem: what was solved.
        states: of its parts.
    """
    if nodes.degree(problem.space) == 1:
        return None
    found = 0.0
    for state in states:
        if state.bounds is not None:
            for beyond in (state.normal - state.bounds.upper, state.bounds.lower - state.normal):
                found = max(found, _largest(problem, state, beyond))
    return largest(problem.domain.mesh.comm, found)


def _largest(problem: Problem, state: ContactState, beyond: Array) -> float:
    """The largest value on this rank's facets of a function with coefficients at a part's nodes, (m,). Collective."""
    everywhere = la.vector(problem.space.dofmap.index_map)
    everywhere.array[:] = -np.inf
    everywhere.array[state.surface.blocks] = beyond
    everywhere.scatter_forward()
    local = everywhere.array[nodes.facet_nodes(problem.space, state.surface.facets)]
    local = local[np.all(np.isfinite(local), axis=1)]
    return float(np.max(local @ _functions(problem.space), initial=0.0))


def _functions(space: fem.FunctionSpace) -> Array:
    """The basis functions of a facet on a lattice of points, (nodes, points)."""
    steps = itertools.product(range(_STEPS + 1), repeat=space.mesh.geometry.dim)
    lattice = np.array([step for step in steps if sum(step) == _STEPS]) / _STEPS
    return spaces.simplex_functions(nodes.degree(space), lattice, spaces.edge_share(space)).T
