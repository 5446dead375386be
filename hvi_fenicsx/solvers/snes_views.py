"""The matrix and the preconditioner as PETSc's SNES VI sees them; both stay at full size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from ..system.held_solver import Goal, HeldPreconditioner
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
        """The rows and columns of the inactive dofs, of which only the size is asked. Collective.

        Args:
            _: the matrix whose context this is.
            rows: the inactive dofs.
            columns: the same.
            into: not used.
        """
        sizes = (rows.getLocalSize(), rows.getSize())
        matrix = PETSc.Mat().createPython((sizes, sizes), self, comm=rows.comm)
        matrix.setUp()
        return matrix


class InactiveSolve:
    """The linear solve of a SNES VI step on its inactive dofs, as PETSc's KSP: :class:`HeldPreconditioner` solves it.

    Args:
        snes: the solver, which knows the inactive dofs.
        held: the preconditioner, by which equations are solved at full size.
        goal: how exact a step is to be, by whether the active set has changed.
    """

    def __init__(self, snes: PETSc.SNES, held: HeldPreconditioner, goal: Callable[..., Goal]) -> None:
        self._snes, self._held, self._goal = snes, held, goal
        self._active: Entities | None = None

    def solve(self, ksp: PETSc.KSP, load: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve J x = load on the inactive dofs. Collective.

        Args:
            ksp: the KSP whose context this is.
            load: the right-hand side, on the inactive dofs.
            x: where the solution is written.
        """
        inactive = self._snes.getVIInactiveSet()
        goal = self._goal(moved=self._prepare(inactive))
        iterations, reason = self._held.solve_reduced(inactive, load, x, goal)
        ksp.setIterationNumber(iterations)
        ksp.setConvergedReason(reason)

    def _prepare(self, inactive: PETSc.IS) -> bool:
        """Prepare for the active dofs of this step; whether others were active in the last one. Collective."""
        start, end = self._held.system.load.owner_range
        active = np.ones(end - start, dtype=bool)
        active[inactive.getIndices() - start] = False
        found = np.flatnonzero(active).astype(np.int32)
        moved = self._active is not None and not np.array_equal(found, self._active)
        self._active = found
        self._held.prepare(found)
        return bool(self._held.system.comm.allreduce(moved))
