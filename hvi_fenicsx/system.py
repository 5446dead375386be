"""A problem assembled: PETSc matrix, load, bounds, and the law terms' residual, tangent and energy on top of them.

The bulk matrix A is assembled once. Laws touch only the diagonal blocks of Γc's vertices: for a new tangent K these
blocks of J = A + W K are reset and assembled again, nothing else. Where a law acts, residuals are computed from the
rows of A itself: K may be larger than A by any factor, and a difference of the two would leave rounding only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix, assemble_vector, set_bc
from mpi4py import MPI
from petsc4py import PETSc

from . import dilatation, frames
from .lawterm import LawTerm
from .problem import Problem
from .surface import component_dofs
from .timing import Timer

Array = npt.NDArray[np.float64]
_ADD, _INSERT = PETSc.InsertMode.ADD, PETSc.InsertMode.INSERT
_FORWARD, _REVERSE = PETSc.ScatterMode.FORWARD, PETSc.ScatterMode.REVERSE


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
    return Compiled(fem.form(problem.bilinear), {name: fem.form(f) for name, f in problem.linear.items()})


class System:
    """A problem's matrix, load and bounds (PETSc objects owned by this, freed with it). Creation is collective.

    Attributes:
        problem: what was assembled. frames, rotation: of vertices with slanted normals; None where there are none.
        terms, bounds: the problem's, in the unknowns' components.
        matrix: J = A + W K, symmetric, Dirichlet rows and columns replaced by the identity; block size d.
        load: b, lifted; the prescribed values stand in the Dirichlet rows.
        lower, upper: bounds of u; infinite on Dirichlet rows.
        scale: norm of the load, what residuals are relative to.
        prolongations: to this system's mesh from the next coarser one, and so on down; empty without a ladder.
        forces: the assembled load vectors by name, unlifted (for the virtual work of rigid motions).
    """

    def __init__(self, problem: Problem, compiled: Compiled, timer: Timer) -> None:
        self.problem, self.frames = problem, frames.build(problem)
        self.prolongations: tuple[PETSc.Mat, ...] = ()
        self._size: float | None = None
        self.terms, self.bounds = problem.terms, problem.bounds
        with timer("assembly"):
            self.forces = {name: _assembled(form) for name, form in compiled.linear.items()}
            self.matrix, self.load = self._constrained(compiled)
            self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
            self.matrix.setOption(PETSc.Mat.Option.SPD, True)
            self.rotation = self._rotate()
            self.near_null = rigid_modes(problem, self.rotation)
            self.matrix.setNearNullSpace(self.near_null)
        self._rates = [np.zeros((*t.free.shape, t.free.shape[1])) for t in self.terms]
        self._bulk = _BulkRows(self.matrix, self.terms) if self.terms else None
        self._work = self.load.duplicate()
        self.lower, self.upper = self._box()
        free = self.load.copy()
        free.array[problem.fixed[problem.fixed < free.local_size]] = 0.0
        self.scale = float(free.norm()) or 1.0

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.problem.domain.mesh.comm

    @property
    def dofs(self) -> int:
        """Global number of unknowns."""
        return int(self.load.size)

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
        cartesian = self.load.copy()
        q.multTranspose(cartesian, self.load)
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
        if self.rotation is not None:
            cartesian = x.copy()
            self.rotation.multTranspose(cartesian, x)
        return x

    def _constrained(self, compiled: Compiled) -> tuple[PETSc.Mat, PETSc.Vec]:
        """Stiffness and load with the prescribed values: rows and columns of the identity, the load lifted."""
        matrix = assemble_matrix(compiled.bilinear)
        matrix.assemble()
        matrix = dilatation.add(matrix, dilatation.assemble(self.problem.averaged))
        load, prescribed = new_vector(self.problem.space), new_vector(self.problem.space)
        for force in self.forces.values():
            load.axpy(1.0, force)
        set_bc(prescribed, list(self.problem.conditions))
        owned = self.problem.fixed[self.problem.fixed < load.local_size]
        rows = (owned + load.owner_range[0]).astype(PETSc.IntType)
        matrix.zeroRowsColumns(rows, 1.0, prescribed, load)
        return matrix, load

    def _box(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        lower, upper = self.load.duplicate(), self.load.duplicate()
        lower.set(-np.inf)
        upper.set(np.inf)
        for bounds in self.bounds:
            dofs, sign = component_dofs(bounds.surface.blocks, bounds.surface.normals)
            positive = sign > 0
            low = np.where(positive, bounds.lower, -bounds.upper)
            high = np.where(positive, bounds.upper, -bounds.lower)
            lower.array[dofs] = np.maximum(lower.array[dofs], low)
            upper.array[dofs] = np.minimum(upper.array[dofs], high)
        owned = self.problem.fixed[self.problem.fixed < lower.local_size]
        lower.array[owned], upper.array[owned] = -np.inf, np.inf
        return lower, upper

    def set_rates(self, rates: Sequence[Array]) -> None:
        """Make K the tangent in force: J changes in Γc's rows only. Collective."""
        changed = any(bool(np.any(new != old)) for new, old in zip(rates, self._rates, strict=True))
        if self._bulk is None or not self.comm.allreduce(changed, op=MPI.LOR):
            return
        self._bulk.restore_blocks(self.matrix)
        for term, new, old in zip(self.terms, rates, self._rates, strict=True):
            term.set_rates(new)
            assemble_matrix(self.matrix, term.tangent)
            old[...] = new
        self.matrix.assemble()

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
        out.ghostUpdate(addv=_ADD, mode=_REVERSE)

    def _stiffness_times(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """A u: by J, but by A's own rows where they differ."""
        self.matrix.mult(x, out)
        if self._bulk is not None:
            self._bulk.overwrite(x, out)

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
        d = self.problem.scales.dimension
        for bounds in self.bounds:
            dofs, _ = component_dofs(bounds.surface.blocks, bounds.surface.normals)
            allowed[dofs] = np.minimum(allowed[dofs], tolerance * bounds.surface.weights)
        for term in self.terms:
            dofs = term.surface.blocks[:, None] * d + np.arange(d)
            touched = np.any(term.directions != 0, axis=1)
            limit = tolerance * traction_scale(term) * term.surface.weights
            allowed[dofs[touched]] = np.minimum(allowed[dofs], limit[:, None])[touched]
        return allowed


class _BulkRows:
    """The rows of the bulk matrix at the vertices where laws act."""

    def __init__(self, matrix: PETSc.Mat, terms: Sequence[LawTerm]) -> None:
        d = matrix.getBlockSize()
        blocks = np.unique(np.concatenate([t.surface.blocks for t in terms]))
        self._dofs = (blocks[:, None] * d + np.arange(d)).ravel()
        start = matrix.getOwnershipRange()[0]
        rows = PETSc.IS().createGeneral((self._dofs + start).astype(PETSc.IntType), comm=matrix.comm)
        self._matrix = matrix.createSubMatrix(rows, None)
        self._product = self._matrix.createVecLeft()
        self._blocks = (blocks + start // d).astype(PETSc.IntType)
        self._values = self._diagonal_blocks(matrix, d)

    def _diagonal_blocks(self, matrix: PETSc.Mat, d: int) -> Array:
        dofs = self._blocks[:, None] * d + np.arange(d, dtype=PETSc.IntType)
        return np.array([matrix.getValues(i, i) for i in dofs], dtype=np.float64).reshape(-1, d, d)

    def restore_blocks(self, matrix: PETSc.Mat) -> None:
        """Put the bulk's diagonal blocks back into J. Collective."""
        for block, values in zip(self._blocks, self._values, strict=True):
            matrix.setValuesBlocked([block], [block], values)
        matrix.assemblyBegin(PETSc.Mat.AssemblyType.FLUSH)
        matrix.assemblyEnd(PETSc.Mat.AssemblyType.FLUSH)

    def overwrite(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """Replace these rows of a product with J by those of the product with A. Collective."""
        self._matrix.mult(x, self._product)
        out.array[self._dofs] = self._product.array_r


def traction_scale(term: LawTerm) -> float:
    """What a law's traction is judged by: its own scale, but nothing finer than a thousandth of the load's."""
    return max(term.exact.traction_scale, 1e-3)


def new_vector(space: fem.FunctionSpace) -> PETSc.Vec:
    """A zero vector of a space, with ghosts. Collective."""
    function = fem.Function(space)  # must outlive the duplication: its vector does not own the memory
    vector = function.x.petsc_vec.duplicate()
    vector.set(0.0)
    return vector


def _assembled(form: fem.Form) -> PETSc.Vec:
    vector = assemble_vector(form)
    vector.ghostUpdate(addv=_ADD, mode=_REVERSE)
    return vector


def rigid_modes(problem: Problem, rotation: PETSc.Mat | None = None) -> PETSc.NullSpace:
    """The near-null space: all rigid motions of the free body, orthonormal, in the unknowns' components. Collective."""
    space, d = problem.space, problem.scales.dimension
    x = (space.tabulate_dof_coordinates() - problem.domain.centre) / problem.scales.length
    fields = [np.eye(d)[i] + np.zeros((len(x), d)) for i in range(d)]
    pairs = [(0, 1)] if d == 2 else [(1, 2), (2, 0), (0, 1)]
    for i, j in pairs:
        turning = np.zeros((len(x), d))
        turning[:, i], turning[:, j] = -x[:, j], x[:, i]
        fields.append(turning)
    vectors = []
    for field in fields:
        vector = new_vector(space)
        vector.array[:] = field.ravel()[: vector.local_size]
        if rotation is not None:
            cartesian = vector.copy()
            rotation.multTranspose(cartesian, vector)
        vectors.append(vector)
    _orthonormalise(vectors)
    return PETSc.NullSpace().create(vectors=vectors, comm=space.mesh.comm)


def _orthonormalise(vectors: list[PETSc.Vec]) -> None:
    for i, vector in enumerate(vectors):
        for other in vectors[:i]:
            vector.axpy(-vector.dot(other), other)
        vector.normalize()
