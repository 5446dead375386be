"""The matrix of a nonlinear solve: the bulk stiffness, the laws' tangent, and the unknowns that a step holds.

J = A + W K + H, symmetric. Laws and active sets touch only the diagonal blocks of Γc's vertices (:mod:`.contact_rows`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.law_term import LawTerm
from ..problem.problem import Bounds
from ..problem.rigid_part import RigidPart
from ..typing import Array, Entities
from .contact_rows import ContactRows
from .thresholds import DEFAULT, Thresholds


class Jacobian:
    """J = A + W K + H of one system. Creation is collective; it owns the matrix.

    Args:
        stiffness: A, which becomes J.
        terms: the laws.
        bounds: the contact bounds.
        thresholds: how unknowns are held.
        rigid: what of the unknowns A does not see; None: nothing.

    Attributes:
        matrix: J; Dirichlet rows and columns are those of the identity; block size d.
        rows: the rows of Γc.
        held: the unknowns of Γc (local, owned, sorted) that J holds.
    """

    def __init__(
        self,
        stiffness: PETSc.Mat,
        terms: Sequence[LawTerm],
        bounds: Sequence[Bounds],
        thresholds: Thresholds = DEFAULT,
        rigid: RigidPart | None = None,
    ) -> None:
        self.matrix, self._terms, self._rigid = stiffness, tuple(terms), rigid
        surfaces = [*(t.surface for t in terms), *(b.surface for b in bounds)]
        self.rows = ContactRows(stiffness, surfaces, thresholds.held_stiffness)
        self._rates = [np.zeros((*t.free.shape, t.free.shape[1])) for t in terms]
        self.held: Entities = np.empty(0, np.int32)
        self._comm = stiffness.comm.tompi4py()
        self._strained = stiffness.createVecRight()

    @property
    def rates(self) -> list[Array]:
        """A copy of the present K, (m, d, d) by term."""
        return [k.copy() for k in self._rates]

    def set_rates(self, rates: Sequence[Array]) -> None:
        """Set the tangent K, (m, d, d) by term; nothing is held then. Collective."""
        changed = any(bool(np.any(new != old)) for new, old in zip(rates, self._rates, strict=True))
        if self._comm.allreduce(changed, op=MPI.LOR):
            self._rates = [k.copy() for k in rates]
            self.rows.set_tangent(self._terms, rates)
            self._write(np.empty(0, np.int32))
        else:
            self.hold(np.empty(0, np.int32))

    def hold(self, held: Entities) -> None:
        """Hold these unknowns of Γc (local, owned, sorted), and no others, as they are in a solve. Collective."""
        if self._comm.allreduce(not np.array_equal(held, self.held), op=MPI.LOR):
            self._write(held)

    def set_restricted(self, tangent: Array, held: Entities) -> None:
        """Set the tangent of a finer level, restricted to this one, and hold unknowns. Collective.

        Args:
            tangent: W K at the vertices of Γc, (m, d, d).
            held: unknowns to hold (local, owned, sorted).
        """
        changed = not (np.array_equal(tangent, self.rows.tangent) and np.array_equal(held, self.held))
        if self._comm.allreduce(changed, op=MPI.LOR):
            self.rows.tangent[:] = tangent
            self._rates = [np.full_like(k, np.nan) for k in self._rates]  # they say nothing about J now
            self._write(held)

    def _write(self, held: Entities) -> None:
        self.rows.write(self.matrix, held)
        self.held = held.copy()

    def drift(self, rates: Sequence[Array]) -> float:
        """Largest nodal stiffness (an elastic one is about 1) by which this rank's K differs from ``rates``."""
        changes = (
            float(np.max(np.abs(new - old) * term.weights[:, None, None], initial=0.0))
            for term, new, old in zip(self._terms, self._rates, rates, strict=True)
        )
        return max(changes, default=0.0)

    def elastic_product(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """The product A x: by J, and by A's own rows where the two differ. Collective.

        Args:
            x: the vector.
            out: where the product is written.
        """
        strained = self.strained(x)
        self.matrix.mult(strained, out)
        self.rows.overwrite(strained, out)

    def elastic_at_contact(self, x: PETSc.Vec) -> Array:
        """The rows of A x at the vertices of Γc, (m d,). Collective.

        Args:
            x: the vector.
        """
        return self.rows.elastic(self.strained(x))

    def strained(self, x: PETSc.Vec) -> PETSc.Vec:
        """X without what A does not see of it: x itself, or a vector that the next call overwrites. Collective.

        Args:
            x: the vector.
        """
        values = x.array_r
        rest = values if self._rigid is None else self._rigid.without(values)
        if rest is values:
            return x
        self._strained.array[:] = rest
        return self._strained

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self.matrix.destroy()
        self._strained.destroy()
        self.rows.free()
