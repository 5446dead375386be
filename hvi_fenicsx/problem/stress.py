"""Stress tensors of cells: the displacements that tell their components, the tensors, von Mises' stress."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem

from ..effects.elasticity import COMPONENTS
from ..mesh import nodes
from ..typing import Array
from .elastic_operator import Bulk
from .vectors import LinearForm


def linear_field(q: Sequence[Any], x: Any) -> Any:
    """The UFL displacement q·x, the entries of the matrix q being those of ``COMPONENTS``, the others zero.

    Args:
        q: its entries, UFL scalars.
        x: the coordinates, a UFL vector.
    """
    d = len(x)
    matrix: list[list[Any]] = [[0.0] * d for _ in range(d)]
    for entry, (i, j) in zip(q, COMPONENTS[d], strict=True):
        matrix[i][j] = entry
    return ufl.dot(ufl.as_matrix(matrix), x)


def tensors(components: Array, across: Array) -> Array:
    """Symmetric tensors, (..., 3, 3).

    Args:
        components: those of ``COMPONENTS``, (..., k).
        across: σ_33 of a plane body, (...); in space it is among the components, and this is not used.
    """
    seen = next(places for places in COMPONENTS.values() if len(places) == components.shape[-1])
    sigma = np.zeros((*across.shape, 3, 3))
    sigma[..., 2, 2] = across
    for number, (i, j) in enumerate(seen):
        sigma[..., i, j] = sigma[..., j, i] = components[..., number]
    return sigma


def von_mises(sigma: Array) -> Array:
    """√(3/2 s:s) of stresses (n, 3, 3) with deviators s, from their components; shape (n,)."""
    first, second, third = (sigma[:, i, i] for i in range(3))
    apart = (first - second) ** 2 + (second - third) ** 2 + (third - first) ** 2
    shear = sigma[:, 0, 1] ** 2 + sigma[:, 1, 2] ** 2 + sigma[:, 0, 2] ** 2
    return np.sqrt(apart / 2 + 3 * shear)


def space_of_stress(space: fem.FunctionSpace, shape: tuple[int, ...] = ()) -> fem.FunctionSpace:
    """Functions as smooth as the stress of displacements: of one degree less, apart in each cell. Collective.

    Args:
        space: of the displacements.
        shape: of their values.
    """
    return fem.functionspace(space.mesh, ("Discontinuous Lagrange", nodes.degree(space) - 1, shape))


def cell_stress(bulk: Bulk, u: fem.Function) -> Array:
    """The stress in every owned cell, N/m², tension positive; shape (cells, k, 3, 3). Collective.

    At degree 1 it is the mean of a cell (k = 1), at degree 2 the linear function that is nearest in the mean square, by
    its values at the corners (k = d+1).

    With v = q·x, q being constant in one cell and zero elsewhere, ε(v) is the symmetric part of q, and the stress does
    the work σ:q in it at each point. σ_33 is zero in plane stress, and what holds the thickness in plane strain. Where
    div u is averaged by vertex, so is the volumetric stress.

    Args:
        bulk: the elastic operator.
        u: the displacement, in units of u0, ghosts updated.
    """
    mesh, scales = bulk.space.mesh, bulk.scales
    one = basix.ufl.element("Discontinuous Lagrange", mesh.topology.cell_name(), 0)
    *q, across = ufl.TestFunction(
        fem.functionspace(mesh, basix.ufl.blocked_element(one, (len(COMPONENTS[scales.dimension]) + 1,)))
    )
    pressures = bulk.pressures(u)
    v = linear_field(q, ufl.SpatialCoordinate(mesh)) / scales.length
    work = sum(_across(bulk, u, pressures, across), _work(bulk, u, pressures, v))
    found = _nearest(bulk.space, work) * (scales.stress * scales.length**scales.dimension)
    return tensors(found[..., :-1], found[..., -1])


def stress_of_parts(bulk: Bulk, u: fem.Function) -> Array:
    """The mean stress of the parts of every owned cell (:func:`.nodes.linear_cells`), N/m², (parts, 3, 3). Collective.

    Args:
        bulk: the elastic operator.
        u: the displacement, in units of u0, ghosts updated.
    """
    values = cell_stress(bulk, u)
    if values.shape[1] == 1:
        return values[:, 0]
    found = np.einsum("pk,ckij->cpij", nodes.middles_of_parts(bulk.space), values)
    return found.reshape(-1, 3, 3)


def _nearest(space: fem.FunctionSpace, work: Any) -> Array:
    """The components of the stress in the basis of ``space_of_stress``, (cells, k, components). Collective.

    Args:
        space: of the displacements.
        work: the UFL form of the stress's work in uniform strains, by cell.
    """
    functions = space_of_stress(space)
    weight = fem.Function(functions)
    works = LinearForm(ufl.Form([part.reconstruct(integrand=weight * part.integrand()) for part in work.integrals()]))
    masses = LinearForm(weight * ufl.TestFunction(functions) * ufl.dx)
    right, mass, basis = [], [], functions.dofmap.list.shape[1]
    for _ in _each_basis_function(weight):
        right.append(works.values())
        mass.append(masses.values().reshape(len(right[0]), basis))
    if basis == 1:  # a division, a tenth of the time
        return np.stack(right, axis=1) / mass[0][:, None]
    return np.linalg.solve(np.stack(mass, axis=1), np.stack(right, axis=1))


def _each_basis_function(weight: fem.Function) -> Iterator[None]:
    """Let a function be each function of a cell's basis in turn, in all cells."""
    values = weight.x.array.reshape(-1, weight.function_space.dofmap.list.shape[1])
    for column in values.T:
        values[:] = 0.0
        column[:] = 1.0
        yield


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
    return found + [part.tested(p * q) for part, p in zip(bulk.dilatations, pressures, strict=True)]
