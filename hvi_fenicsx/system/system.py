"""A problem assembled: PETSc matrix, load, bounds and laws, in the components of its unknowns.

The bulk matrix A is assembled once. Laws and active sets touch only the diagonal blocks of Γc's vertices
(:class:`.ContactRows`). What the equations give at some unknowns is in :mod:`.equations`.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import set_bc
from mpi4py import MPI
from petsc4py import PETSc

from ..effects import load_name
from ..errors import InputError
from ..mesh.domain import Domain
from ..problem import references, scaling
from ..problem.bodies import whole
from ..problem.compose import Formulation, compose
from ..problem.problem import Problem
from ..problem.references import elastic_forces
from ..problem.vectors import assembled, new_vector, null_space, product, turn
from ..rigid import Mode, rigid_fields
from ..runtime.cost import Timer
from ..runtime.mpi import agree
from ..typing import Array, Entities
from . import existence, local_frames, rigid_motions
from .equations import Base, Equations
from .jacobian import HoldingForces, Jacobian
from .rigid_motions import FreeMotions
from .thresholds import DEFAULT, Thresholds


class System:
    """A problem's matrix, load and bounds; it owns the PETSc objects. Creation is collective.

    Args:
        problem: the problem.
        timer: where time goes.
        thresholds: the numbers that tune how it is solved.

    Attributes:
        problem: what was assembled.
        thresholds: the numbers that tune how it is solved.
        frames: local frames of vertices with slanted normals; None where there are none.
        rotation: the matrix Q with u = Q û for unknowns û in local components; None likewise.
        terms: the problem's laws, in the unknowns' components.
        bounds: the problem's bounds, likewise.
        jacobian: the bulk stiffness with the laws' tangent and the held unknowns.
        equations: residual, tangent and energy.
        load: b, lifted; the Dirichlet rows contain the prescribed values.
        lower: lower bounds of u; infinite on Dirichlet rows.
        upper: upper bounds, likewise.
        references: what residuals are relative to, by body.
        forces: the assembled load vectors by name, unlifted (for the virtual work of rigid motions).
        pushing: the sum of those that do work on rigid motions, Cartesian, (vertices, d).
        free_motions: the rigid motions that nothing holds and no load moves; None where there are none.
        holding: the rows of the elastic operator at prescribed unknowns.
    """

    def __init__(self, problem: Problem, timer: Timer, thresholds: Thresholds = DEFAULT) -> None:
        self.problem, self.thresholds = problem, thresholds
        self.frames = local_frames.frames_of(problem)
        self.free_motions: FreeMotions | None = None
        with timer("assembly"):
            self.forces = {name: assembled(form) for name, form in problem.loads.items()}
            self._loads = self._sum_of(self.forces)
            stiffness, self.load, pull = self._constrained()
            stiffness, self.rotation = self._in_local_components(stiffness)
            self.terms = tuple(map(self.frames.term, problem.terms))
            self.bounds = tuple(map(self.frames.bounds, problem.bounds))
            self.jacobian = Jacobian(stiffness, self.terms, self.bounds)
            self.references = references.of(problem, self._loads)
            self.pushing = self._sum_of(existence.loads_of_rigid_motions(problem, self.forces))
        self.equations = Equations(self.jacobian, self.terms, self._first_base(pull))
        self.lower, self.upper = self._box()

    @property
    def comm(self) -> MPI.Comm:
        """The communicator."""
        return self.problem.comm

    @property
    def dofs(self) -> int:
        """Global number of unknowns."""
        return int(self.load.size)

    def attach_free_motions(self, modes: Sequence[Mode]) -> None:
        """Make rigid motions the matrix's null space, and remove what rounding left of them in the load. Collective."""
        if not modes:
            return
        vectors = [self.unknowns(field) for field in rigid_motions.fields(self.problem, modes)]
        self.free_motions = rigid_motions.create(vectors, modes)
        self.jacobian.matrix.setNullSpace(self.free_motions.null_space)
        residual = self.load.duplicate()
        residual.array[:] = self.equations.base.residual
        for vector in (self.load, residual):
            self.free_motions.null_space.remove(vector)
        self.equations.base.residual[:] = residual.array_r
        residual.destroy()

    @property
    def pins(self) -> Entities:
        """Dofs at which free motions are pinned: their equations follow from all others."""
        return self.free_motions.pins if self.free_motions else np.empty(0, np.int32)

    @cached_property
    def near_null(self) -> PETSc.NullSpace:
        """The rigid motions without supports, which algebraic multigrid must keep. Collective when first used."""
        body, vectors = whole(self.problem.domain), []
        fields = rigid_fields(self.problem.points / self.problem.scales.length, body)
        for number in range(body.motions):
            vectors.append(self.turned(self.problem.relative(fields[:, number].ravel())[: self.load.local_size]))
        return null_space(vectors)

    @cached_property
    def contact_axes(self) -> Array:
        """The local axes at the vertices of Γc that this rank owns, as rows, (m, d, d)."""
        return self.frames.at(self.jacobian.rows.vertices)

    def _in_local_components(self, stiffness: PETSc.Mat) -> tuple[PETSc.Mat, PETSc.Mat | None]:
        """Stiffness in local components, and the rotation; the load is rotated in place. Collective."""
        if not any(agree(self.comm, len(self.frames.blocks))):
            return stiffness, None
        q = self.frames.matrix(self.problem, stiffness)
        rows, columns = stiffness.getLGMap()
        rotated = stiffness.ptap(q)
        rotated.setLGMap(rows, columns)
        stiffness.destroy()
        turn(self.load, q)
        return rotated, q

    def with_obstacles_of(self, problem: Problem) -> System:
        """The system with the obstacles where another problem of the same body has them; all matrices are shared.

        Collective.

        Args:
            problem: the other problem.
        """
        found = copy.copy(self)
        found.problem = problem
        found.bounds = tuple(map(self.frames.bounds, problem.bounds))
        found.references = references.of(found.problem, self._loads)
        found.lower, found.upper = found._box()
        return found

    def evaluate_by_cells(self, x: PETSc.Vec) -> None:
        """Evaluate elastic forces by cells at some unknowns; from there on the matrix gives their changes. Collective.

        Args:
            x: the unknowns.
        """
        if all(agree(self.comm, np.array_equal(x.array_r, self.equations.base.x.array_r))):
            return
        internal = self.problem.combined(elastic_forces(self.problem, self.displacement(x)))
        elastic, residual = (self.turned(forces) for forces in (internal, internal - self._loads))
        fixed = self.problem.fixed_here
        residual.array[fixed] = x.array_r[fixed] - self.load.array_r[fixed]
        if self.free_motions is not None:
            self.free_motions.null_space.remove(residual)
        self.equations.begin_at(x, np.array(elastic.array_r), np.array(residual.array_r))
        for vector in (elastic, residual):
            vector.destroy()

    def _first_base(self, pull: PETSc.Vec) -> Base:
        """The body that is undisplaced but for prescribed values, which pull with these forces. Collective."""
        x, residual = self.undisplaced(), -self.load.array_r
        residual[self.problem.fixed_here] = 0.0
        turn(pull, self.rotation)
        elastic = np.array(pull.array_r)
        pull.destroy()
        return Base(x, elastic, residual)

    def turned(self, vectors: Array) -> PETSc.Vec:
        """Cartesian vectors in the components of the unknowns. Collective.

        Args:
            vectors: at the owned nodes, (nodes, d).
        """
        found = self.load.duplicate()
        found.array[:] = vectors.ravel()
        turn(found, self.rotation)
        return found

    def displacement(self, x: PETSc.Vec) -> fem.Function:
        """The displacement field of unknowns x: Cartesian, in units of u0, ghosts updated. Collective."""
        u = fem.Function(self.problem.space, name="displacement")
        coupling = self.problem.coupling
        u.x.array[: x.local_size] = product(x, self.rotation, coupling and coupling.matrix)
        u.x.scatter_forward()
        return u

    def unknowns(self, u: fem.Function) -> PETSc.Vec:
        """The unknowns of a displacement field (in units of u0). Collective."""
        return self.turned(self.problem.relative(u.x.array)[: self.load.local_size])

    def prescribe(self, x: PETSc.Vec) -> None:
        """Give the prescribed unknowns of x their values. Local."""
        x.array[self.problem.fixed_here] = self.load.array_r[self.problem.fixed_here]

    def unprescribed(self) -> PETSc.Vec:
        """1 for the unknowns that are not prescribed, else 0. Collective."""
        mask = self.load.duplicate()
        mask.set(1.0)
        mask.array[self.problem.fixed_here] = 0.0
        return mask

    def undisplaced(self) -> PETSc.Vec:
        """A new x: the prescribed values, and zero elsewhere. Collective."""
        x = self.load.duplicate()
        x.set(0.0)
        self.prescribe(x)
        return x

    def _sum_of(self, forces: Mapping[str, PETSc.Vec]) -> Array:
        """The sum of some load vectors as bounds and laws balance it, (vertices, d). Collective."""
        total = np.zeros((self.problem.space.dofmap.index_map.size_local, self.problem.dimension))
        for force in forces.values():
            total += force.array_r.reshape(total.shape)
        return self.problem.combined(total)

    def holding_forces(self, x: PETSc.Vec) -> Array:
        """The elastic forces that supports, contact and laws take up; zero elsewhere, (n,). Collective."""
        at = np.union1d(self.jacobian.rows.dofs, self.problem.fixed_here)
        found = self.holding.at(self.equations.from_base(x), self.rotation, self.jacobian.rows)
        found[at] += self.equations.base.elastic[at]
        return found

    def _coupled(self, stiffness: PETSc.Mat) -> PETSc.Mat:
        """The stiffness of the unknowns, Cartesian: Tᵀ A T where bodies meet. Collective."""
        if self.problem.coupling is None:
            return stiffness
        coupled = stiffness.ptap(self.problem.coupling.matrix)
        coupled.setLGMap(*stiffness.getLGMap())
        coupled.setBlockSize(self.problem.dimension)
        stiffness.destroy()
        return coupled

    def _constrained(self) -> tuple[PETSc.Mat, PETSc.Vec, PETSc.Vec]:
        """The stiffness, prescribed rows and columns those of the identity; the load, lifted, and what lifts it.

        The load is as bounds and laws balance it, Cartesian. Collective.
        """
        matrix = self._coupled(self.problem.bulk.matrix())
        load, prescribed = new_vector(self.problem.space), new_vector(self.problem.space)
        self.holding, fixed = HoldingForces(self.problem, matrix), self.problem.fixed_here
        set_bc(prescribed, [one.condition for one in self.problem.prescribed])
        pull = self.holding.pull(prescribed)
        load.array[:] = self._loads.ravel() - pull.array_r
        load.array[fixed] = prescribed.array_r[fixed]
        matrix.zeroRowsColumns((fixed + load.owner_range[0]).astype(PETSc.IntType), 1.0)
        prescribed.destroy()
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        return matrix, load, pull

    def _box(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Lower and upper bounds of the unknowns. Collective."""
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

    def free_leftovers(self) -> None:
        """Free PETSc objects that no rank refers to any more: on several ranks Python alone frees none. Collective."""
        PETSc.garbage_cleanup(self.comm)
        PETSc.garbage_cleanup(self.problem.space.dofmap.index_map.comm)  # dolfinx's vectors are on this one

    def free(self) -> None:
        """Free the PETSc objects, also those that systems made of this one share, and what solving left. Collective."""
        for vector in (self.load, self.lower, self.upper, *self.forces.values()):
            vector.destroy()
        if self.rotation is not None:
            self.rotation.destroy()
        self.equations.free()
        self.jacobian.free()
        self.holding.free()
        self.problem.forget()
        self.free_leftovers()


def assemble(domain: Domain, model: Formulation, timer: Timer, thresholds: Thresholds = DEFAULT) -> System:
    """Compose a model on a domain, compile its forms and assemble them. Collective.

    Args:
        domain: the body and its mesh.
        model: the effects and their places.
        timer: where time goes.
        thresholds: the numbers that tune how it is solved.

    Raises:
        InputError: the model does not fit the mesh, on all ranks alike.
    """
    with timer("jit"):
        problem = compose(domain, model)
        problem.compile()
    system = System(problem, timer, thresholds)
    stated = [(where, effect) for where, effect, _ in problem.contributions]
    for name, force in system.forces.items():
        if not np.isfinite(force.norm()):
            place = next(scaling.place(p) for p in stated if load_name(*p) == name)
            raise InputError(f"{place}: the formula is not finite everywhere there, between the vertices of the mesh")
    return system
