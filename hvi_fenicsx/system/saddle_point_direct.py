"""A direct solve of a nearly incompressible body by a factorisation with its pressures as further unknowns."""

from __future__ import annotations

import weakref
from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..typing import Entities
from .factorisation import Factorisation, SaddlePointForm


class _Application:
    """The context of the PC, which refers to its owner weakly: nothing would free a circle via PETSc."""

    def __init__(self, owner: SaddlePointDirect) -> None:
        self._owner = weakref.ref(owner)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve y = J^-1 x."""
        owner = self._owner()
        assert owner is not None
        owner.apply(x, y)


class SaddlePointDirect:
    """The factorised saddle point, as a preconditioner of the system's matrix. Creation is collective.

    Args:
        form: of the system's matrix.
        options: defaults of the factorisation's options.

    Attributes:
        pc: the PC.
        matrix: the system's matrix, which it preconditions.
    """

    def __init__(self, form: SaddlePointForm, options: Mapping[str, object]) -> None:
        self._system = form.system
        self._factorisation = Factorisation(form, form.matrix(), options)
        self.pc, self.matrix = PETSc.PC().create(form.system.comm), form.system.jacobian.matrix
        self.pc.setType(PETSc.PC.Type.PYTHON)
        self.pc.setPythonContext(_Application(self))
        self.pc.setOperators(self.matrix)

    @property
    def factors(self) -> PETSc.PC:
        """The PC that holds the factors."""
        return self._factorisation.pc

    def prepare(self, held: Entities) -> None:
        """Take over the system's present tangent, hold these unknowns (local, owned, sorted). Collective."""
        self._factorisation.refresh()
        self._factorisation.factorise(np.union1d(held, self._system.pins))

    def apply(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve for y of the load x. Collective.

        Args:
            x: the load.
            y: where the displacement is written.
        """
        self._factorisation.apply(x, y)

    def free(self) -> None:
        """Free the PETSc objects (not named ``destroy``: petsc4py calls that with every PC of the context)."""
        self.pc.destroy()
        self._factorisation.free()
