"""The equations of a nearly incompressible body with its averaged pressures as unknowns.

With p = (λ/V) D u (:mod:`..problem.nodal_averaging`) the equations (S + Dᵀ (λ/V) D) u = f, S being all but the
volumetric part, are those of a saddle point:

    S u + Dᵀ p = f,    D u - (V/λ) p = 0.

Its matrix has as many negative eigenvalues more than that of the displacements as there are pressures (Sylvester).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..problem.nodal_averaging import Dilatation
from ..runtime.timing import Timer
from .system import System


def without_dilatation(system: System) -> System:
    """The system without the volumetric part. Collective.

    Args:
        system: of a body whose div u is averaged.
    """
    problem = replace(system.problem, bulk=system.problem.bulk.without_dilatation())
    return System(problem, Timer(), system.thresholds)


def nested(system: System, shear: System, parts: Sequence[Dilatation]) -> PETSc.Mat:
    """The matrix of displacements and pressures, in blocks. Collective.

    Args:
        system: the system.
        shear: the same without the volumetric part; its matrix is the first block.
        parts: the regions that are averaged.
    """
    divergences = [_in_unknowns(part.divergence, system) for part in parts]
    transposed, compliances = [d.transpose(PETSc.Mat()) for d in divergences], [_compliance(part) for part in parts]
    rows = [
        [d, *(compliance if i == k else None for i in range(len(parts)))]
        for k, (d, compliance) in enumerate(zip(divergences, compliances, strict=True))
    ]
    found = PETSc.Mat().createNest([[shear.jacobian.matrix, *transposed], *rows], comm=system.comm)
    for block in (*divergences, *transposed, *compliances):
        block.destroy()  # they are found's alone
    return found


def _in_unknowns(divergence: PETSc.Mat, system: System) -> PETSc.Mat:
    """D of the system's unknowns; prescribed ones have no part in it. Collective."""
    coupling, found = system.problem.coupling, divergence.copy()
    for step in (coupling and coupling.matrix, system.rotation):
        if step is not None:
            product = found.matMult(step)
            found.destroy()
            found = product
    mask = system.load.duplicate()
    mask.set(1.0)
    mask.array[system.problem.fixed_here] = 0.0
    found.diagonalScale(None, mask)
    mask.destroy()
    return found


def _compliance(part: Dilatation) -> PETSc.Mat:
    """-V/λ; -1 at the vertices outside of the region, whose pressure is zero. Collective."""
    rate, found = part.stiffness.array_r, part.stiffness.duplicate()
    found.array[:] = -np.divide(1.0, rate, out=np.ones_like(rate), where=rate > 0)
    sizes = part.stiffness.getSizes()
    matrix = PETSc.Mat().createAIJ((sizes, sizes), nnz=(1, 0), comm=found.comm)
    matrix.setDiagonal(found)
    matrix.assemble()
    found.destroy()
    return matrix
