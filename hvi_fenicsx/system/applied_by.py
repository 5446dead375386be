"""A PC that an object of this program applies."""

from __future__ import annotations

import weakref
from typing import Protocol

from petsc4py import PETSc


class Solver(Protocol):
    """What solves a system."""

    def apply(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve the system. Collective.

        Args:
            x: the load.
            y: where the solution goes.
        """


class _Context:
    """The context of the PC, which refers to its owner weakly: nothing would free a circle via PETSc."""

    def __init__(self, owner: Solver) -> None:
        self._owner = weakref.ref(owner)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve for y of the load x."""
        owner = self._owner()
        assert owner is not None
        owner.apply(x, y)


def applied_by(owner: Solver, matrix: PETSc.Mat) -> PETSc.PC:
    """The PC. Collective.

    Args:
        owner: what applies it; it must not have a method ``destroy``, which petsc4py would call with every PC.
        matrix: what it preconditions.
    """
    pc = PETSc.PC().create(matrix.comm)
    pc.setOperators(matrix)
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(_Context(owner))
    return pc
