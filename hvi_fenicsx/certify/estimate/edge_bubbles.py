"""The hierarchical complement of P1 in P2: one quadratic bubble 4 λ_a λ_b for every edge, and its stiffness.

Its degrees of freedom are the values at the midpoints of the edges. The stiffness is spectrally equivalent to its
diagonal, whatever the mesh width, so a handful of conjugate gradient steps solve with it (Bank and Smith 1993).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ...problem.problem import Problem
from ...runtime import forms
from ...typing import Array


def quadrature(cell: str, degree: int) -> tuple[Array, Array]:
    """Barycentric points (q, corners) and weights (q,), whose sum is 1, of a simplex.

    Args:
        cell: its name, such as "triangle".
        degree: of the polynomials that are integrated exactly.
    """
    made: tuple[Any, Any] = basix.make_quadrature(basix.CellType[cell], degree)
    points, weights = made
    return np.column_stack([1 - points.sum(axis=1), points]), weights / weights.sum()


@functools.cache
def element(cell: str) -> Any:
    """The edge bubbles of a triangle or tetrahedron, a scalar element."""
    kind = basix.CellType[cell]
    topology, corners = basix.topology(kind), np.asarray(basix.geometry(kind), dtype=np.float64)
    d = len(topology) - 1
    where: list[list[Any]] = [[np.zeros((0, d)) for _ in entities] for entities in topology] + [[]] * (3 - d)
    what: list[list[Any]] = [[np.zeros((0, 1, 0, 1)) for _ in entities] for entities in topology] + [[]] * (3 - d)
    where[1] = [corners[list(edge)].mean(axis=0)[None, :] for edge in topology[1]]
    what[1] = [np.ones((1, 1, 1, 1)) for _ in topology[1]]
    none = -1  # no Lagrange space is contained
    smooth, standard = basix.SobolevSpace.H1, basix.PolysetType.standard
    return basix.ufl.custom_element(
        kind, [], _coefficients(cell), where, what, 0, basix.MapType.identity, smooth, False, none, 2, standard
    )


def _coefficients(cell: str) -> Array:
    """The bubbles in the orthonormal polynomials of degree 2, (bubbles, polynomials)."""
    barycentric, weights = quadrature(cell, 4)
    kind = basix.CellType[cell]
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, 2, barycentric[:, 1:])
    values = [4 * barycentric[:, a] * barycentric[:, b] for a, b in basix.topology(kind)[1]]
    volume = 1.0 / math.factorial(barycentric.shape[1] - 1)
    return np.asarray(np.einsum("iq,q,jq->ij", np.array(values), volume * weights, legendre))


def space(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """Vector-valued edge bubbles. Collective."""
    mesh.topology.create_entities(1)
    scalar = element(mesh.topology.cell_name())
    return fem.functionspace(mesh, basix.ufl.blocked_element(scalar, shape=(mesh.geometry.dim,)))


class BubbleStiffness:
    """The elastic stiffness of the bubbles, nondimensional: its products and its diagonal. Creation is collective.

    It is not stored. In space it would take 9 kB a vertex, more than all else of a run, and take longer to assemble
    than the few products that are wanted of it.

    Attributes:
        problem: whose elastic operator it is.
        space: the edge bubbles.
        comm: the ranks.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace) -> None:
        self.problem, self.space = problem, bubbles
        self.comm: MPI.Comm = bubbles.mesh.comm
        self._in, self._out = fem.Function(bubbles), fem.Function(bubbles)
        self._action = forms.compiled(problem.bulk.between(self._in, ufl.TestFunction(bubbles)))
        self._inverse: Array = np.reciprocal(diagonal(problem, bubbles))

    def times(self, e: Array) -> Array:
        """A e of owned values (n, d). Collective."""
        self._in.x.array[: e.size] = e.ravel()
        self._in.x.scatter_forward()
        self._out.x.array[:] = 0.0
        fem.assemble_vector(self._out.x.array, self._action)
        self._out.x.scatter_reverse(la.InsertMode.add)
        return np.array(self._out.x.array[: e.size]).reshape(e.shape)

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
        r = load - self.times(e)
        p, rho = np.zeros_like(r), 0.0
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

    On a cell in which the material is constant, E being the energy of an affine function,
    a(4 λ_a λ_b) = 16 (E(λ_a) + E(λ_b) + E(λ_a + λ_b)) / ((d + 1)(d + 2)).

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of edge bubbles.
    """
    affine, d = _Affine(problem), problem.scales.dimension
    hats = np.vstack([-np.ones(d), np.eye(d)])
    own = [affine.energies(hat) for hat in hats]
    edges, values = bubbles.dofmap.list[: len(own[0])], fem.Function(bubbles)
    blocks = values.x.array.reshape(-1, d)
    for k, (a, b) in enumerate(basix.topology(basix.CellType[bubbles.mesh.topology.cell_name()])[1]):
        energies = own[a] + own[b] + affine.energies(hats[a] + hats[b])
        for i in range(d):
            blocks[:, i] += np.bincount(edges[:, k], energies[:, i], minlength=len(blocks))
    values.x.scatter_reverse(la.InsertMode.add)
    return np.array(blocks[: bubbles.dofmap.index_map.size_local]) * 16 / ((d + 1) * (d + 2))


class _Affine:
    """Elastic energies of functions affine on a cell that vanish at its middle. Creation is collective."""

    def __init__(self, problem: Problem) -> None:
        mesh, d = problem.domain.mesh, problem.scales.dimension
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
