"""The stiffness of the bubbles: its products, its diagonal, and a solve with it.

It is spectrally equivalent to its diagonal, whatever the mesh width, so a handful of conjugate gradient steps solve it
(Bank and Smith 1993).
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ...mesh import nodes
from ...problem.problem import Problem
from ...runtime import forms
from ...typing import Array
from .bubbles import Index, of_cell, quadrature, slope


class BubbleStiffness:
    """The elastic stiffness of the bubbles, nondimensional: its products and its diagonal. Creation is collective.

    It is not stored. In space it would take 9 kB a vertex at degree 1, more than all else of a run, and take longer to
    assemble than the few products that are wanted of it.

    Attributes:
        problem: whose elastic operator it is.
        space: the bubbles.
        comm: the ranks.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace) -> None:
        self.problem, self.space = problem, bubbles
        self.comm: MPI.Comm = bubbles.mesh.comm
        self._in, self._out = fem.Function(bubbles), fem.Function(bubbles)
        self._action = forms.compiled(problem.bulk.between(self._in, ufl.TestFunction(bubbles)))
        self._inverse: Array = np.reciprocal(diagonal(problem, bubbles))

    def times(self, e: Array) -> Array:
        """A e of owned values (n, d), overwritten by the next product. Collective."""
        self._in.x.array[: e.size] = e.ravel()
        self._in.x.scatter_forward()
        self._out.x.array[:] = 0.0
        fem.assemble_vector(self._out.x.array, self._action)
        self._out.x.scatter_reverse(la.InsertMode.add)
        return np.asarray(self._out.x.array[: e.size]).reshape(e.shape)

    def diagonal_solve(self, r: Array) -> Array:
        """The diagonal's inverse times r (n, d)."""
        return np.asarray(r * self._inverse)

    def solve(
        self, load: Array, e: Array, project: Callable[[Array], None], *, tolerance: float, max_steps: int
    ) -> Array:
        """A e = load among e + the range of a symmetric projection, by conjugate gradients; in place. Collective.

        Args:
            load: (n, d).
            e: start and result, (n, d).
            project: takes out of a vector what is not free, in place.
            tolerance: relative, of the residual in the norm of the diagonal's inverse.
            max_steps: of the conjugate gradients.

        Returns:
            The residual load - A e, what is not free included, (n, d).
        """
        z = load.copy()
        project(z)
        goal = tolerance**2 * self._dot(z, self.diagonal_solve(z))
        moved = self.comm.allreduce(bool(e.any()), op=MPI.LOR)
        r = load - self.times(e) if moved else load.copy()
        p, rho = self._in.x.array[: r.size].reshape(r.shape), 0.0  # in place: a vector of bubbles is large
        p[:] = 0.0
        for _ in range(max_steps):
            np.copyto(z, r)
            project(z)
            z *= self._inverse
            project(z)
            rho, before = self._dot(r, z), rho
            if rho <= goal:
                break
            p *= rho / before if before else 0.0
            p += z
            q = self.times(p)
            alpha = rho / self._dot(p, q)
            e += np.multiply(p, alpha, out=z)
            q *= alpha
            r -= q
        return r

    def _dot(self, a: Array, b: Array) -> float:
        return float(self.comm.allreduce(float(np.vdot(a, b)), op=MPI.SUM))


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
    cells, values = bubbles.dofmap.list[: len(energies[upward[0]])], fem.Function(bubbles)
    blocks, cell = values.x.array.reshape(-1, d), bubbles.mesh.topology.cell_name()
    for k, index in enumerate(of_cell(nodes.degree(problem.space), cell)):
        own = np.zeros((len(cells), d))
        for number, share in energy_shares(index, cell):
            own += share * energies[upward[number]]
        for i in range(d):
            blocks[:, i] += np.bincount(cells[:, k], own[:, i], minlength=len(blocks))
    values.x.scatter_reverse(la.InsertMode.add)
    return np.array(blocks[: bubbles.dofmap.index_map.size_local]) * 16 / ((d + 1) * (d + 2))


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
        middle, self._slopes, self._sums = fem.Function(space), fem.Constant(mesh, np.zeros(d)), fem.Function(space)
        cells = np.arange(len(space.dofmap.list), dtype=np.int32)
        middle.x.array[:] = dmesh.compute_midpoints(mesh, d, cells)[:, :d].ravel()
        height = ufl.dot(self._slopes, ufl.JacobianInverse(mesh) * (ufl.SpatialCoordinate(mesh) - middle))
        q, whole = ufl.TestFunction(space), ufl.Form([])
        for i, axis in enumerate(np.eye(d)):
            v = height * ufl.as_vector(axis.tolist())
            whole += problem.bulk.energy_form(v, q[i])
        self._form = forms.compiled(whole)

    def energies(self, slopes: Array) -> Array:
        """The energies of the function with these slopes in reference coordinates (d,), along each axis, (cells, d)."""
        self._slopes.value[:] = slopes
        self._sums.x.array[:] = 0.0
        fem.assemble_vector(self._sums.x.array, self._form)
        d, cells = len(slopes), self._sums.function_space.mesh.topology.index_map(len(slopes)).size_local
        return np.array(self._sums.x.array[: cells * d]).reshape(-1, d)
