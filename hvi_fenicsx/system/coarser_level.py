"""The next coarser rung of a ladder, and how it takes part in the multigrid of the finer one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..typing import Array

if TYPE_CHECKING:
    from .system import System

_MOVES = 0.2
"""Weight by which an unknown moves another, at least: of those that move a vertex, one in space has 1/4 or more."""


class Below:
    """A coarser rung under a finer one.

    Attributes:
        system: the rung. prolongation: from its unknowns to the finer one's.
    """

    def __init__(self, system: System, prolongation: PETSc.Mat) -> None:
        self.system, self.prolongation = system, prolongation
        self._cut: _Cut | None = None

    def cut(self, finer: System) -> PETSc.Mat:
        """The prolongation without what is prescribed on either rung. Collective."""
        return self._made(finer).matrix

    def follow(self, finer: System) -> None:
        """Make the rung take the finer one's tangent and hold what that holds. Collective.

        W K is restricted and lumped. An unknown is held where it moves something held (Hackbusch and Mittelmann 1983),
        so that J stays the finer one's Galerkin product and the body as well supported. On a curved part the tangent
        of one vertex has a little of its neighbour's normal: held for that, it would keep the coarse body from sliding.
        """
        cut, at = self._made(finer), self.system.rows.dofs
        tangent = np.empty_like(self.system.rows.tangent)
        for column in range(tangent.shape[1]):
            moved = cut.restricted(finer.rows.tangent[:, :, column].ravel())
            tangent[:, :, column] = moved[at].reshape(tangent.shape[:2])
        moves = np.abs(cut.restricted(np.isin(finer.rows.dofs, finer.held))[at])
        self.system.take(tangent, at[moves > _MOVES].astype(np.int32))

    def _made(self, finer: System) -> _Cut:
        if self._cut is None:
            self._cut = _Cut(self, finer)
        return self._cut


class _Cut:
    """A prolongation (``matrix``) in which what is prescribed has no part, and its rows of Γc. Creation is collective.

    What is held keeps its part in it: a diagonal of 1e20 times an elastic one leaves it where it is on every rung.
    """

    def __init__(self, below: Below, finer: System) -> None:
        self.matrix = below.prolongation.copy()
        self.matrix.diagonalScale(_unprescribed(finer), _unprescribed(below.system))
        rows = (finer.rows.dofs + finer.load.owner_range[0]).astype(PETSc.IntType)
        self._traces = self.matrix.createSubMatrix(PETSc.IS().createGeneral(rows, comm=finer.comm), None)
        self._on, self._off = self._traces.createVecLeft(), self._traces.createVecRight()

    def restricted(self, values: npt.NDArray[Any]) -> Array:
        """Values at the finer rung's unknowns of Γc, restricted to the coarse rung's unknowns. Collective."""
        self._on.array[:] = values
        self._traces.multTranspose(self._on, self._off)
        return np.asarray(self._off.array_r)


def _unprescribed(system: System) -> PETSc.Vec:
    """1 for the unknowns that are not prescribed, else 0."""
    mask = system.load.duplicate()
    mask.set(1.0)
    mask.array[system.problem.fixed_here] = 0.0
    return mask
