"""Relative displacements as unknowns: u = T û, where û holds w = u_first - P u_second at the vertices of interfaces.

At all other vertices û is u. Bounds, laws, supports, the certificate and the rigid motions see û and its forces Tᵀf, so
an interface is to them what a part of the boundary is. T⁻¹ has the rows of :mod:`.dual_basis`; the vertices that they
combine are none of interfaces' own, so T has as few entries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import csr_array, diags_array, eye_array, kron

from ..typing import Array
from .interfaces import Interface, whole_rows


@dataclass(frozen=True)
class Coupling:
    """The way between displacements u and unknowns û, both in Cartesian components.

    Attributes:
        space: of the displacements.
        matrix: T.
        inverse: T⁻¹.
    """

    space: fem.FunctionSpace
    matrix: PETSc.Mat
    inverse: PETSc.Mat

    def relative(self, u: Array) -> Array:
        """T⁻¹ u of a local array, of which the owned values count; a local array. Collective."""
        return self._local(self.inverse.mult, u)

    def forces(self, values: Array) -> Array:
        """Tᵀ f: forces on u, at the owned vertices (n, d), as forces on û. Collective."""
        return self._local(self.matrix.multTranspose, values)[: values.size].reshape(values.shape)

    def forces_on_bodies(self, values: Array) -> Array:
        """T⁻ᵀ f: forces on û, at the owned vertices (n, d), as forces on the vertices of the bodies. Collective."""
        return self._local(self.inverse.multTranspose, values)[: values.size].reshape(values.shape)

    def _local(self, product: object, values: Array) -> Array:
        """A product with a local array, as a local array with ghosts updated."""
        function = fem.Function(self.space)
        right, left = self.matrix.createVecs()
        right.array[:] = values.ravel()[: right.local_size]
        product(right, left)  # type: ignore[operator]
        function.x.array[: left.local_size] = left.array_r
        function.x.scatter_forward()
        right.destroy()
        left.destroy()
        return np.array(function.x.array)


def of(space: fem.FunctionSpace, interfaces: Sequence[Interface]) -> Coupling | None:
    """The coupling of interfaces; None where there are none. Collective.

    Args:
        space: of the displacements.
        interfaces: none of whose nodes with weights is combined by another.
    """
    if not interfaces:
        return None
    size, (start, end) = space.dofmap.index_map.size_global, space.dofmap.index_map.local_range
    inverse, forward = (csr_array(eye_array(size, format="csr")[start:end]) for _ in range(2))
    for rows, diagonal in whole_rows(interfaces, size):
        own = diags_array(diagonal[start:end], offsets=0) @ eye_array(size, format="csr")[start:end]
        rest, scale = rows[start:end] - own, diagonal[start:end]
        unit = diags_array((scale != 0.0).astype(float), offsets=0) @ eye_array(size, format="csr")[start:end]
        over = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale != 0.0)
        inverse = inverse + rest + own - unit
        forward = forward - diags_array(over, offsets=0) @ (rest - unit) - unit
    return Coupling(space, _petsc_matrix(space, forward), _petsc_matrix(space, inverse))


def _petsc_matrix(space: fem.FunctionSpace, rows: csr_array) -> PETSc.Mat:
    """A matrix over vertices as one over their vectors, component by component. Collective."""
    d, index_map = space.dofmap.index_map_bs, space.dofmap.index_map
    whole = csr_array(kron(csr_array(rows), np.eye(d), format="csr"))
    whole.eliminate_zeros()
    whole.sort_indices()
    size = index_map.size_local * d, index_map.size_global * d
    arrays = whole.indptr.astype(PETSc.IntType), whole.indices.astype(PETSc.IntType), whole.data
    matrix = PETSc.Mat().createAIJ((size, size), bsize=d, csr=arrays, comm=space.mesh.comm)
    matrix.assemble()
    return matrix
