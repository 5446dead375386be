"""A direct solve of the system's matrix with unknowns held, in the form in which its factors are smallest."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc
from scipy.linalg import LinAlgWarning, block_diag, lu_factor, lu_solve

from ..runtime.mpi import agree
from ..typing import Array, Entities, Mask
from .factorisation import FactorForm, Factorisation
from .interior import Interior
from .petsc_options import applied_by, prefix
from .system import System


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


def is_worthwhile(system: System, affordable: float) -> bool:
    """Whether the factorisations so far have cost as much as condensing would: then it loses little, and may save much.

    It is not used where free motions are pinned inside the body, or with a preconditioner that the user chose.
    Collective.

    Args:
        system: the system to be condensed.
        affordable: unknowns of Γc whose condensation costs as much as the factorisations so far.
    """
    if system.free_motions is not None or PETSc.Options().hasName(f"{prefix()}pc_type"):
        return False
    return 0 < sum(agree(system.comm, len(system.jacobian.rows.dofs))) <= affordable


class SchurDirect:
    """The condensed body, as a preconditioner. Creation is collective.

    Args:
        form: of the matrix of the system, whose stiffness is condensed to the n unknowns of Γc.
        options: defaults of the factorisation's options.

    Attributes:
        pc: the PC.
        matrix: the system's matrix, which it preconditions.
    """

    def __init__(self, form: FactorForm, options: Mapping[str, object]) -> None:
        self._system = system = form.system
        self._interior = Interior(form, system.jacobian.rows.dofs, options, "")
        self._stiffness = self._interior.stiffness()
        self._lu: tuple[Array, Entities] | None = None
        self._free: Mask = np.ones(self._interior.size, dtype=bool)
        self.matrix = system.jacobian.matrix
        self.pc = applied_by(self, self.matrix)

    def prepare(self, held: Entities) -> None:
        """Take the present tangent, and hold these dofs; all that are not prescribed must be on Γc. Collective."""
        rows, comm = self._system.jacobian.rows, self._system.comm
        self._free = np.concatenate(agree(comm, ~np.isin(rows.dofs, held)))
        matrix = self._stiffness + block_diag(*np.concatenate(agree(comm, rows.tangent)))
        matrix[~self._free] = matrix[:, ~self._free] = 0.0
        matrix[~self._free, ~self._free] = 1.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LinAlgWarning)  # a body that nothing holds: the step is not finite
            self._lu = lu_factor(matrix, check_finite=False)

    def apply(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve y = J^-1 x, held dofs being decoupled with a diagonal of 1. Collective.

        Args:
            x: the right-hand side.
            y: where the solution is written.
        """
        interior = self._interior
        right = x.array_r[:, None]
        value = interior.gathered(x.array_r) - np.where(self._free, interior.pulled(interior.solve(right))[:, 0], 0.0)
        value = lu_solve(self._lu, value, check_finite=False)
        y.array[:] = interior.expand(np.where(self._free, value, 0.0), x.array_r)
        y.array[interior.kept] = interior.own_part(value)

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        self._interior.free()
