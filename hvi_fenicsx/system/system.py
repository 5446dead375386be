"""A problem assembled: PETSc matrix, load, bounds, and the law terms' residual, tangent and energy on top of them.

The bulk matrix A is assembled once. Laws and active sets touch only the diagonal blocks of Γc's vertices
(:mod:`.contact_rows`); residuals are computed from the rows of A itself there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import assemble_vector, set_bc
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.problem import Problem
from ..problem.vectors import assembled, new_vector, turn
from ..rigid import Mode
from ..runtime.timing import Timer
from ..typing import Array, Entities
from . import free_motions, local_frames, near_null_space
from .contact_rows import ContactRows
from .free_motions import Freedom

if TYPE_CHECKING:
    from .coarser_level import Below


class Model(Protocol):
    """What stands for a law in one nonlinear solve: a function of its argument (m,) with two derivatives."""

    def value(self, x: Array) -> Array:
        """Energy per area."""

    def derivative(self, x: Array) -> Array:
        """Traction."""

    def second(self, x: Array) -> Array:
        """Tangent stiffness."""


@dataclass(frozen=True)
class Compiled:
    """A problem's compiled forms."""

    bilinear: fem.Form
    linear: dict[str, fem.Form]


def compile_forms(problem: Problem) -> Compiled:
    """Compile (or take from the cache) what the assembly needs. Collective."""
    return Compiled(problem.bulk.compiled, {name: fem.form(f) for name, f in problem.linear.items()})


