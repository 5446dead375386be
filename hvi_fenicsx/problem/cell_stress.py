"""The mean stress of each cell, from the elastic operator itself: a new material needs nothing here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem

from ..typing import Array
from . import stress
from .bulk import Bulk
from .vectors import nodal_sum


def mean_stress(bulk: Bulk, u: fem.Function) -> Array:
    """The mean stress of every owned cell, N/m², tension positive; shape (cells, 3, 3). Collective.

    With v = q·x, q being constant in one cell and zero elsewhere, ε(v) is the symmetric part of q, and the stress does
    the work |K| σ:q in it. σ_33 is zero in plane stress, and what holds the thickness in plane strain. Where div u is
    averaged by vertex, so is the volumetric stress.

    Args:
        bulk: the elastic operator.
        u: the displacement, in units of u0, ghosts updated.
    """
    mesh, scales = bulk.space.mesh, bulk.scales
    one = basix.ufl.element("Discontinuous Lagrange", mesh.topology.cell_name(), 0)
    count = len(stress.COMPONENTS[scales.dimension]) + 2
    *q, across, volume = ufl.TestFunction(fem.functionspace(mesh, basix.ufl.blocked_element(one, (count,))))
    pressures = bulk.pressures(u)
    v = stress.linear_field(q, ufl.SpatialCoordinate(mesh)) / scales.length
    found = nodal_sum(sum(_across(bulk, u, pressures, across), _work(bulk, u, pressures, v)))
    found /= nodal_sum(volume * ufl.dx)[:, -1:]
    sigma = stress.tensors(found[:, :-2], found[:, -2])
    return np.asarray(sigma * scales.stress * scales.length**scales.dimension)


def _work(bulk: Bulk, u: fem.Function, pressures: Sequence[fem.Function], v: Any) -> Any:
    """The UFL form of the work of the stresses in v."""
    test, trial = bulk.form.arguments()
    form = ufl.replace(bulk.material, {test: v, trial: u})
    for name in sorted(bulk.strains):
        form -= ufl.replace(bulk.strains[name], {test: v})
    return form + bulk.pressed(pressures, v)


def _across(bulk: Bulk, u: fem.Function, pressures: Sequence[fem.Function], q: Any) -> list[Any]:
    """Forms of ∫ σ_33 q dx, which the energy of a plane body does not know; none in space and in plane stress."""
    if bulk.scales.dimension == 3:
        return []
    found = [ufl.replace(form, dict(zip(form.arguments(), (q, u), strict=False))) for form in bulk.across]
    return found + [part.across(p, q) for part, p in zip(bulk.dilatations, pressures, strict=True)]
