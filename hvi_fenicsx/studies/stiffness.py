"""The stiffness of a solved point, which measures the error of a displacement in the energy norm."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI
from scipy import sparse

from ..solution import Solution


def stiffness(solution: Solution) -> sparse.csr_array | None:
    """The matrix of a(u, v), nondimensional, on rank 0; None elsewhere. Collective.

    Its unknowns are numbered as the vertices in ``solution.npz``, component by component. Its energy norm does not feel
    rigid motions.
    """
    problem = solution.problem
    matrix = problem.bulk.matrix()
    starts, columns, values = matrix.getValuesCSR()
    size = matrix.getSize()[0]
    matrix.destroy()
    comm = problem.space.mesh.comm
    counts, columns, values = (_joined(comm, a) for a in (np.diff(starts), columns, values))
    return None if comm.rank else sparse.csr_array((values, columns, np.append(0, np.cumsum(counts))), (size, size))


def _joined(comm: MPI.Comm, values: npt.NDArray[Any]) -> Any:
    """What all ranks have, one after the other, on rank 0; elsewhere their own. Collective."""
    pieces = comm.gather(np.ascontiguousarray(values), root=0)
    return values if pieces is None else np.concatenate(pieces)
