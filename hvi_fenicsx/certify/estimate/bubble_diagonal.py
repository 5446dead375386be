"""The diagonal of the bubbles' stiffness, from energies of affine functions."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh

from ...mesh import nodes
from ...problem.problem import Problem
from ...runtime import forms
from ...typing import Array
from .bubbles import Index, of_cell, quadrature, slope


def diagonal(problem: Problem, bubbles: fem.FunctionSpace) -> Array:
    """The diagonal of the bubbles' stiffness at the blocks that this rank owns, (n, d). Collective.

    On a cell in which the material is constant it is a sum of the energies of the affine functions λ_a and λ_a + λ_b
    (:func:`energy_shares`). Those of λ_a + λ_b and of the others' sum are one, since all together are constant.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
    """
    affine, d = _Affine(problem), problem.scales.dimension
    hats = np.vstack([-np.ones(d), np.eye(d)])
    slopes = [*hats, *(hats[a] + hats[b] for a, b in itertools.combinations(range(d + 1), 2))]
    upward = [tuple((slope * np.sign(slope[np.flatnonzero(slope)[0]])).tolist()) for slope in slopes]
    energies = {slope: affine.energies(np.array(slope)) for slope in dict.fromkeys(upward)}
    del affine
    cells, values = bubbles.dofmap.list[: len(energies[upward[0]][0])], fem.Function(bubbles)
    blocks, cell = values.x.array.reshape(-1, d), bubbles.mesh.topology.cell_name()
    for k, index in enumerate(of_cell(nodes.degree(problem.space), cell)):
        shares: dict[tuple[float, ...], float] = {}
        for number, share in energy_shares(index, cell):
            shares[upward[number]] = shares.get(upward[number], 0.0) + share * 16 / ((d + 1) * (d + 2))
        for i in range(d):
            own = sum(share * energies[slope][i] for slope, share in shares.items())
            blocks[:, i] += np.bincount(cells[:, k], own, minlength=len(blocks))
    values.x.scatter_reverse(la.InsertMode.add)
    return blocks[: bubbles.dofmap.index_map.size_local]


@functools.cache
def energy_shares(index: Index, cell: str) -> list[tuple[int, float]]:
    """The energy of a bubble as a sum of those of affine functions: numbers and shares, times (d + 1)(d + 2)/16.

    The gradient is Σ ∂φ/∂λ_a ∇λ_a, so a(φ, φ) = Σ G_ab a(λ_a, λ_b), G_ab being the mean of ∂φ/∂λ_a ∂φ/∂λ_b.

    Args:
        index: of the bubble.
        cell: the name of the cell's shape.

    Returns:
        First of λ_a by a, then of λ_a + λ_b by pairs a < b; those that are zero are left out.
    """
    barycentric, weights = quadrature(cell, 4 * sum(index))
    slopes = [slope(index, corner, barycentric) for corner in range(len(index))]
    mean = np.array([[np.sum(weights * a * b) for b in slopes] for a in slopes])
    pairs = itertools.combinations(range(len(index)), 2)
    shares = [2 * mean[a, a] - mean[a].sum() for a in range(len(index))] + [mean[a, b] for a, b in pairs]
    rounded = np.round(np.array(shares) * len(index) * (len(index) + 1) / 16, 12)
    return [(number, float(share)) for number, share in enumerate(rounded) if share]


class _Affine:
    """Elastic energies of functions affine on a cell that vanish at its middle. Creation is collective."""

    def __init__(self, problem: Problem) -> None:
        mesh, d = problem.space.mesh, problem.scales.dimension
        space = fem.functionspace(mesh, ("Discontinuous Lagrange", 0, (d,)))
        self._slopes, self._sums = fem.Constant(mesh, np.zeros(d)), fem.Function(space)
        place = ufl.SpatialCoordinate(mesh)
        if problem.bulk.foundation is not None:  # no strain sees where the function vanishes
            middle, cells = fem.Function(space), np.arange(len(space.dofmap.list), dtype=np.int32)
            middle.x.array[:] = dmesh.compute_midpoints(mesh, d, cells)[:, :d].ravel()
            place = place - middle
        height = ufl.dot(self._slopes, ufl.JacobianInverse(mesh) * place)
        q, axes = ufl.TestFunction(space), [ufl.as_vector([float(x) for x in axis]) for axis in np.eye(d)]
        each = [problem.bulk.energy_form(height * axis, q[i]) for i, axis in enumerate(axes)]
        self._form = forms.compiled(ufl.Form([integral for form in each for integral in form.integrals()]))

    def energies(self, slopes: Array) -> Array:
        """The energies of the function with these slopes in reference coordinates (d,), along each axis, (d, cells)."""
        self._slopes.value[:] = slopes
        self._sums.x.array[:] = 0.0
        fem.assemble_vector(self._sums.x.array, self._form)
        d, cells = len(slopes), self._sums.function_space.mesh.topology.index_map(len(slopes)).size_local
        return np.ascontiguousarray(self._sums.x.array[: cells * d].reshape(-1, d).T)
