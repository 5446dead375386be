"""The first mesh of an adaptive run: coarse, but fine enough on the boundary to see the data there.

What no mesh of the run has seen no estimate is sure of: a gap is first of all known at vertices.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from ..certify.estimate import boundary_data, bubbles
from ..certify.estimate.thresholds import DEFAULT as SAMPLING
from ..mesh import nodes
from ..problem.problem import Problem
from ..runtime.mpi import total
from ..typing import Array, Entities
from .thresholds import CONTROL, ControlThresholds


def unresolved(problem: Problem, thresholds: ControlThresholds = CONTROL) -> Entities:
    """The owned cells at whose facets data vary otherwise than linearly, while on the part they do so. Collective.

    A load that jumps at one place does so within one facet of any mesh: it is the part as a whole that decides.

    Args:
        problem: the data and the mesh.
        thresholds: which deviation is too much.
    """
    space = bubbles.space(problem.space.mesh, nodes.degree(problem.space))
    found: list[Entities] = [np.empty(0, dtype=np.int32)]
    for facets, value in boundary_data.everything(problem):
        at = boundary_data.sample(problem, space, facets, SAMPLING)
        squares, area = at.beyond_nodes(value) ** 2 @ at.weights, at.facets.areas
        allowed = _allowed(problem.domain.mesh.comm, at.of(value), thresholds) ** 2
        whole, deviation = (total(problem.domain.mesh.comm, float(np.sum(x))) for x in (area, area * squares))
        if deviation > allowed * whole:
            found.append(at.facets.cells[squares > allowed])
    return np.unique(np.concatenate(found)).astype(np.int32)


def _allowed(comm: MPI.Comm, values: Array, thresholds: ControlThresholds) -> float:
    """The root mean square deviation that sampled values of a part may have. Collective."""
    low = comm.allreduce(float(np.min(values, initial=np.inf)), op=MPI.MIN)
    high = comm.allreduce(float(np.max(values, initial=-np.inf)), op=MPI.MAX)
    return max(thresholds.unresolved * (high - low), thresholds.rounding * max(abs(low), abs(high)))
