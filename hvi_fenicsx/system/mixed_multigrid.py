"""Geometric multigrid for nearly incompressible bodies: displacements and averaged pressures are solved for together.

MINRES solves the equations of a saddle point (:mod:`.saddle_point`), S u + Dᵀ p = f and D u - (V/λ) p = 0,
preconditioned by multigrid for S and by V (1/λ + 1/μ) for the pressures. At degree 2 displacements and pressures are
those of Taylor and Hood's element, and its iterations depend neither on the mesh nor on ν (Elman, Silvester and Wathen
2014, Finite elements and fast iterative solvers, chapter 4). At degree 1 the pressures are not stable: the iterations
grow with λ/μ, but not with the mesh.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from petsc4py import PETSc

from ..problem.nodal_averaging import Dilatation
from ..typing import Entities
from .applied_by import applied_by
from .levels import Levels
from .multigrid import Multigrid
from .petsc_options import prefix
from .saddle_point import nested, without_dilatation
from .system import System


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
        most = thresholds.mixed_iterations
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
