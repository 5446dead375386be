"""A Krylov method on the unknowns that are not held, at full size: zero stays zero at the others.

PETSc's convergence tests get a norm of the residual; the residual itself they could only compute anew, by a further
product. But the method of conjugate gradients gives it to the preconditioner at each iteration, and ends where it gets
zero back.
"""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from ..typing import Array, Entities

Reached = Callable[[Array], bool]
"""Whether a residual (n,) is small enough; collective."""


class _Matrix:
    """The context of the matrix."""

    def __init__(self, whole: PETSc.Mat, held: Entities) -> None:
        self._whole, self._held = whole, held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x. Collective."""
        self._whole.mult(x, y)
        y.array[self._held] = 0.0


class _Preconditioner:
    """The context of the PC.

    Attributes:
        ended: whether it has ended the method.
    """

    def __init__(self, inner: PETSc.PC, held: Entities, reached: Reached | None) -> None:
        self._inner, self._held, self._reached, self._begun = inner, held, reached, False
        self.ended = False

    def apply(self, _: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the inner preconditioner to the residual x, or write zero into y. Collective."""
        self.ended = self._begun and self._reached is not None and self._reached(x.array_r)
        self._begun = True
        if self.ended:
            y.set(0.0)
            return
        self._inner.apply(x, y)
        y.array[self._held] = 0.0

    def view(self, _: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Show the inner preconditioner."""
        self._inner.view(viewer)


def set_up(ksp: PETSc.KSP, whole: PETSc.Mat, inner: PETSc.PC, held: Entities, reached: Reached | None) -> None:
    """Give a method its matrix and preconditioner, for one solve from zero. Collective.

    Args:
        ksp: the method.
        whole: J.
        inner: a preconditioner of it; one of a J with other held unknowns and another tangent will do.
        held: the unknowns that are held (local, owned).
        reached: ends the method of conjugate gradients; the first residual never does. None: only its own tests do.
    """
    matrix = PETSc.Mat().createPython(whole.getSizes(), _Matrix(whole, held), comm=whole.comm)
    matrix.setUp()
    pc = PETSc.PC().create(whole.comm)
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(_Preconditioner(inner, held, reached))
    ksp.setPC(pc)
    ksp.setOperators(matrix)


def iterations(ksp: PETSc.KSP) -> int:
    """Iterations of a finished solve; PETSc counts one more where the preconditioner ended it."""
    pc = ksp.getPC()
    context = pc.getPythonContext() if pc.getType() == PETSc.PC.Type.PYTHON else None  # PETSc crashes of other types
    return int(ksp.getIterationNumber()) - (isinstance(context, _Preconditioner) and context.ended)
