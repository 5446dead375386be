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
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc

from ..effects import Averaged
from ..runtime import forms
from ..typing import Array
from .vectors import assembled, nodal_sum


@dataclass(frozen=True)
class Dilatation:
    """The averages of one region, assembled, nondimensional.

    Attributes:
        averaged: what is averaged, as its effect contributes it.
        divergence: D, vertices by unknowns.
        stiffness: λ/V by vertex; zero at the vertices outside of the region.
    """

    averaged: Averaged
    divergence: PETSc.Mat
    stiffness: PETSc.Vec

    def matrix(self) -> PETSc.Mat:
        """Dᵀ (λ/V) D. Collective."""
        weighted = self.divergence.copy()
        weighted.diagonalScale(self.stiffness, None)
        return self.divergence.transposeMatMult(weighted)

    def _nodal_pressure(self, u: fem.Function) -> PETSc.Vec:
        average = self.divergence.createVecLeft()
        self.divergence.mult(u.x.petsc_vec, average)
        average.pointwiseMult(average, self.stiffness)
        return average

    def pressure(self, u: fem.Function) -> fem.Function:
        """The averaged volumetric stress (λ/V) D u, a P1 field, ghosts updated. Collective."""
        (scalar,) = self.averaged.volume.arguments()
        pressure = fem.Function(scalar.ufl_function_space())
        pressure.x.array[: self.stiffness.local_size] = self._nodal_pressure(u).array_r
        pressure.x.scatter_forward()
        return pressure

    def force(self, u: fem.Function) -> Array:
        """Dᵀ (λ/V) D u at the unknowns that this rank owns. Collective."""
        force = self.divergence.createVecRight()
        self.divergence.multTranspose(self._nodal_pressure(u), force)
        return np.array(force.array_r)

    def dilated(self, v: Any) -> Any:
        """The UFL form ∫ φ_i div v dx over the region.

        Args:
            v: a displacement of any space, or a sum of such.
        """
        _, vector = self.averaged.divergence.arguments()
        return ufl.replace(self.averaged.divergence, {vector: v})

    def work(self, pressure: fem.Function, v: Any) -> Any:
        """The UFL form ∫ p div v dx over the region.

        Args:
            pressure: p, a P1 field.
            v: a displacement or test function of any space.
        """
        scalar, vector = self.averaged.divergence.arguments()
        return ufl.replace(self.averaged.divergence, {scalar: pressure, vector: v})

    def across(self, pressure: fem.Function, q: Any) -> Any:
        """The UFL form ∫ p q dx over the region: what p adds to σ_33, tested with q.

        Args:
            pressure: p, a P1 field.
            q: a scalar test function.
        """
        (scalar,) = self.averaged.volume.arguments()
        return ufl.replace(self.averaged.volume, {scalar: pressure * q})

    def error(self, u: fem.Function) -> Array:
        """2μ/d ∫ (div u - p/λ)² of every owned cell, (cells,). Collective."""
        pressure, mesh = self.pressure(u), u.function_space.mesh
        q, d = ufl.TestFunction(fem.functionspace(mesh, ("Discontinuous Lagrange", 0))), mesh.geometry.dim
        scalar, vector = self.averaged.divergence.arguments()
        volume = nodal_sum(ufl.replace(self.averaged.volume, {scalar: q}))
        dilated = nodal_sum(ufl.replace(self.averaged.divergence, {scalar: q, vector: u}))
        mean = np.divide(dilated, volume, out=np.zeros_like(dilated), where=volume > 0)
        at = mean - pressure.x.array[pressure.function_space.dofmap.list[: len(mean)]] / self.averaged.modulus
        squares = np.sum(at**2, axis=1) + np.sum(at, axis=1) ** 2
        return np.asarray(self.averaged.shear / d * volume[:, 0] * squares / ((d + 1) * (d + 2)))


def assemble(averaged: Sequence[Averaged]) -> list[Dilatation]:
    """Assemble the averages that effects contribute. Collective."""
    return [_assembled(a) for a in averaged]


def _assembled(averaged: Averaged) -> Dilatation:
    divergence = assemble_matrix(forms.compiled(averaged.divergence))
    divergence.assemble()
    volume = assembled(forms.compiled(averaged.volume))
    stiffness = divergence.createVecLeft()
    v = volume.array_r
    # vertices outside of the region have no volume and average nothing
    stiffness.array[:] = np.divide(averaged.modulus, v, out=np.zeros_like(v), where=v > 0)
    return Dilatation(averaged, divergence, stiffness)


def add(matrix: PETSc.Mat, parts: Sequence[Dilatation]) -> PETSc.Mat:
    """A stiffness matrix with the volumetric part added. Collective.

    Args:
        matrix: without it; freed where a new one is needed.
        parts: the regions that are averaged.
    """
    maps: Any = matrix.getLGMap()
    for part in parts:
        wider = part.matrix()
        wider.axpy(1.0, matrix, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        wider.setBlockSize(matrix.getBlockSize())
        matrix.destroy()
        matrix = wider
        matrix.setLGMap(*maps)
    return matrix
