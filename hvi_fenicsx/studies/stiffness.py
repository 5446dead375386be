"""The stiffness of a solved point, which measures the error of a displacement in the energy norm."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from scipy import sparse

from ..mesh import nodes
from ..problem import spaces
from ..runtime.mpi import joined
from ..typing import Integers
from ..workflow import Solution


def stiffness(solution: Solution) -> sparse.csr_array | None:
    """The matrix of a(u, v), nondimensional, on rank 0; None elsewhere. Collective.

    Its unknowns are the displacements at the nodes in the order of ``solution.npz``, component by component. Its energy
    norm does not feel rigid motions.
    """
    problem = solution.problem
    ends = _edge_ends(problem.space)
    matrix = problem.bulk.matrix()
    starts, columns, values = matrix.getValuesCSR()
    size = matrix.getSize()[0]
    matrix.destroy()
    comm = problem.space.mesh.comm
    counts, columns, values = (joined(comm, a) for a in (np.diff(starts), columns, values))
    if comm.rank:
        return None
    found = sparse.csr_array((values, columns, np.append(0, np.cumsum(counts))), (size, size))
    share = spaces.edge_share(problem.space)
    return found if share == 0.0 else _of_values(found, ends, share)


def _edge_ends(space: fem.FunctionSpace) -> Integers:
    """The vertices whose middle each node is, (n, 2), right on rank 0. Collective."""
    index_map = space.dofmap.index_map
    own = nodes.edge_ends(space)[: index_map.size_local]
    numbers = index_map.local_to_global(np.ascontiguousarray(own.ravel()))
    found: Integers = joined(space.mesh.comm, np.asarray(numbers, dtype=np.int64).reshape(own.shape))
    return found


def _of_values(matrix: sparse.csr_array, ends: Integers, share: float) -> sparse.csr_array:
    """The matrix for values at the nodes, from that for coefficients.

    Args:
        matrix: for coefficients.
        ends: the vertices whose middle each node is, (n, 2).
        share: of an edge's function that goes to each of its ends (:func:`.spaces.edge_share`).
    """
    count = len(ends)
    middle = np.flatnonzero(ends[:, 0] != ends[:, 1])
    own = np.ones(count)
    own[middle] = 1 / (1 - 2 * share)
    others = np.full(2 * len(middle), -share / (1 - 2 * share))
    rows = np.concatenate([np.arange(count), np.repeat(middle, 2)])
    columns = np.concatenate([np.arange(count), ends[middle].ravel()])
    coefficients = sparse.coo_array((np.concatenate([own, others]), (rows, columns)), shape=(count, count))
    change = sparse.csr_array(sparse.kron(coefficients, sparse.eye_array(matrix.shape[0] // count)))
    return sparse.csr_array(change.T @ matrix @ change)
