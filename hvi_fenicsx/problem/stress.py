"""The stress in each cell, told by the energy itself, so that a new material needs nothing here.

With v = q·x, q being constant in one cell and zero elsewhere, ε(v) is the symmetric part of q: the stress does the work
|K| σ:q in it. The energy of a plane body does not see σ_33: materials and thermal strains say it themselves
(``Contribution.across``).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem

from ..certify.estimate.defect import pressures
from ..certify.estimate.edge_bubbles import assembled
from ..effects.base import Place
from ..typing import Array
from .problem import Problem

_SEEN = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}
"""The components that the energy sees, by dimension."""


def by_cell(problem: Problem, u: fem.Function) -> Array:
    """The mean stress of every owned cell, N/m², tension positive; shape (cells, 3, 3). Collective.

    σ_33 is zero in plane stress, and what holds the thickness in plane strain. Where div u is averaged by vertex, so is
    the volumetric stress.
    """
    mesh, scales, seen = problem.domain.mesh, problem.scales, _SEEN[problem.scales.dimension]
    one = basix.ufl.element("Discontinuous Lagrange", mesh.topology.cell_name(), 0)
    *q, across, volume = ufl.TestFunction(fem.functionspace(mesh, basix.ufl.blocked_element(one, (len(seen) + 2,))))
    averages = pressures(problem, u)
    found = assembled(sum(_across(problem, u, averages, across), _work(problem, u, averages, q)))
    found /= assembled(volume * ufl.dx)[:, -1:]
    sigma = np.zeros((len(found), 3, 3))
    sigma[:, 2, 2] = found[:, -2]
    for component, (i, j) in zip(found.T, seen, strict=False):
        sigma[:, i, j] = sigma[:, j, i] = component
    return np.asarray(sigma * scales.stress * scales.length**scales.dimension)


def von_mises(sigma: Array) -> Array:
    """√(3/2 s:s) of stresses (n, 3, 3) with deviators s; shape (n,)."""
    pressure = np.trace(sigma, axis1=1, axis2=2) / 3
    deviator = sigma - pressure[:, None, None] * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator)))


def _work(problem: Problem, u: fem.Function, averages: Sequence[fem.Function], q: Sequence[Any]) -> Any:
    """The work of the stresses in v = q·x, the components of q being those of ``_SEEN``."""
    d = problem.scales.dimension
    matrix: list[list[Any]] = [[0.0] * d for _ in range(d)]
    for k, (i, j) in enumerate(_SEEN[d]):
        matrix[i][j] = q[k]
    v = ufl.dot(ufl.as_matrix(matrix), ufl.SpatialCoordinate(problem.domain.mesh)) / problem.scales.length
    test, trial = problem.bilinear.arguments()
    # a material's energy is one of ε(u); that of another effect, a bedding's say, need not be
    energies = [a for _, effect, c in problem.made if effect.place is Place.MATERIAL for a in c.bilinear]
    form = ufl.replace(sum(energies), {test: v, trial: u})
    for name in sorted(problem.strains):
        form -= ufl.replace(problem.linear[name], {test: v})
    for part, pressure in zip(problem.averaged, averages, strict=True):
        scalar, vector = part.divergence.arguments()
        form += ufl.replace(part.divergence, {scalar: pressure, vector: v})
    return form


def _across(problem: Problem, u: fem.Function, averages: Sequence[fem.Function], q: Any) -> list[Any]:
    """Forms of ∫ σ_33 q dx that the energy does not know; none in space and in plane stress."""
    if problem.scales.dimension == 3:
        return []
    forms = [form for _, _, c in problem.made for form in c.across]
    found = [ufl.replace(form, dict(zip(form.arguments(), (q, u), strict=False))) for form in forms]
    parts = zip(problem.averaged, averages, strict=True)
    return found + [ufl.replace(part.volume, {part.volume.arguments()[0]: pressure * q}) for part, pressure in parts]
