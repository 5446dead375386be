"""The condensed stiffness S that is never formed: products and inverses by sparse factorisations of the whole body.

With the body's stiffness A and the condensed unknowns c: S x = A_cc x - A_ci A_ii⁻¹ A_ic x, one solve with all of them
held. The equations of a cell are those of A with the slopes of the laws on its diagonal and the unknowns that stand
held: what a standing one feels is a row of A times the solution. So a cell is factorised as the whole body is. Columns
that are exchanged afterwards are kept beside the factors (the product form of the inverse). By Sylvester's law and
since A_ii is positive definite, A with slopes and held unknowns has as many negative pivots as S with them has
negative eigenvalues.
"""

from __future__ import annotations

from copy import copy
from functools import lru_cache

import numpy as np
from petsc4py import PETSc
from typing_extensions import override

from ..runtime.mpi import agree
from ..system.factorisation import Factorisation
from ..system.interior import Interior
from ..system.petsc_options import CHOLESKY
from ..typing import Array, Mask, magnitude
from .condensed_stiffness import CellColumns, CellInverse, CondensedStiffness

_KNOWN = 8
"""So many products are remembered: events ask for the same ones again."""


class FactorisedStiffness(CondensedStiffness):
    """S by factorisations.

    Args:
        interior: the body with the condensed unknowns held; else nothing is held in its system, without laws' tangents.
    """

    def __init__(self, interior: Interior) -> None:
        self._interior, self._form, self._own = interior, interior.form.suiting(_PREFIX), interior.own()
        self._system = self._form.system
        self._matrix, self._stiffness = self._form.matrix(), self._system.jacobian.matrix.copy()
        self._diagonal = self._everywhere(self._own[:, interior.here].diagonal())
        sums = np.abs(self._own).sum(axis=1).ravel()
        self._size = float(np.max(self._everywhere(sums), initial=0.0))
        self._add(0.0)

    def _add(self, added: float) -> None:
        """Let so much be added to the diagonal; nothing is known of this one yet."""
        self._added = added
        self.__dict__.pop("rigid", None)
        self._products = lru_cache(_KNOWN)(self._product)
        self._counts = lru_cache(_KNOWN)(self._counted)

    def _everywhere(self, own: Array) -> Array:
        return np.concatenate(agree(self._system.comm, own))

    @property
    @override
    def array(self) -> Array:
        return self._interior.stiffness() + self._added * np.eye(self._interior.size)

    @property
    @override
    def diagonal(self) -> Array:
        return self._diagonal + self._added

    @override
    def __matmul__(self, x: Array) -> Array:
        return self._products(x.tobytes()).copy()

    def _product(self, of: bytes) -> Array:
        x = np.frombuffer(of)
        inner = self._interior.solve((self._interior.coupling @ x)[:, None])
        elastic = self._everywhere(self._own @ x) - self._interior.pulled(inner)[:, 0]
        return elastic + self._added * x

    @override
    def column(self, i: int) -> Array:
        return self @ np.eye(1, self._interior.size, i)[0]

    @override
    def raised(self, by: float) -> CondensedStiffness:
        found = copy(self)  # the matrices are shared, none of them changes
        found._add(self._added + by)
        return found

    @override
    def inverse(self, columns: CellColumns) -> CellInverse:
        moving, driver = columns.moving.copy(), columns.driver
        signs, singular = np.where(moving, 1.0, columns.rise), np.linalg.LinAlgError("the tangent is singular")
        if driver is not None:  # the unknown in whose place is the factor stands
            moving[driver], signs[driver] = False, 1.0
        cell = self.factorised(moving, columns.slope)
        if cell.factors.is_singular:
            raise singular
        found = CellInverse(lambda right: signs * cell.solve(right), self._system.thresholds.columns)
        if driver is not None:
            values = found.solve(columns.factor)
            if not values[driver] or not np.all(np.isfinite(values)):
                raise singular
            found.exchange(values, driver)
        return found

    @override
    def negative_directions(self, moving: Mask, slope: Array, negligible: float) -> int:
        steepest = magnitude(slope[moving])
        shift = negligible * (self._size + self._added + steepest)
        return self._counts(moving.tobytes(), np.where(moving, slope + shift, 0.0).tobytes())

    def _counted(self, moving: bytes, slope: bytes) -> int:
        cell = self.factorised(np.frombuffer(moving, dtype=bool), np.frombuffer(slope))
        count = cell.factors.negative
        cell.free()
        return count

    def factorised(self, moving: Mask, slope: Array) -> FactorisedCell:
        """A with slopes, and the unknowns that stand held. Collective.

        Args:
            moving: the unknowns that move, (n,).
            slope: of the laws' forces, (n,).

        Raises:
            numpy.linalg.LinAlgError: it is singular.
        """
        here = self._interior.here
        factors = Factorisation(self._form, self._matrix.copy(), _INDEFINITE, _PREFIX)
        slope = slope[here] + self._added
        return FactorisedCell(self._interior, self._stiffness, factors, moving[here], slope)

    @override
    def free(self) -> None:
        self._matrix.destroy()
        self._stiffness.destroy()


class FactorisedCell:
    """The stiffness of the whole body in one cell, factorised. Creation is collective.

    Args:
        interior: which unknowns are condensed.
        stiffness: A.
        factors: of a copy of it, to be made.
        moving: those of them that move, this rank's.
        slope: of the laws' forces, this rank's.

    Attributes:
        factors: as made.

    Raises:
        numpy.linalg.LinAlgError: it is singular.
    """

    def __init__(
        self, interior: Interior, stiffness: PETSc.Mat, factors: Factorisation, moving: Mask, slope: Array
    ) -> None:
        self._interior, self._stiffness, self._moving, system = interior, stiffness, moving, interior.form.system
        PETSc.garbage_cleanup(system.comm)  # on several ranks factors that nothing refers to are freed together
        factors.allow_negative()
        factors.add(interior.kept, np.where(moving, slope, 0.0))
        factors.factorise(np.union1d(interior.kept[~moving], system.pins))
        self.factors = factors
        self._load, self._found, self._force = (system.load.duplicate() for _ in range(3))
        if factors.failure:
            self.free()
            raise np.linalg.LinAlgError("the tangent is singular")

    def solve(self, right: Array) -> Array:
        """Displacements of what moves, forces on what stands, (n,). Collective.

        Args:
            right: of the equations, (n,).
        """
        interior, moving = self._interior, self._moving
        kept, own = interior.kept, right[interior.here]
        self._load.set(0.0)
        self._load.array[kept] = np.where(moving, own, 0.0)
        self.factors.apply(self._load, self._found)
        self._stiffness.mult(self._found, self._force)
        felt = own - self._force.array_r[kept]
        return np.concatenate(agree(interior.form.system.comm, np.where(moving, self._found.array_r[kept], felt)))

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self.factors.free()
        for vector in (self._load, self._found, self._force):
            vector.destroy()


_PREFIX = "cell_"
_INDEFINITE = {**CHOLESKY, "mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1}
"""Options of the factorisation: the pivots of the last block are counted too, and those that are zero are found."""
