"""The stiffness tensor of single cells, from the elastic energy itself: a new material needs nothing here."""

from __future__ import annotations

import itertools

import numpy as np
import ufl
from dolfinx import fem

from ..typing import Array, Entities
from .bulk import Bulk
from .chosen_cells import on_cells
from .vectors import LinearForm


def stiffness_tensor(bulk: Bulk, cells: Entities) -> Array:
    """C_ijkl of owned cells, nondimensional, (c, d, d, d, d). Collective.

    It is the work of the stress of one uniform strain in another one, over the cell's size. A uniform dilatation is its
    own average by vertex.

    Args:
        bulk: the elastic operator.
        cells: the owned cells; no other is looked at.
    """
    mesh, d = bulk.space.mesh, bulk.scales.dimension
    one, other = (fem.Constant(mesh, np.zeros((d, d))) for _ in range(2))
    whole = on_cells(bulk.uniform_work(one, other), cells)
    size = on_cells(bulk.in_cells(ufl.dx(domain=mesh)), cells)
    sizes, work = LinearForm(size).values()[cells, 0], LinearForm(whole)
    found = np.zeros((len(cells), *[d] * 4))
    strains = list(itertools.combinations_with_replacement(range(d), 2))
    for (i, j), (k, m) in itertools.combinations_with_replacement(strains, 2):
        one.value[...], other.value[...] = _strain(d, k, m), _strain(d, i, j)
        entry = work.values()[cells, 0] / sizes * bulk.scales.length**d
        for (a, b), (p, q) in itertools.product({(i, j), (j, i)}, {(k, m), (m, k)}):
            found[:, a, b, p, q] = found[:, p, q, a, b] = entry
    return found


def _strain(d: int, i: int, j: int) -> Array:
    """The strain whose work with a stress is its component ij."""
    strain = np.zeros((d, d))
    strain[i, j] += 0.5
    strain[j, i] += 0.5
    return strain
