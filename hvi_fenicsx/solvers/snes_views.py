"""The matrix and the preconditioner as PETSc's SNES VI sees them; both stay at full size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from ..system.held_solver import HeldPreconditioner
from ..typing import Entities


def unextracted(held: HeldPreconditioner) -> PETSc.Mat:
    """J for SNES VI: its inactive part is multiplied at full size instead of being copied."""
    sizes = held.system.jacobian.matrix.getSizes()
    matrix = PETSc.Mat().createPython(sizes, _FullMatrix(held), comm=held.system.comm)
    matrix.setUp()
    return matrix


class _FullMatrix:
    """PETSc's view of J, which is symmetric."""

    def __init__(self, held: HeldPreconditioner) -> None:
        self._held = held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x; a line search that fails needs it to test for a minimum of the residual's norm. Collective.

        Args:
            _: the matrix whose context this is.
            x: the vector.
            y: where the product is written.
        """
        self._held.system.jacobian.matrix.mult(x, y)

    multTranspose = mult

    def createSubMatrix(self, _: PETSc.Mat, rows: PETSc.IS, columns: PETSc.IS, into: PETSc.Mat | None) -> PETSc.Mat:
        """The rows and columns of the inactive dofs. Collective.

        Args:
            _: the matrix whose context this is.
            rows: the inactive dofs.
            columns: the same.
            into: not used.
        """
        self._held.select(rows)
        sizes = (rows.getLocalSize(), rows.getSize())
        matrix = PETSc.Mat().createPython((sizes, sizes), _InactiveMatrix(self._held), comm=rows.comm)
        matrix.setUp()
        return matrix


class _InactiveMatrix:
    """PETSc's view of J on the inactive dofs of a step."""

    def __init__(self, held: HeldPreconditioner) -> None:
        self._held = held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x. Collective.

        Args:
            _: the matrix whose context this is.
            x: the vector, on the inactive dofs.
            y: where the product is written.
        """
        self._held.multiply_reduced(x, y)


class ReducedPreconditioner:
    """PETSc's view of :class:`HeldPreconditioner` on the inactive dofs of a SNES VI step.

    Args:
        snes: the solver, which knows the inactive dofs.
        held: the preconditioner.
        accuracy: relative tolerance of a linear solve, by whether the active set has changed.
    """

    def __init__(self, snes: PETSc.SNES, held: HeldPreconditioner, accuracy: Callable[..., float]) -> None:
        self._snes, self._held, self._accuracy = snes, held, accuracy
        self._active: Entities | None = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the active dofs of this step and prepare for them."""
        start, end = self._held.system.load.owner_range
        active = np.ones(end - start, dtype=bool)
        active[self._snes.getVIInactiveSet().getIndices() - start] = False
        found = np.flatnonzero(active).astype(np.int32)
        moved = self._active is not None and not np.array_equal(found, self._active)
        moved = bool(self._held.system.comm.allreduce(moved))
        self._snes.getKSP().setTolerances(rtol=self._accuracy(moved=moved))
        self._active = found
        self._held.prepare(found)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the preconditioner, y = P^-1 x.

        Args:
            pc: the PC whose context this is.
            x: the vector, on the inactive dofs.
            y: where the result is written.
        """
        self._held.apply_reduced(x, y)
