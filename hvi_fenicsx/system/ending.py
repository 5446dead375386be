"""A preconditioner that ends the method of conjugate gradients as soon as its residual is small enough.

PETSc's convergence tests get a norm of the residual; the residual itself they could only compute anew, by a further
product. But at each iteration the method gives it to the preconditioner, and it ends where it gets zero back.
"""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from ..typing import Array


class _Ending:
    """The context of the PC.

    Attributes:
        ended: whether it has ended the method.
    """

    def __init__(self, reached: Callable[[Array], bool], inner: PETSc.PC) -> None:
        self._reached, self._inner, self._begun = reached, inner, False
        self.ended = False

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the inner preconditioner to the residual x, or write zero into y. Collective."""
        self.ended = self._begun and self._reached(x.array_r)
        if self.ended:
            y.set(0.0)
        else:
            self._inner.apply(x, y)
        self._begun = True


def ending_at(reached: Callable[[Array], bool], inner: PETSc.PC) -> PETSc.PC:
    """The PC, for one solve from zero. Collective.

    Args:
        reached: whether a residual (n,) is small enough; the first one, of zero, never is. Collective.
        inner: what preconditions.
    """
    pc = PETSc.PC().create(inner.comm)
    pc.setOperators(*inner.getOperators())
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(_Ending(reached, inner))
    return pc


def iterations(ksp: PETSc.KSP) -> int:
    """Iterations of a finished solve; PETSc counts one more where this ended it."""
    pc = ksp.getPC()
    context = pc.getPythonContext() if pc.getType() == PETSc.PC.Type.PYTHON else None  # PETSc crashes of other types
    return int(ksp.getIterationNumber()) - (isinstance(context, _Ending) and context.ended)
