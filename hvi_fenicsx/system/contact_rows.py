"""The rows of Γc in a system's matrix: the only ones that laws, active sets and branches change.

J = A + W K + H. A is the bulk stiffness. W K is block-diagonal, the laws' tangents by lumped area: ∫ (K du)·v ds by
vertex quadrature. H holds unknowns by a diagonal so large that a solve leaves them where they are. All three meet in
the diagonal blocks of Γc's vertices, so that a new tangent or active set rewrites these blocks and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..typing import Array, Integers

_HOLD = 1e20
"""Times an elastic stiffness (about 1): what a held unknown moves is below rounding."""


class ContactRows:
    """The vertices of Γc that this rank owns (m of them) and their rows. Creation is collective.

    Attributes:
        dofs: their scalar unknowns, local, (m d,). bulk: their rows of A. tangent: W K, (m, d, d).
    """

    def __init__(self, matrix: PETSc.Mat, surfaces: Sequence[Surface]) -> None:
        d = matrix.getBlockSize()
        self._local = np.unique(np.concatenate([np.empty(0, np.int64), *(s.blocks for s in surfaces)])).astype(np.int64)
        self.dofs: Integers = (self._local[:, None] * d + np.arange(d)).ravel()
        start = matrix.getOwnershipRange()[0]
        rows = PETSc.IS().createGeneral((self.dofs + start).astype(PETSc.IntType), comm=matrix.comm)
        self.bulk = matrix.createSubMatrix(rows, None)
        self._product = self.bulk.createVecLeft()
        self._blocks = (self._local + start // d).astype(PETSc.IntType)[:, None]
        self._elastic = self._diagonal_blocks(matrix, d)
        self.tangent = np.zeros_like(self._elastic)

    def _diagonal_blocks(self, matrix: PETSc.Mat, d: int) -> Array:
        dofs = self._blocks * d + np.arange(d, dtype=PETSc.IntType)
        return np.array([matrix.getValues(i, i) for i in dofs], dtype=np.float64).reshape(-1, d, d)

    def set_tangent(self, terms: Sequence[LawTerm], rates: Sequence[Array]) -> None:
        """W K of the laws' K (m, d, d) by term."""
        self.tangent[:] = 0.0
        for term, k in zip(terms, rates, strict=True):
            at = np.searchsorted(self._local, term.surface.blocks)
            np.add.at(self.tangent, at, term.surface.weights[:, None, None] * k)

    def write(self, matrix: PETSc.Mat, held: npt.NDArray[np.integer]) -> None:
        """Make J of the tangent with these unknowns (local, owned) held, as far as they are Γc's. Collective."""
        values = self._elastic + self.tangent
        d = values.shape[1]
        diagonal = np.zeros(self.dofs.shape)
        diagonal[np.isin(self.dofs, held)] = _HOLD
        values[:, np.arange(d), np.arange(d)] += diagonal.reshape(-1, d)
        matrix.setValuesBlockedRCV(self._blocks, self._blocks, values)
        matrix.assemble()

    def overwrite(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """Replace these rows of a product with J by those of the product with A. Collective.

        K and H may be larger than A by any factor, and a difference of the two would leave rounding only.
        """
        self.bulk.mult(x, self._product)
        out.array[self.dofs] = self._product.array_r
