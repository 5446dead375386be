"""A system's matrix, and its rows of Γc: the only ones that laws, active sets and branches change.

J = A + W K + H. A is the bulk stiffness. W K is block-diagonal, the laws' tangents times lumped areas: ∫ (K du)·v ds by
vertex quadrature. H holds unknowns: its diagonal is so large that a solve leaves them as they are. W K and H are zero
outside of the diagonal blocks of Γc's vertices, so a new tangent or active set rewrites these blocks and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, magnitude, together
from .thresholds import DEFAULT


def rows_of(matrix: PETSc.Mat, dofs: npt.NDArray[np.integer]) -> PETSc.Mat:
    """Some rows of a matrix. Collective.

    Args:
        matrix: the matrix.
        dofs: local numbers of rows that this rank owns.
    """
    rows = (dofs + matrix.getOwnershipRange()[0]).astype(PETSc.IntType)
    return matrix.createSubMatrix(PETSc.IS().createGeneral(rows, comm=matrix.comm), None)


class ContactRows:
    """The m vertices of Γc that this rank owns, and their rows. Creation is collective.

    Args:
        matrix: A, which becomes J.
        surfaces: the parts of Γc.

    Attributes:
        vertices: their local numbers, sorted, (m,).
        dofs: the vertices' scalar unknowns, local, (m d,).
        bulk: their rows of A.
        tangent: W K, (m, d, d).
    """

    def __init__(self, matrix: PETSc.Mat, surfaces: Sequence[Surface]) -> None:
        d = matrix.getBlockSize()
        self.vertices: Integers = np.unique(together(s.blocks for s in surfaces)).astype(np.int64)
        self.dofs: Integers = (self.vertices[:, None] * d + np.arange(d)).ravel()
        self.bulk = rows_of(matrix, self.dofs)
        self._product = self.bulk.createVecLeft()
        self._blocks = (self.vertices + matrix.getOwnershipRange()[0] // d).astype(PETSc.IntType)[:, None]
        each = self._blocks * d + np.arange(d, dtype=PETSc.IntType)
        self._elastic = np.array([matrix.getValues(i, i) for i in each], dtype=np.float64).reshape(-1, d, d)
        self.tangent = np.zeros_like(self._elastic)

    def set_tangent(self, terms: Sequence[LawTerm], rates: Sequence[Array]) -> None:
        """Compute W K.

        Args:
            terms: the laws.
            rates: K, (m, d, d) by term.
        """
        self.tangent[:] = 0.0
        for term, k in zip(terms, rates, strict=True):
            at = np.searchsorted(self.vertices, term.surface.blocks)
            np.add.at(self.tangent, at, term.weights[:, None, None] * k)

    def write(self, matrix: PETSc.Mat, held: npt.NDArray[np.integer]) -> None:
        """Write the diagonal blocks of J. Collective.

        Args:
            matrix: J.
            held: unknowns to hold (local, owned); those that are not on Γc are left out.
        """
        values = self._elastic + self.tangent
        d = values.shape[1]
        diagonal = np.zeros(self.dofs.shape)
        diagonal[np.isin(self.dofs, held)] = DEFAULT.held_stiffness
        values[:, np.arange(d), np.arange(d)] += diagonal.reshape(-1, d)
        matrix.setValuesBlockedRCV(self._blocks, self._blocks, values)
        matrix.assemble()

    def elastic(self, x: PETSc.Vec) -> Array:
        """These rows of A x, (m d,). Collective."""
        self.bulk.mult(x, self._product)
        return np.array(self._product.array_r)

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self.bulk.destroy()
        self._product.destroy()


class HoldingForces:
    """The rows of the elastic operator at prescribed unknowns, kept before they become those of the identity.

    Creation is collective.

    Args:
        problem: the problem.
        stiffness: its matrix without conditions.
    """

    def __init__(self, problem: Problem, stiffness: PETSc.Mat) -> None:
        self._fixed = problem.fixed_here
        self._rows = rows_of(stiffness, self._fixed)
        self._product = self._rows.createVecLeft()

    def at(self, x: PETSc.Vec, rotation: PETSc.Mat | None, rows: ContactRows) -> Array:
        """The elastic forces at these unknowns and those of Γc, else zero, (n,). Collective.

        Args:
            x: the unknowns, zero where they are prescribed.
            rotation: Q with u = Q x; None where both are the same.
            rows: those of the vertices of Γc, with the prescribed columns left out.
        """
        found = np.zeros(x.local_size)
        found[rows.dofs] = rows.elastic(x)
        cartesian = x if rotation is None else rotation * x
        self._rows.mult(cartesian, self._product)
        found[self._fixed] = self._product.array_r
        return found

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


class Jacobian:
    """J = A + W K + H of one system. Creation is collective; it owns the matrix.

    Args:
        stiffness: A, which becomes J.
        terms: the laws.
        bounds: the contact bounds.

    Attributes:
        matrix: J; Dirichlet rows and columns are those of the identity; block size d.
        rows: the rows of Γc.
        held: the unknowns of Γc (local, owned, sorted) that J holds.
    """

    def __init__(self, stiffness: PETSc.Mat, terms: Sequence[LawTerm], bounds: Sequence[Bounds]) -> None:
        self.matrix, self._terms = stiffness, tuple(terms)
        surfaces = [*(t.surface for t in terms), *(b.surface for b in bounds)]
        self.rows = ContactRows(stiffness, surfaces)
        self._rates: list[Array] = [np.zeros((*t.free.shape, t.free.shape[1])) for t in terms]
        self.held: Entities = np.empty(0, np.int32)
        self._comm = stiffness.comm.tompi4py()

    @property
    def rates(self) -> list[Array]:
        """A copy of the present K, (m, d, d) by term."""
        return [k.copy() for k in self._rates]

    def set_rates(self, rates: Sequence[Array]) -> None:
        """Set the tangent K, (m, d, d) by term; nothing is held then. Collective."""
        changed = any(np.any(new != old) for new, old in zip(rates, self._rates, strict=True))
        if any(agree(self._comm, changed)):
            self._rates = [k.copy() for k in rates]
            self.rows.set_tangent(self._terms, rates)
            self._write(np.empty(0, np.int32))
        else:
            self.hold(np.empty(0, np.int32))

    def clear(self) -> None:
        """Set no tangent: J is A. Collective."""
        self.set_rates([np.zeros_like(k) for k in self._rates])

    def hold(self, held: Entities) -> None:
        """Hold these unknowns of Γc (local, owned, sorted), and no others, as they are in a solve. Collective."""
        if not all(agree(self._comm, np.array_equal(held, self.held))):
            self._write(held)

    def set_restricted(self, tangent: Array, held: Entities) -> None:
        """Set the tangent of a finer level, restricted to this one, and hold unknowns. Collective.

        Args:
            tangent: W K at the vertices of Γc, (m, d, d).
            held: unknowns to hold (local, owned, sorted).
        """
        same = np.array_equal(tangent, self.rows.tangent) and np.array_equal(held, self.held)
        if not all(agree(self._comm, same)):
            self.rows.tangent[:] = tangent
            self._rates = [np.full_like(k, np.nan) for k in self._rates]  # they say nothing about J now
            self._write(held)

    def _write(self, held: Entities) -> None:
        self.rows.write(self.matrix, held)
        self.held = held.copy()

    def drift(self, rates: Sequence[Array]) -> float:
        """Largest nodal stiffness (an elastic one is about 1) by which this rank's K differs from ``rates``."""
        changes = (
            magnitude((new - old) * term.weights[:, None, None])
            for term, new, old in zip(self._terms, self._rates, rates, strict=True)
        )
        return max(changes, default=0.0)

    def elastic_product(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """The product A x: by J, and by A's own rows where the two differ. Collective.

        K and H may be larger than A by any factor; to subtract their part would leave nothing but rounding.

        Args:
            x: the vector.
            out: where the product is written.
        """
        self.matrix.mult(x, out)
        out.array[self.rows.dofs] = self.rows.elastic(x)

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self.matrix.destroy()
        self.rows.free()
