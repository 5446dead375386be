"""Algebraic multigrid for a copy of the matrix in which held unknowns have the rows and columns of the identity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..typing import Entities
from .petsc_options import default_options, prefix
from .system import System


class Algebraic:
    """A copy of the system's matrix with some unknowns held, and its preconditioner. Creation is collective.

    The levels depend on the values of the matrix: they are made anew with it.

    Args:
        system: the system; where motions are free, their pins are always held.
        options: defaults of the PC's options.

    Attributes:
        pc: the PC.
        matrix: the copy that it preconditions.
    """

    def __init__(self, system: System, options: Mapping[str, object]) -> None:
        self._system, self._options = system, options
        self.pc, self.matrix = self._new(), system.jacobian.matrix.copy()
        self.matrix.setBlockSize(system.problem.scales.dimension)
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.matrix.setOption(PETSc.Mat.Option.SPD, True)
        self.matrix.setNearNullSpace(system.near_null)

    def prepare(self, held: Entities) -> None:
        """Copy the system's present matrix, hold these unknowns (local, owned, sorted), set up the PC. Collective."""
        self._system.jacobian.matrix.copy(self.matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        rows = np.union1d(held, self._system.pins) + self._system.load.owner_range[0]
        self.matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        self.pc.destroy()
        self.pc = self._new()
        with default_options(self._options):
            self.pc.setOperators(self.matrix)
            self.pc.setFromOptions()
            self.pc.setUp()

    def _new(self) -> PETSc.PC:
        pc = PETSc.PC().create(self._system.comm)
        pc.setOptionsPrefix(prefix())
        return pc

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        self.matrix.destroy()
