"""A direct solve of the system's matrix with unknowns held, in the form in which its factors are smallest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..typing import Entities
from .applied_by import applied_by
from .factorisation import FactorForm, Factorisation


class Direct:
    """The factorised matrix, as a preconditioner. Creation is collective.

    Args:
        form: of the system's matrix; where motions are free, their pins are always held.
        options: defaults of the factorisation's options.

    Attributes:
        matrix: what it preconditions: the matrix that is factorised, or the system's where that has pressures too.
        factors: the PC that holds the factors.
        pc: the PC.
    """

    def __init__(self, form: FactorForm, options: Mapping[str, object]) -> None:
        self._system, matrix = form.system, form.matrix()
        self._factorisation = Factorisation(form, matrix, options)
        self._factorisation.allow_negative()
        self.factors = self._factorisation.pc
        self.matrix = form.system.jacobian.matrix if form.has_pressures else matrix
        self.pc = applied_by(self, self.matrix) if form.has_pressures else self.factors

    def prepare(self, held: Entities) -> None:
        """Take over the system's present matrix, hold these unknowns (local, owned, sorted), factorise. Collective."""
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
        """Free the PETSc objects."""
        self.pc.destroy()
        self._factorisation.free()
