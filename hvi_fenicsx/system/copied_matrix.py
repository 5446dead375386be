"""Preconditioners of a copy of the matrix, in which held unknowns have the rows and columns of the identity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..typing import Entities
from .petsc_options import PREFIX, below_the_users
from .system import System


class CopiedMatrix:
    """A PC of the system's matrix with some unknowns held, and its copy. Creation is collective.

    Args:
        system: whose matrix it is; where motions are free, their pins are held in any case.
        options: of the PC, below the user's own.
        direct: whether it factorises. Factors and the order of elimination then serve again; algebraic multigrid, whose
            levels follow the values, is made anew.

    Attributes:
        pc: the PC.
        matrix: the copy that it preconditions.
    """

    def __init__(self, system: System, options: Mapping[str, object], *, direct: bool) -> None:
        self._system, self._options, self._direct = system, options, direct
        self.pc, self.matrix = self._new(), system.jacobian.matrix.copy()
        self.matrix.setBlockSize(system.problem.scales.dimension)
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.matrix.setOption(PETSc.Mat.Option.SPD, not direct)
        if not direct:
            self.matrix.setNearNullSpace(system.near_null)

    def prepare(self, held: Entities) -> None:
        """Make it that of the matrix as it stands with these unknowns (local, owned, sorted) held. Collective."""
        self._system.jacobian.matrix.copy(self.matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        rows = np.union1d(held, self._system.pins) + self._system.load.owner_range[0]
        self.matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        if not self._direct:
            self.pc.destroy()
            self.pc = self._new()
        with below_the_users(self._options):
            self.pc.setOperators(self.matrix)
            self.pc.setFromOptions()
            self.pc.setUp()

    def _new(self) -> PETSc.PC:
        pc = PETSc.PC().create(self._system.comm)
        pc.setOptionsPrefix(PREFIX)
        return pc

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        self.matrix.destroy()
