"""Geometric multigrid on the levels of a mesh hierarchy; what is held on the finest level is held on all of them.

The coarse operators are the levels' own stiffness matrices, which nested iteration has assembled: no Galerkin product
is formed. An active set or a tangent of the laws changes only the rows of Γc, on every level (:meth:`.Level.update`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products, except where normals turn: the cycle converges for every active set.

The coarsest level is gathered on one rank, which alone factorises it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..mesh import nodes
from ..mesh.transfer import Transfer
from ..problem.spaces import Dilatation
from ..typing import Array, Entities
from .factorisation import nested, without_dilatation
from .jacobian import rows_of
from .petsc_options import applied_by, default_options, prefix
from .system import System


class Multigrid:
    """The multigrid preconditioner of a system. Creation is collective.

    Its levels and their memory stay when the active set changes: values are written anew, and the coarsest matrix is
    factorised again if it has changed.

    Args:
        system: the system on the finest level.
        levels: the coarser levels, finest first.
        options: defaults of the PC's options.

    Attributes:
        pc: the PC.
        matrix: the system's matrix, which it preconditions.
    """

    def __init__(self, system: System, levels: Levels, options: Mapping[str, object]) -> None:
        gathered = {"mg_coarse_pc_telescope_reduction_factor": system.comm.size}
        self._levels, self._options = levels, {**gathered, **options}
        self.pc, self.matrix = PETSc.PC().create(system.comm), system.jacobian.matrix
        self.pc.setOptionsPrefix(prefix())
        self.pc.setType(PETSc.PC.Type.MG)
        self.pc.setMGLevels(len(levels) + 1)
        self.pc.setOperators(self.matrix)
        for number, level in enumerate(reversed(levels)):
            self.pc.setMGInterpolation(number + 1, level.interpolation)
            smoother = self.pc.getMGSmoother(number) if number else self.pc.getMGCoarseSolve()
            smoother.setOperators(level.system.jacobian.matrix)
        with default_options(self._options):
            self.pc.setFromOptions()

    def prepare(self, held: Entities) -> None:
        """Update the coarser levels, each from the next finer one. Collective."""
        for level in self._levels:
            level.update()
        with default_options(self._options):
            self.pc.setUp()

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()


class MixedMultigrid:
    """A solve for displacements and pressures, as a preconditioner of the system's matrix. Creation is collective.

    What MINRES leaves of D u = (V/λ) p is a force λ/μ times as large, so an application is exact but for
    ``accuracy`` only if MINRES is more accurate by that factor. It is not quite linear: the Krylov method around it
    has to be a flexible one.

    Args:
        system: the system on the finest level.
        levels: the coarser levels, finest first.
        options: defaults of the multigrid's options.

    Attributes:
        pc: the PC.
        matrix: the system's matrix, which it preconditions.
        accuracy: the relative residual that the next application leaves; further ones refine a solution.
        iterations: of all applications so far.
    """

    def __init__(self, system: System, levels: Levels, options: Mapping[str, object]) -> None:
        self._system, self.matrix = system, system.jacobian.matrix
        self._parts = system.problem.bulk.dilatations
        self._ratio = system.problem.bulk.volumetric_ratio
        self._shears, below = _without_dilatation(system, levels)
        self._multigrid = Multigrid(self._shears[0], below, options)
        self._saddle_point = nested(system, self._shears[0], self._parts)
        vectors = [system.load.duplicate(), *(p.stiffness.duplicate() for p in self._parts)]
        self._given = PETSc.Vec().createNest(vectors, comm=system.comm)
        self._found = self._given.duplicate()
        self._minres = self._solver()
        self.accuracy, self.iterations = system.thresholds.mixed_accuracy, 0
        self.pc = applied_by(self, self.matrix)

    def _solver(self) -> PETSc.KSP:
        minres = PETSc.KSP().create(self._system.comm)
        minres.setOptionsPrefix(f"{prefix()}mixed_")
        minres.setOperators(self._saddle_point)
        minres.setType(PETSc.KSP.Type.MINRES)
        minres.getPC().setType(PETSc.PC.Type.PYTHON)
        minres.getPC().setPythonContext(_Blocks(self._multigrid, [_schur_complement(p) for p in self._parts]))
        minres.setFromOptions()
        return minres

    def prepare(self, held: Entities) -> None:
        """Take over the system's tangent, hold these unknowns (local, owned, sorted). Collective."""
        self._shears[0].jacobian.set_restricted(self._system.jacobian.rows.tangent, held)
        self._multigrid.prepare(held)

    def apply(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve for y of the load x. Collective.

        Args:
            x: the load.
            y: where the displacement is written.
        """
        thresholds = self._system.thresholds
        rtol = thresholds.mixed_accuracy * self.accuracy / self._ratio
        self.accuracy = thresholds.mixed_accuracy
        most = thresholds.krylov_iterations
        self._minres.setTolerances(rtol=max(rtol, thresholds.rounding), atol=0.0, max_it=most)
        self._given.set(0.0)
        self._given.getNestSubVecs()[0].array[:] = x.array_r
        self._minres.solve(self._given, self._found)
        y.array[:] = self._found.getNestSubVecs()[0].array_r
        self.iterations += int(self._minres.getIterationNumber())

    def free(self) -> None:
        """Free the PETSc objects."""
        self._multigrid.free()
        for thing in (self.pc, self._minres, self._saddle_point, self._given, self._found):
            thing.destroy()
        for shear in self._shears:
            shear.free()


class _Blocks:
    """The block-diagonal preconditioner: multigrid for the displacements, a diagonal for the pressures of each region.

    Args:
        multigrid: for the displacements.
        compliances: the inverse diagonals.
    """

    def __init__(self, multigrid: Multigrid, compliances: list[PETSc.Vec]) -> None:
        self._multigrid, self._compliances = multigrid, compliances

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply it, y = P^-1 x."""
        (force, *dilatations), (displacement, *pressures) = x.getNestSubVecs(), y.getNestSubVecs()
        self._multigrid.pc.apply(force, displacement)
        for pressure, compliance, dilatation in zip(pressures, self._compliances, dilatations, strict=True):
            pressure.pointwiseMult(compliance, dilatation)

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the diagonals: petsc4py calls this where the PC is freed."""
        for compliance in self._compliances:
            compliance.destroy()


def _without_dilatation(system: System, levels: Levels) -> tuple[list[System], Levels]:
    """The system and those of its coarser levels without the volumetric part, and these levels. Collective."""
    systems = [without_dilatation(one) for one in (system, *(level.system for level in levels))]
    pairs = zip(itertools.pairwise(systems), levels, strict=True)
    return systems, tuple(level.of_systems(finer, coarser) for (finer, coarser), level in pairs)


def _schur_complement(part: Dilatation) -> PETSc.Vec:
    """The inverse of V (1/λ + 1/μ), by vertex; 1 outside of the region."""
    rate, found = part.stiffness.array_r, part.stiffness.duplicate()
    found.array[:] = np.where(rate > 0, rate / (1.0 + part.averaged.ratio), 1.0)
    return found


class Algebraic:
    """A copy of the system's matrix with some unknowns held, and its preconditioner. Creation is collective.

    The levels depend on the values of the matrix: they are made anew with it.

    Args:
        system: the system; where motions are free, their pins are always held.
        options: defaults of the PC's options.

    Attributes:
        pc: the PC.
        matrix: the copy that it preconditions.
    """

    def __init__(self, system: System, options: Mapping[str, object]) -> None:
        self._system, self._options = system, options
        self.pc, self.matrix = self._new(), system.jacobian.matrix.copy()
        self.matrix.setBlockSize(system.problem.dimension)
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self.matrix.setOption(PETSc.Mat.Option.SPD, True)
        self.matrix.setNearNullSpace(system.near_null)

    def prepare(self, held: Entities) -> None:
        """Copy the system's present matrix, hold these unknowns (local, owned, sorted), set up the PC. Collective."""
        self._system.jacobian.matrix.copy(self.matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        rows = np.union1d(held, self._system.pins) + self._system.load.owner_range[0]
        self.matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        self.pc.destroy()
        self.pc = self._new()
        with default_options(self._options):
            self.pc.setOperators(self.matrix)
            self.pc.setFromOptions()
            self.pc.setUp()

    def _new(self) -> PETSc.PC:
        pc = PETSc.PC().create(self._system.comm)
        pc.setOptionsPrefix(prefix())
        return pc

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        self.matrix.destroy()


class Level:
    """A level and the next finer one.

    Attributes:
        finer: the system on the next finer level.
        system: the system on this level.
        prolongation: from this level's unknowns to those of the finer one.
    """

    def __init__(self, finer: System, system: System, prolongation: PETSc.Mat) -> None:
        self.finer, self.system, self.prolongation = finer, system, prolongation

    def of_systems(self, finer: System, system: System) -> Level:
        """The same level of other systems that have these unknowns, prescribed ones and parts of Γc too. Collective.

        Args:
            finer: on the next finer level.
            system: on this level.
        """
        found = Level(finer, system, self.prolongation)
        found.interpolation = self.interpolation
        return found

    @cached_property
    def interpolation(self) -> PETSc.Mat:
        """The prolongation without the unknowns prescribed on either level. Collective when first used.

        Held unknowns keep their weights in it: their large diagonal leaves them as they are on every level.
        """
        found = self.prolongation.copy()
        found.diagonalScale(self.finer.unprescribed(), self.system.unprescribed())
        return found

    @cached_property
    def _traces(self) -> PETSc.Mat:
        """Its rows of Γc. Collective when first used."""
        return rows_of(self.interpolation, self.finer.jacobian.rows.dofs)

    def _restricted(self, values: npt.NDArray[Any]) -> Array:
        """Values at the finer level's unknowns of Γc, restricted to the unknowns there on this one. Collective."""
        given, found = self._traces.createVecLeft(), self.system.load.duplicate()
        given.array[:] = values
        self._traces.multTranspose(given, found)
        return found.array_r[self.system.jacobian.rows.dofs]

    def update(self) -> None:
        """Take over the finer level's tangent and held unknowns. Collective.

        W K is restricted and lumped: what it makes of a displacement that is the same at all vertices, which in
        components of the local frames is none, where these turn along the part or at its corners. A coarse unknown is
        held where it moves a held fine one (Hackbusch and Mittelmann 1983), so that J remains the finer level's
        Galerkin product, and the body as well supported. On a curved part the tangent at a vertex has a small component
        along its neighbour's normal: unknowns of such small weight are not held, since that would keep the coarse body
        from sliding.
        """
        fine, own = self.finer.jacobian, self.system.jacobian
        forces, moved = fine.rows.tangent @ self.finer.contact_axes, np.empty_like(own.rows.tangent)
        for direction in range(moved.shape[2]):
            moved[:, :, direction] = self._restricted(forces[:, :, direction].ravel()).reshape(moved.shape[:2])
        weights = np.abs(self._restricted(np.isin(fine.rows.dofs, fine.held)))
        held = own.rows.dofs[weights > self.finer.thresholds.held_weight].astype(np.int32)
        own.set_restricted(moved @ self.system.contact_axes.transpose(0, 2, 1), held)

    def free(self) -> None:
        """Free the system and the way to it; what other problems on the mesh share stays. Collective."""
        for name in ("interpolation", "_traces", "prolongation"):
            self.__dict__.pop(name, None)
        self.system.free()


Levels = tuple[Level, ...]
"""The coarser levels of a system, the finest of them first; the system of each is ``finer`` of the next."""


def prolongation(fine: System, coarse: System, transfer: Transfer) -> PETSc.Mat:
    """The prolongation between the unknowns of two systems, in their local components. Collective.

    Args:
        fine: the finer system.
        coarse: the system on the next coarser mesh.
        transfer: the transfer from the coarser mesh to the finer one.
    """
    to, origin = fine.problem, coarse.problem
    name = f"prolongation from degree {nodes.degree(origin.space)}"
    step = to.once(name, None, lambda: transfer.prolongation(to.space, origin.space))
    if origin.coupling is not None:
        step = step.matMult(origin.coupling.matrix)
    if to.coupling is not None:
        step = to.coupling.inverse.matMult(step)
    if coarse.rotation is not None:
        step = step.matMult(coarse.rotation)
    return step if fine.rotation is None else fine.rotation.transposeMatMult(step)


def with_coarser_system(finer: System, coarser: System, levels: Levels, step: PETSc.Mat) -> Levels:
    """The coarser levels of a system; the coarser system is left out where it is of nearly the same size. Collective.

    The unknowns must grow by a factor from level to level, or a multigrid cycle costs more than a few sweeps of the
    finest level.

    Args:
        finer: the system.
        coarser: the system on the next coarser mesh.
        levels: the coarser levels of that one.
        step: the prolongation from its unknowns.
    """
    if not levels or step.size[0] >= finer.thresholds.level_growth * levels[0].prolongation.size[1]:
        return (Level(finer, coarser, step), *levels)
    return (Level(finer, levels[0].system, step.matMult(levels[0].prolongation)), *levels[1:])
