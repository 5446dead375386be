"""The stiffness tensor of single cells, from the elastic energy itself: a new material needs nothing here."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..typing import Array, Entities
from .bulk import Bulk
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
    for (i, j), (k, m) in itertools.product(strains, strains):
        one.value[...], other.value[...] = _strain(d, k, m), _strain(d, i, j)
        entry = work.values()[cells, 0] / sizes * bulk.scales.length**d
        for a, b in {(i, j), (j, i)}:
            found[:, a, b, k, m] = found[:, a, b, m, k] = entry
    return found


def _strain(d: int, i: int, j: int) -> Array:
    """The strain whose work with a stress is its component ij."""
    strain = np.zeros((d, d))
    strain[i, j] += 0.5
    strain[j, i] += 0.5
    return strain


def on_cells(form: Any, cells: Entities) -> Any:
    """A UFL form of integrals over cells, restricted to some of them.

    Args:
        form: its subdomain data are mesh tags, or none.
        cells: local numbers.
    """
    data: list[tuple[int, Entities]] = []
    restricted = []
    for number, integral in enumerate(form.integrals(), start=1):
        data.append((number, _shared(integral, cells)))
        restricted.append(integral.reconstruct(subdomain_id=number, subdomain_data=data))
    return ufl.Form(restricted)


def _shared(integral: Any, cells: Entities) -> Entities:
    """The cells among some over which an integral goes, ascending."""
    tags, ids = integral.subdomain_data(), integral.subdomain_id()
    if tags is None:
        return np.unique(cells).astype(np.int32)
    wanted = ids if isinstance(ids, tuple) else (ids,)
    return np.intersect1d(cells, np.concatenate([tags.find(i) for i in wanted])).astype(np.int32)
