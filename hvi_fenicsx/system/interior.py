"""The body with unknowns of Γc held, factorised once: what condenses it to these unknowns, and expands it again.

With A = [[A_kk, A_ki], [A_ik, A_ii]], k the kept unknowns, the Schur complement is S = A_kk - A_ki A_ii⁻¹ A_ik and the
condensed load f = b_k - A_ki A_ii⁻¹ b_i. Its arrays are the same on all ranks.

Where averaged pressures are unknowns too (:mod:`.factorisation`), they belong to i: S is then no difference of large
volumetric stiffnesses. "Inner" rows are this rank's unknowns, followed by its pressures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array, vstack

from ..errors import Interrupted, SolverError
from ..runtime.mpi import agree, largest
from ..typing import Array, Integers, magnitude
from .factorisation import FactorForm, Factorisation
from .petsc_options import CHOLESKY

_NO_MEMORY = PETSc.PC.FailedReason.FACTOR_OUTMEMORY
PREFIX = "condensed_"
"""The prefix of options of factorisations that condense a body."""


class Interior:
    """A_ii, factorised. Creation is collective.

    Args:
        form: of the system's matrix; where motions are free, their pins are held too.
        kept: unknowns of Γc (local, owned, sorted) that are kept.
        options: defaults of the factorisation's options.
        own_prefix: of the options by which the user changes them, after that of all options.

    Attributes:
        form: of the system's matrix.
        kept: the unknowns of this rank that are kept.
        factors: of A_ii; rows and columns of kept and pinned unknowns are those of the identity.
        coupling: the inner rows of A_ik, zero in the kept rows, (inner, n).

    Raises:
        SolverError: A_ii is singular.
    """

    def __init__(
        self,
        form: FactorForm,
        kept: Integers,
        options: Mapping[str, object] = CHOLESKY,
        own_prefix: str = PREFIX,
    ) -> None:
        self.form, self.kept, self._system = form, kept, form.system
        self._comm, self._held = self._system.comm, np.union1d(kept, self._system.pins)
        start = self._system.load.owner_range[0]
        self._everywhere = np.concatenate(agree(self._comm, kept + start)).astype(np.int64)
        self.factors = Factorisation(form, form.matrix(), options, own_prefix)
        self.coupling = self._coupled()
        self.factors.factorise(self._held)
        if reason := self.factors.failure:
            self.free()
            why = "no memory was left" if reason == _NO_MEMORY else "it is singular, a body is not held"
            raise SolverError(f"the stiffness without the displacements of Γc was not factorised: {why}")

    @property
    def size(self) -> int:
        """Number n of kept unknowns, over all ranks."""
        return len(self._everywhere)

    @cached_property
    def here(self) -> slice:
        """The numbers of this rank's kept unknowns among those of all ranks. Collective, at first."""
        first = sum(agree(self._comm, len(self.kept))[: self._comm.rank])
        return slice(first, first + len(self.kept))

    def _columns(self, matrix: PETSc.Mat) -> csr_array:
        """The columns of kept unknowns in a matrix, this rank's rows, (rows, n)."""
        rows, total = matrix.getLocalSize()[0], matrix.getSize()[1]
        return csr_array(matrix.getValuesCSR()[::-1], shape=(rows, total))[:, self._everywhere]

    def _coupled(self) -> csr_array:
        found = csr_array(vstack([self._columns(block) for block in self.form.columns]))
        inner = np.ones(found.shape[0])
        inner[self._held] = 0.0
        return csr_array(found.multiply(inner[:, None]))

    def solve(self, right: Array) -> Array:
        """A_ii⁻¹ times columns, zero at kept unknowns, (inner, k). Collective.

        Args:
            right: right-hand sides, (inner, k); or without those of pressures, which are zero, (local unknowns, k).
        """
        columns = self._inner(right)
        columns[self._held] = 0.0
        return self.factors.columns(columns)

    def _inner(self, right: Array) -> Array:
        """A copy with rows of pressures."""
        found = np.zeros((self._system.load.local_size + self.form.pressures, *right.shape[1:]))
        found[: len(right)] = right
        return found

    def own(self) -> csr_array:
        """This rank's rows of A_kk, (kept unknowns here, n)."""
        rows = self.form.contact_rows
        return csr_array(self._columns(rows.bulk)[np.searchsorted(rows.dofs, self.kept)])

    def stiffness(self, interrupted: Callable[[], bool] = lambda: False) -> Array:
        """The Schur complement S, (n, n). Collective.

        Args:
            interrupted: whether to stop (collective), asked every few columns.

        Raises:
            Interrupted: on all ranks alike: it is to stop.
        """
        found, columns = np.zeros((self.size, self.size)), self.coupling.tocsc()
        at_once = self._system.thresholds.columns
        found[self.here] = self.own().toarray()
        for start in range(0, self.size, at_once):
            if interrupted():
                raise Interrupted
            block = slice(start, start + at_once)
            found[:, block] -= self.coupling.T @ self.solve(columns[:, block].toarray())
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return 0.5 * (found + found.T)

    def is_held(self) -> bool:
        """Whether the kept unknowns hold the body, other than by rounding (inverse iteration). Collective."""
        size = largest(self._comm, magnitude(self._system.jacobian.matrix.getDiagonal().array_r))
        load = np.cos(np.arange(self._system.load.local_size) + 1.0)[:, None]
        for _ in range(2):
            load = self.solve(load)[: len(load)]
            growth = largest(self._comm, magnitude(load)) * size
            load *= size / (growth or 1.0)
        return bool(growth * self._system.thresholds.rounding < 1.0)

    def gathered(self, values: Array) -> Array:
        """The values at all kept unknowns of this rank's values at its unknowns. Collective.

        Args:
            values: (local unknowns, ...).
        """
        return np.concatenate(agree(self._comm, values[self.kept]))

    def pulled(self, inner: Array) -> Array:
        """A_ki times displacements of the body inside, (n, k). Collective.

        Args:
            inner: as :meth:`solve` returns it, (inner, k).
        """
        return self._comm.allreduce(self.coupling.T @ inner)

    def loads(self, right: Array) -> Array:
        """The condensed loads b_k - A_ki A_ii⁻¹ b_i, (n, k). Collective.

        Args:
            right: loads b of the whole body, this rank's, (local unknowns, k).
        """
        return self.gathered(right) - self.pulled(self.solve(right))

    def expand(self, values: Array, right: Array) -> Array:
        """The displacement in equilibrium with given ones of Γc, this rank's unknowns, (local unknowns,). Collective.

        Args:
            values: of all kept unknowns, (n,).
            right: the load, this rank's, (local unknowns,).
        """
        found = self.solve((self._inner(right) - self.coupling @ values)[:, None])[: len(right), 0]
        found[self.kept] = values[self.here]
        return found

    def free(self) -> None:
        """Free the factors; the form stays. Collective."""
        self.factors.free()
