"""The elastic forces that supports, contact and laws take up, without a product with the whole matrix."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ..problem.problem import Problem
from ..typing import Array
from .contact_rows import ContactRows


class HoldingForces:
    """The rows of the elastic operator at prescribed unknowns, kept before they become those of the identity.

    Creation is collective.

    Args:
        problem: the problem.
        stiffness: its matrix without conditions.
    """

    def __init__(self, problem: Problem, stiffness: PETSc.Mat) -> None:
        start = stiffness.getOwnershipRange()[0]
        self._fixed = problem.fixed_here
        rows = PETSc.IS().createGeneral((self._fixed + start).astype(PETSc.IntType), comm=stiffness.comm)
        self._rows = stiffness.createSubMatrix(rows, None)
        self._product = self._rows.createVecLeft()

    def at(self, x: PETSc.Vec, rotation: PETSc.Mat | None, rows: ContactRows, lift: Array) -> Array:
        """The forces by owned unknown, zero where nothing holds the body, (n,). Collective.

        Args:
            x: the unknowns, perhaps without their rigid part.
            rotation: Q with u = Q x; None where both are the same.
            rows: those of the vertices of Γc, with the prescribed columns left out.
            lift: what these columns add there.
        """
        found = np.zeros(x.local_size)
        found[rows.dofs] = rows.elastic(x) + lift
        found[self._fixed] = self.at_prescribed(x, rotation)
        return found

    def at_prescribed(self, x: PETSc.Vec, rotation: PETSc.Mat | None) -> Array:
        """The elastic forces at the prescribed unknowns of this rank. Collective.

        Args:
            x: the unknowns.
            rotation: Q with u = Q x; None where both are the same.
        """
        cartesian = x if rotation is None else rotation * x
        self._rows.mult(cartesian, self._product)
        if cartesian is not x:
            cartesian.destroy()
        return np.array(self._product.array_r)

    def pull(self, prescribed: PETSc.Vec) -> PETSc.Vec:
        """The elastic forces of prescribed displacements on a body that is undisplaced elsewhere. Collective.

        Args:
            prescribed: Cartesian, zero where nothing is prescribed.
        """
        values, found = self._product.duplicate(), prescribed.duplicate()
        values.array[:] = prescribed.array_r[self._fixed]
        self._rows.multTranspose(values, found)
        values.destroy()
        return found

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self._rows.destroy()
        self._product.destroy()
