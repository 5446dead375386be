"""The equations of a system: residual, tangent and energy for what takes the place of the laws, and their rounding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.law_term import LawTerm
from ..problem.problem import Bounds
from ..typing import Array, Entities
from .contact_rows import ContactRows


@dataclass(frozen=True)
class Base:
    """A displacement at which elastic forces are known, this rank's unknowns (n).

    Attributes:
        x: the unknowns u.
        elastic: its elastic forces in all rows, those of prescribed unknowns too, (n,).
        residual: these forces less the loads; what u lacks of its values at prescribed unknowns, (n,).
        energy: ½ a(u, u) - <g, u>, up to a constant.
    """

    x: PETSc.Vec
    elastic: Array
    residual: Array
    energy: float = 0.0


class Equations:
    """A u - b + W τ(u) = 0, and the energy that belongs to it. Creation is collective.

    The rows of A round each on their own. On a mesh of equal cells they all round alike, and the elastic forces of a
    body that turns far then have a net force, which contact and laws would have to carry. Forces of cells have none. So
    elastic forces are those of cells at one displacement, the base, and A gives their change from there.

    Residuals are computed from the rows of A itself at the vertices of Γc, not from those that a step holds.

    Args:
        jacobian: the stiffness A.
        terms: the laws, in the unknowns' components.
        base: the first base.
    """

    def __init__(self, jacobian: Jacobian, terms: Sequence[LawTerm], base: Base) -> None:
        self._jacobian, self._terms, self.base = jacobian, tuple(terms), base
        self._comm = base.x.comm.tompi4py()
        self._change, self._work = base.x.duplicate(), base.x.duplicate()

    def begin_at(self, x: PETSc.Vec, elastic: Array, residual: Array) -> None:
        """Take another base. Collective.

        Args:
            x: the unknowns u there.
            elastic: its forces, as :attr:`.Base.elastic`.
            residual: likewise.
        """
        energy = self.base.energy + self._elastic_change(x)
        self.base.x.destroy()
        self.base = Base(x.copy(), elastic, residual, energy)

    def from_base(self, x: PETSc.Vec) -> PETSc.Vec:
        """Unknowns less those of the base; overwritten by the next call."""
        self._change.array[:] = x.array_r - self.base.x.array_r
        return self._change

    def residual(self, x: PETSc.Vec, out: PETSc.Vec, models: Sequence[LawModel]) -> None:
        """The residual A u - b + W τ(u). Collective.

        Args:
            x: the unknowns u.
            out: where it is written.
            models: what takes the place of the laws, by term.
        """
        self._jacobian.elastic_product(self.from_base(x), out)
        out.array[:] += self.base.residual
        u, forces = x.array_r, out.array
        for term, model in zip(self._terms, models, strict=True):
            force = term.force(u, model.derivative(term.argument(u)))
            forces.reshape(-1, force.shape[1])[term.surface.blocks] += force

    def at_contact(self, x: PETSc.Vec) -> Array:
        """The rows of A u - b at the vertices of Γc, (m d,). Collective.

        Args:
            x: the unknowns u.
        """
        rows = self._jacobian.rows
        return self.base.residual[rows.dofs] + rows.elastic(self.from_base(x))

    def tangents(self, x: PETSc.Vec, models: Sequence[LawModel], foundation: float = 0.0) -> list[Array]:
        """The tangent stiffness K of the laws, (m, d, d) by term.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws, by term.
            foundation: stiffness added in all directions that are not prescribed: laws without any hold no motion.
        """
        u = x.array_r
        arguments = [term.argument(u) for term in self._terms]
        return [
            term.rate(u, model.derivative(a), model.second(a))
            + foundation * term.free[:, :, None] * np.eye(term.free.shape[1])
            for term, model, a in zip(self._terms, models, arguments, strict=True)
        ]

    def energy(self, x: PETSc.Vec, models: Sequence[LawModel]) -> float:
        """The energy ½ a(u, u) - <g, u> + Σ w j(u), up to a constant of the prescribed displacements. Collective.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws j, by term.
        """
        return self.base.energy + self.energy_from_base(x, models)

    def energy_from_base(self, x: PETSc.Vec, models: Sequence[LawModel]) -> float:
        """The same less what elasticity and loads make of it at the base: small changes keep their digits. Collective.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws j, by term.
        """
        u, local = x.array_r, 0.0
        for term, model in zip(self._terms, models, strict=True):
            local += float(np.sum(term.energy_weights * model.value(term.argument(u))))
        return self._elastic_change(x) + float(self._comm.allreduce(local))

    def _elastic_change(self, x: PETSc.Vec) -> float:
        """½ a(u, u) - <g, u> less its value at the base. Collective."""
        change = self.from_base(x)
        self._jacobian.elastic_product(change, self._work)
        self._work.array[:] = 0.5 * self._work.array_r + self.base.residual
        return float(change.dot(self._work))

    @cached_property
    def _stiffness_norm(self) -> float:
        """‖A + W K‖ in the maximum norm, with nothing held. Collective when first used."""
        self._jacobian.hold(np.empty(0, np.int32))
        return float(self._jacobian.matrix.norm(PETSc.NormType.INFINITY))

    def energy_rounding(self, x: PETSc.Vec) -> float:
        """By how much rounding may change the energy at u: a few ε_machine ‖A‖ ‖u‖². Collective."""
        return 4 * float(np.finfo(float).eps) * self._stiffness_norm * float(x.norm()) ** 2

    def rounding_sample(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """A sample of the rounding error of a residual: A times ±ε_machine u, the signs at random. Collective.

        Args:
            x: the unknowns u.
            out: where it is written.
        """
        shuffled = x.duplicate()
        signs = np.random.default_rng(self._comm.rank).choice([-1.0, 1.0], x.local_size)
        shuffled.array[:] = x.array_r * signs * np.finfo(float).eps
        self._jacobian.elastic_product(shuffled, out)
        shuffled.destroy()

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        for vector in (self.base.x, self._change, self._work):
            vector.destroy()


class LawModel(Protocol):
    """What takes the place of a law in one nonlinear solve: a function of its argument (m,) with two derivatives."""

    def value(self, x: Array) -> Array:
        """Energy per area."""

    def derivative(self, x: Array) -> Array:
        """Traction."""

    def second(self, x: Array) -> Array:
        """Tangent stiffness."""


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
        self._rates = [np.zeros((*t.free.shape, t.free.shape[1])) for t in terms]
        self.held: Entities = np.empty(0, np.int32)
        self._comm = stiffness.comm.tompi4py()

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
        self.matrix.mult(x, out)
        self.rows.overwrite(x, out)

    def free(self) -> None:
        """Free the PETSc objects. Collective."""
        self.matrix.destroy()
        self.rows.free()
