"""Nodally averaged dilatation: linear triangles and tetrahedra that do not lock as ν tends to ½.

The volumetric energy ½ λ ∫ (div u)² is taken of the average of div u around each vertex instead of its value in each
cell (Bonet and Burton 1998, average nodal pressure): with (Du)_i = ∫ φ_i div u dx and V_i = ∫ φ_i dx it is
½ λ Σ (Du)_i²/V_i. One condition a vertex instead of one a cell; the displacement, and so its trace on Γc, stays P1. The
stencil reaches one vertex further.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc

from ..effects.base import Averaged
from ..typing import Array
from .vectors import assembled


@dataclass(frozen=True)
class Dilatation:
    """Assembled averages of one region: D (vertices by unknowns) and λ/V, nondimensional."""

    divergence: PETSc.Mat
    stiffness: PETSc.Vec

    def matrix(self) -> PETSc.Mat:
        """Dᵀ (λ/V) D. Collective."""
        weighted = self.divergence.copy()
        weighted.diagonalScale(self.stiffness, None)
        return self.divergence.transposeMatMult(weighted)

    def _pressure(self, u: fem.Function) -> PETSc.Vec:
        average = self.divergence.createVecLeft()
        self.divergence.mult(u.x.petsc_vec, average)
        average.pointwiseMult(average, self.stiffness)
        return average

    def pressure(self, u: fem.Function) -> Array:
        """(λ/V) D u at the vertices that this rank owns. Collective."""
        return np.array(self._pressure(u).array_r)

    def force(self, u: fem.Function) -> Array:
        """Dᵀ (λ/V) D u at the unknowns that this rank owns. Collective."""
        force = self.divergence.createVecRight()
        self.divergence.multTranspose(self._pressure(u), force)
        return np.array(force.array_r)


def assemble(averaged: Sequence[Averaged]) -> list[Dilatation]:
    """Assemble the averages that effects contribute. Collective."""
    return [_assembled(a) for a in averaged]


def _assembled(averaged: Averaged) -> Dilatation:
    divergence = assemble_matrix(fem.form(averaged.divergence))
    divergence.assemble()
    volume = assembled(fem.form(averaged.volume))
    stiffness = divergence.createVecLeft()
    v = volume.array_r
    # vertices outside of the region have no volume and average nothing
    stiffness.array[:] = np.divide(averaged.modulus, v, out=np.zeros_like(v), where=v > 0)
    return Dilatation(divergence, stiffness)


def add(matrix: PETSc.Mat, parts: Sequence[Dilatation]) -> PETSc.Mat:
    """A stiffness with the volumetric part added; the given one is freed where a new one is needed. Collective."""
    maps: Any = matrix.getLGMap()
    for part in parts:
        wider = part.matrix()
        wider.axpy(1.0, matrix, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        wider.setBlockSize(matrix.getBlockSize())
        matrix.destroy()
        matrix = wider
        matrix.setLGMap(*maps)
    return matrix
