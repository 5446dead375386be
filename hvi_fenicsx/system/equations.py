"""The equations of a system, and what takes the place of a law j = H - G in them, vertex by vertex.

H's kinks (Tresca, |u_t| at zero, upward jumps) stay in the convex step: bounds on its slip keep each vertex in the cell
between two kinks, where H is smooth up to the ends. A vertex on a kink that cannot carry its force moves on to the next
cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from petsc4py import PETSc

from ..laws import ConvexPart, Superpotential
from ..problem.law_term import LawTerm
from ..runtime.mpi import total
from ..typing import Array, Integers
from .jacobian import Jacobian
from .thresholds import DEFAULT


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

    def residual(self, x: PETSc.Vec, out: PETSc.Vec, models: Sequence[VertexModel]) -> None:
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

    def tangents(self, x: PETSc.Vec, models: Sequence[VertexModel], foundation: float = 0.0) -> list[Array]:
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

    def energy(self, x: PETSc.Vec, models: Sequence[VertexModel]) -> float:
        """The energy ½ a(u, u) - <g, u> + Σ w j(u), up to a constant of the prescribed displacements. Collective.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws j, by term.
        """
        u, local = x.array_r, 0.0
        for term, model in zip(self._terms, models, strict=True):
            local += float(np.sum(term.energy_weights * model.value(term.argument(u))))
        return self.base.energy + self._elastic_change(x) + total(self._comm, local)

    def _elastic_change(self, x: PETSc.Vec) -> float:
        """½ a(u, u) - <g, u> less its value at the base: small changes keep their digits. Collective."""
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


@dataclass(frozen=True)
class Cells:
    """For each of m vertices, the cell [lower, upper] between two kinks of H in which it stays.

    For a law of |u_t| in 3D there is one kink, at zero, and two cells: stuck (0) and free (1).

    Attributes:
        kinks: the kinks of H, ascending.
        index: number of each vertex's cell, (m,).
        ramp: for a law of |u_t|, the slip up to which the traction of a free vertex grows from zero, so that its
            direction may still turn; a vertex whose slip remains smaller is stuck. 0 for laws of a signed slip.
    """

    kinks: Array
    index: Integers
    ramp: float = 0.0

    @classmethod
    def around(cls, part: ConvexPart, x: Array, *, radial: bool = False) -> Cells:
        """The cells that hold x; on a kink the cell to its right, for a law of |u_t| the stuck one.

        Args:
            part: H.
            x: arguments, (m,).
            radial: whether it is a law of |u_t|.
        """
        side: Literal["left", "right"] = "left" if radial else "right"
        ramp = 0.0
        if radial and len(part.kinks):
            ramp = DEFAULT.first_ramp * max(float(np.max(x, initial=0.0)), DEFAULT.coarse_tolerance)
        return cls(part.kinks, np.searchsorted(part.kinks, x, side=side), ramp)

    @property
    def lower(self) -> Array:
        """Lower ends; -inf where there is none."""
        return np.concatenate([[-np.inf], self.kinks])[self.index]

    @property
    def upper(self) -> Array:
        """Upper ends; inf where there is none."""
        return np.concatenate([self.kinks, [np.inf]])[self.index]

    def moved(self, step: Integers) -> Cells:
        """The cells after each vertex moved to a neighbouring one, or stayed; if any moved to the right, half the ramp.

        Args:
            step: -1, 0 or 1, (m,).
        """
        return Cells(self.kinks, self.index + step, self.ramp / 2.0 if np.any(step > 0) else self.ramp)


UNDIVIDED = Cells(np.empty(0), np.zeros(1, dtype=np.int64))
"""The whole line as one cell."""


@dataclass(frozen=True)
class VertexModel:
    """What takes the place of a law j = H - G at its vertices: j itself, or with ξ ∈ ∂G its majorant H - ξ.

    Attributes:
        law: j.
        cells: where each vertex stays; undivided, the mean of both sides counts at kinks, as in the paper's formula.
        xi: ξ, (m,): the majorant is nowhere less than j, and equal at the arguments of ξ, up to a constant; None: j.
        secant_from: the stiffness is the secant's H'/x, of slips of this at least, where it exceeds the tangent's.
            Where H'/x falls with |x| that parabola is greater than H, so that full steps lower the energy
            (iteratively reweighted least squares; Kačanov); None: the tangent's.
    """

    law: Superpotential
    cells: Cells = UNDIVIDED
    xi: Array | None = None
    secant_from: float | None = None

    def value(self, x: Array) -> Array:
        """Energy per area."""
        return self.law.value(x) if self.xi is None else self.law.convex.value(x) - self.xi * x

    def derivative(self, x: Array) -> Array:
        """H' less ξ, or less the middle of G's interval."""
        concave = self.law.concave
        falling = (concave.left(x) + concave.right(x)) / 2 if self.xi is None else self.xi
        return self._inside(x) - falling

    def second(self, x: Array) -> Array:
        """H'', of j less G''."""
        if self.xi is None:
            return self._curvature(x) - self.law.concave.second(x)
        if self.secant_from is None:
            return self._curvature(x)
        secant = np.abs(self._inside(x)) / np.maximum(np.abs(x), self.secant_from)
        return np.maximum(self._curvature(x), secant)

    def _inside(self, x: Array) -> Array:
        """Derivative of H, continued from inside of the cell to its ends."""
        part, cells = self.law.convex, self.cells
        if cells is UNDIVIDED:
            return (part.left(x) + part.right(x)) / 2
        if cells.ramp > 0:
            return part.right(np.maximum(x, cells.ramp)) * np.minimum(x / cells.ramp, 1.0)
        at_lower, at_upper = x <= cells.lower, x >= cells.upper
        lower, upper = np.where(at_lower, cells.lower, x), np.where(at_upper, cells.upper, x)
        return np.where(at_lower, part.right(lower), np.where(at_upper, part.left(upper), part.right(x)))

    def _curvature(self, x: Array) -> Array:
        """Second derivative of H; on the ramp, that of the ramp."""
        part, ramp = self.law.convex, self.cells.ramp
        if ramp > 0:
            steep = part.right(np.array([ramp])) / ramp
            return np.where(x < ramp, steep, part.second(np.maximum(x, ramp)))
        return part.second(x)