class System:
    """A problem's matrix, load and bounds (PETSc objects owned by this, freed with it). Creation is collective.

    Attributes:
        problem: what was assembled. frames, rotation: of vertices with slanted normals; None where there are none.
        terms, bounds: the problem's, in the unknowns' components.
        matrix: J = A + W K (+ H, see :meth:`hold`), symmetric, Dirichlet rows and columns replaced by the identity;
            block size d. rows: those of Γc.
        load: b, lifted; the prescribed values stand in the Dirichlet rows.
        held: the unknowns of Γc (local, owned, sorted) that J holds.
        lower, upper: bounds of u; infinite on Dirichlet rows.
        scale: norm of the load, what residuals are relative to.
        below: the next coarser rung of the ladder; None where there is none.
        forces: the assembled load vectors by name, unlifted (for the virtual work of rigid motions).
        freedom: the rigid motions that nothing holds and no load moves; None where there are none (:meth:`release`).
    """

    def __init__(self, problem: Problem, compiled: Compiled, timer: Timer) -> None:
        self.problem, self.frames = problem, local_frames.build(problem)
        self.below: Below | None = None
        self.freedom: Freedom | None = None
        self._size: float | None = None
        self.terms, self.bounds = problem.terms, problem.bounds
        with timer("assembly"):
            self.forces = {name: assembled(form) for name, form in compiled.linear.items()}
            self.matrix, self.load = self._constrained()
            self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
            self.matrix.setOption(PETSc.Mat.Option.SPD, True)
            self.rotation = self._rotate()
            self.rows = ContactRows(self.matrix, [*(t.surface for t in self.terms), *(b.surface for b in self.bounds)])
        self._rates = [np.zeros((*t.free.shape, t.free.shape[1])) for t in self.terms]
        self.held: Entities = np.empty(0, np.int32)
        self._work = self.load.duplicate()
        self.lower, self.upper = self._box()
        free = self.load.copy()
        free.array[problem.fixed_here] = 0.0
        self.scale = float(free.norm()) or 1.0

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.problem.domain.mesh.comm

    @property
    def dofs(self) -> int:
        """Global number of unknowns."""
        return int(self.load.size)

    def release(self, modes: Sequence[Mode]) -> None:
        """Attach free motions as the null space, and take out of the load what rounding left of them. Collective."""
        if not modes:
            return
        vectors = [self.unknowns(field) for field in free_motions.fields(self.problem, modes)]
        self.freedom = free_motions.build(vectors, modes)
        self.matrix.setNullSpace(self.freedom.null_space)
        self.freedom.null_space.remove(self.load)

    @property
    def pins(self) -> Entities:
        """Dofs at which free motions are pinned: where all other equations hold, theirs do too."""
        return self.freedom.pins if self.freedom else np.empty(0, np.int32)

    @cached_property
    def near_null(self) -> PETSc.NullSpace:
        """What algebraic multigrid must keep (:mod:`.near_null_space`). Collective when first used."""
        return near_null_space.rigid_modes(self.problem, self.rotation)

    def _rotate(self) -> PETSc.Mat | None:
        """Go over to local components where normals are slanted; the matrix Q with u = Q û, or None."""
        if self.frames is None:
            return None
        q = self.frames.matrix(self.problem, self.matrix)
        rows, columns = self.matrix.getLGMap()
        rotated = self.matrix.ptap(q)
        rotated.setLGMap(rows, columns)
        self.matrix.destroy()
        self.matrix = rotated
        turn(self.load, q)
        self.terms = tuple(self.frames.term(t) for t in self.terms)
        self.bounds = tuple(self.frames.bounds(b) for b in self.bounds)
        return q

    def displacement(self, x: PETSc.Vec) -> fem.Function:
        """Unknowns as a displacement field (Cartesian, in units of u0, ghosts updated). Collective."""
        u = fem.Function(self.problem.space, name="displacement")
        cartesian = x if self.rotation is None else self.rotation * x
        u.x.array[: x.local_size] = cartesian.array_r
        u.x.scatter_forward()
        return u

    def unknowns(self, u: fem.Function) -> PETSc.Vec:
        """A displacement field as unknowns. Collective."""
        x = new_vector(self.problem.space)
        x.array[:] = u.x.array[: x.local_size]
        turn(x, self.rotation)
        return x

    def prescribe(self, x: PETSc.Vec) -> None:
        """Give the prescribed unknowns of x their values. Local."""
        x.array[self.problem.fixed_here] = self.load.array_r[self.problem.fixed_here]

    def undisplaced(self) -> PETSc.Vec:
        """A new x: the prescribed values, and zero elsewhere. Collective."""
        x = self.load.duplicate()
        x.set(0.0)
        self.prescribe(x)
        return x

    def _constrained(self) -> tuple[PETSc.Mat, PETSc.Vec]:
        """Stiffness and load with the prescribed values: rows and columns of the identity, the load lifted."""
        matrix = self.problem.bulk.matrix()
        load, prescribed = new_vector(self.problem.space), new_vector(self.problem.space)
        for force in self.forces.values():
            load.axpy(1.0, force)
        set_bc(prescribed, list(self.problem.conditions))
        rows = (self.problem.fixed_here + load.owner_range[0]).astype(PETSc.IntType)
        matrix.zeroRowsColumns(rows, 1.0, prescribed, load)
        return matrix, load

    def _box(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        lower, upper = self.load.duplicate(), self.load.duplicate()
        lower.set(-np.inf)
        upper.set(np.inf)
        for bounds in self.bounds:
            dofs, sign = bounds.component()
            positive = sign > 0
            low = np.where(positive, bounds.lower, -bounds.upper)
            high = np.where(positive, bounds.upper, -bounds.lower)
            lower.array[dofs] = np.maximum(lower.array[dofs], low)
            upper.array[dofs] = np.minimum(upper.array[dofs], high)
        owned = self.problem.fixed_here
        lower.array[owned], upper.array[owned] = -np.inf, np.inf
        return lower, upper

    def set_rates(self, rates: Sequence[Array]) -> None:
        """Make K the tangent in force, nothing held: J changes in Γc's rows only. Collective."""
        changed = any(bool(np.any(new != old)) for new, old in zip(rates, self._rates, strict=True))
        if self.comm.allreduce(changed, op=MPI.LOR):
            self._rates = [k.copy() for k in rates]
            self.rows.set_tangent(self.terms, rates)
            self._write(np.empty(0, np.int32))
        else:
            self.hold(np.empty(0, np.int32))

    def hold(self, held: Entities) -> None:
        """Hold some unknowns of Γc (local, owned, sorted) in J where a solve finds them, and no others. Collective."""
        if self.comm.allreduce(not np.array_equal(held, self.held), op=MPI.LOR):
            self._write(held)

    def take(self, tangent: Array, held: Entities) -> None:
        """Take the tangent W K (m, d, d) of a finer rung, and hold these unknowns. Collective."""
        changed = not (np.array_equal(tangent, self.rows.tangent) and np.array_equal(held, self.held))
        if self.comm.allreduce(changed, op=MPI.LOR):
            self.rows.tangent[:] = tangent
            self._rates = [np.full_like(k, np.nan) for k in self._rates]  # its own are no longer in force
            self._write(held)

    def _write(self, held: Entities) -> None:
        self.rows.write(self.matrix, held)
        self.held = held.copy()

    @property
    def rates(self) -> list[Array]:
        """A copy of the K in force, by term."""
        return [k.copy() for k in self._rates]

    def drift(self, rates: Sequence[Array]) -> float:
        """Largest nodal stiffness (an elastic one is about 1) by which this rank's K differs from ``rates``."""
        changes = (
            float(np.max(np.abs(new - old) * term.surface.weights[:, None, None], initial=0.0))
            for term, new, old in zip(self.terms, self._rates, rates, strict=True)
        )
        return max(changes, default=0.0)

    def residual(self, x: PETSc.Vec, out: PETSc.Vec, models: Sequence[Model]) -> None:
        """A u - b + W τ(u) into ``out``, which must have ghosts. Collective."""
        self._stiffness_times(x, out)
        out.axpy(-1.0, self.load)
        with out.localForm() as local:
            local.array_w[out.local_size :] = 0.0
        for term, model in zip(self.terms, models, strict=True):
            u = x.array_r
            term.set_traction(u, model.derivative(term.argument(u)))
            assemble_vector(out, term.residual)
        out.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def _stiffness_times(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """A u: by J, but by A's own rows where they differ."""
        self.matrix.mult(x, out)
        self.rows.overwrite(x, out)

    def tangents(self, x: PETSc.Vec, models: Sequence[Model]) -> list[Array]:
        """K of the models at u, by term."""
        u = x.array_r
        arguments = [term.argument(u) for term in self.terms]
        return [
            term.rate(u, model.derivative(a), model.second(a))
            for term, model, a in zip(self.terms, models, arguments, strict=True)
        ]

    def energy(self, x: PETSc.Vec, models: Sequence[Model]) -> float:
        """½ a(u, u) - <g, u> + Σ w models, up to a constant of the prescribed displacements. Collective."""
        self._stiffness_times(x, self._work)
        u = x.array_r
        local = 0.0
        for term, model in zip(self.terms, models, strict=True):
            local += float(np.sum(term.surface.weights * model.value(term.argument(u))))
        return 0.5 * float(x.dot(self._work)) - float(self.load.dot(x)) + float(self.comm.allreduce(local))

    def energy_noise(self, x: PETSc.Vec) -> float:
        """What rounding may change of the energy at u: a few ε_machine ‖A‖ ‖u‖². Collective."""
        if self._size is None:
            self.hold(np.empty(0, np.int32))
            self._size = float(self.matrix.norm(PETSc.NormType.INFINITY))
        return 4 * float(np.finfo(float).eps) * self._size * float(x.norm()) ** 2

    def rounding(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """A sample of the rounding error of a residual at u: A times u with its last digits shuffled. Collective."""
        shuffled = x.duplicate()
        signs = np.random.default_rng(self.comm.rank).choice([-1.0, 1.0], x.local_size)
        shuffled.array[:] = x.array_r * signs * np.finfo(float).eps
        self._stiffness_times(shuffled, out)
        shuffled.destroy()

    def allowed(self, tolerance: float) -> Array:
        """Largest residual a dof of Γc may keep for its traction to be right within tolerance; infinite elsewhere."""
        allowed = np.full(self.load.local_size, np.inf)
        for bounds in self.bounds:
            dofs, _ = bounds.component()
            allowed[dofs] = np.minimum(allowed[dofs], tolerance * bounds.surface.weights)
        for term in self.terms:
            dofs = term.surface.dofs
            touched = np.any(term.directions != 0, axis=1)
            limit = tolerance * term.traction_scale * term.surface.weights
            allowed[dofs[touched]] = np.minimum(allowed[dofs], limit[:, None])[touched]
        return allowed
