"""Geometric multigrid on the levels of a mesh hierarchy; what is held on the finest level is held on all of them.

The coarse operators are the levels' own stiffness matrices, which nested iteration has assembled: no Galerkin product
is formed. An active set or a tangent of the laws changes only the rows of Γc, on every level (:meth:`.Level.update`). A
coarse unknown that would move a held one is held too (Hackbusch and Mittelmann 1983), so that the matrices remain the
Galerkin products, except where normals turn: the cycle converges for every active set.

Small levels are on fewer ranks, the coarsest on one (:mod:`.fewer_ranks`), which alone factorises it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..problem.spaces import Dilatation
from ..typing import Entities
from .factorisation import nested, without_dilatation
from .levels import Levels
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
        self._levels, self._options = levels, options
        self.pc, self.matrix = PETSc.PC().create(system.comm), system.jacobian.matrix
        self.pc.setOptionsPrefix(prefix())
        self.pc.setType(PETSc.PC.Type.MG)
        self.pc.setMGLevels(len(levels) + 1)
        self.pc.setOperators(self.matrix)
        self._placed = _placed(system, levels)
        for number, (level, matrix) in enumerate(zip(reversed(levels), reversed(self._placed[1:]), strict=True)):
            finer = self._placed[len(levels) - number - 1]
            self.pc.setMGInterpolation(number + 1, matrix.prolongation(level.interpolation, finer))
            smoother = self.pc.getMGSmoother(number) if number else self.pc.getMGCoarseSolve()
            smoother.setOperators(matrix.matrix, matrix.matrix)
        with default_options(options):
            self.pc.setFromOptions()

    def prepare(self, held: Entities) -> None:
        """Update the coarser levels, each from the next finer one. Collective."""
        for level, matrix in zip(self._levels, self._placed[1:], strict=True):
            level.update()
            matrix.update()
        with default_options(self._options):
            self.pc.setUp()

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        for matrix in self._placed:
            matrix.free()


def _placed(system: System, levels: Levels) -> list[PlacedMatrix]:
    """The matrices of all levels, finest first, the coarsest on one rank. Collective."""
    ranks, least = system.comm.size, system.thresholds.rank_unknowns
    joined = [joined_ranks(level.system.dofs, ranks, least) for level in levels[:-1]]
    matrices = [one.jacobian.matrix for one in (system, *(level.system for level in levels))]
    return [PlacedMatrix(m, n) for m, n in zip(matrices, [1, *joined, ranks], strict=True)]


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
        rtol = thresholds.mixed_margin * self.accuracy / self._ratio
        self.accuracy = thresholds.mixed_accuracy
        most = thresholds.krylov_iterations
        self._minres.setTolerances(rtol=max(rtol, thresholds.least_mixed_accuracy), atol=0.0, max_it=most)
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


def joined_ranks(unknowns: int, ranks: int, least: int) -> int:
    """How many neighbouring ranks give their rows to the first of them, so that each that is left has enough.

    Args:
        unknowns: of the level.
        ranks: all.
        least: unknowns of a rank, on average.
    """
    left = min(ranks, max(1, unknowns // least))
    return -(-ranks // left)


class PlacedMatrix:
    """A square matrix whose rows are on some of its ranks. Creation is collective.

    Args:
        source: the matrix on all ranks.
        joined: how many neighbouring ranks give their rows to the first of them.

    Attributes:
        rows: the global numbers of the rows on this rank.
        matrix: the matrix as it is placed; the source itself where no rank gives rows away.
    """

    def __init__(self, source: PETSc.Mat, joined: int) -> None:
        self._source, self._moved = source, joined > 1
        self.rows = _rows(source, joined)
        self.matrix = source.createSubMatrix(self.rows, self.rows) if self._moved else source
        self._state = source.stateGet()

    def update(self) -> None:
        """Take over the values of the source, where they have changed. Collective."""
        if self._moved and self._source.stateGet() != self._state:
            self._source.createSubMatrix(self.rows, self.rows, self.matrix)
            self._state = self._source.stateGet()

    def prolongation(self, matrix: PETSc.Mat, finer: PlacedMatrix) -> PETSc.Mat:
        """A prolongation from this level, its rows where those of the finer level are. Collective.

        Args:
            matrix: the prolongation on all ranks.
            finer: the matrix of the finer level.
        """
        return matrix.createSubMatrix(finer.rows, self.rows) if self._moved or finer._moved else matrix

    def free(self) -> None:
        """Free the PETSc objects; the source stays. Collective."""
        self.rows.destroy()
        if self._moved:
            self.matrix.destroy()


def _rows(matrix: PETSc.Mat, joined: int) -> PETSc.IS:
    ranges, rank = matrix.getOwnershipRanges(), matrix.comm.rank
    end = min(rank + joined, matrix.comm.size) if rank % joined == 0 else rank
    return PETSc.IS().createStride(int(ranges[end] - ranges[rank]), int(ranges[rank]), 1, comm=matrix.comm)


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
        self.matrix.setBlockSize(system.problem.scales.dimension)
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
