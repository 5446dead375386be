"""Matrices with a block for each site: what changes at a site depends on the coordinates of that site alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ...typing import Array
from .site_laws import SiteLaws


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """A number for each site of one unknown, and for each site of a length a diagonal and the product of two vectors.

    Attributes:
        sites: the sites; those of lengths have N unknowns together.
        ones: the numbers, (m1,).
        diagonal: by unknown of a length, (N,).
        left: the first of the two vectors, likewise.
        right: the second one.
    """

    sites: SiteLaws
    ones: Array
    diagonal: Array
    left: Array
    right: Array

    def __matmul__(self, x: Array) -> Array:
        """The product with a vector, (n,)."""
        radials, found = self.sites.radials, np.empty_like(x)
        found[self.sites.one] = self.ones * x[self.sites.one]
        products = radials.along(self.right, x)[radials.owner]
        found[radials.flat] = self.diagonal * x[radials.flat] + self.left * products
        return found

    @property
    def sparse(self) -> csr_array:
        """The matrix, (n, n)."""
        (rows, others), places = self.sites.radials.pairs, self.sites.places
        blocks = self.left[rows] * self.right[others] + np.where(rows == others, self.diagonal[rows], 0.0)
        entries = np.concatenate([self.ones, blocks])[places.data]
        return csr_array((entries, places.indices, places.indptr), shape=places.shape)
