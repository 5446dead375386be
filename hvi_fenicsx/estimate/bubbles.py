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
import numpy.typing as npt
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh
from mpi4py import MPI
from scipy import sparse

from ..problem import Problem
from ..vectors import nodal

Array = npt.NDArray[np.float64]
_MOST_STEPS = 30


def quadrature(cell: str, degree: int) -> tuple[Array, Array]:
    """Barycentric points (q, corners) and weights (q,), whose sum is 1, of a simplex."""
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


class Stiffness:
    """The elastic stiffness of the bubbles, nondimensional. Creation is collective."""

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace) -> None:
        test, trial = problem.bilinear.arguments()
        form = ufl.replace(problem.bilinear, {test: ufl.TestFunction(bubbles), trial: ufl.TrialFunction(bubbles)})
        matrix = fem.assemble_matrix(fem.form(form))
        matrix.scatter_reverse()
        d, owned = bubbles.dofmap.index_map_bs, bubbles.dofmap.index_map.size_local
        columns = matrix.index_map(1)
        self.comm: MPI.Comm = columns.comm
        self._in = la.vector(columns, d)
        end, all_columns = matrix.indptr[owned], columns.size_local + columns.num_ghosts
        self._rows = sparse.bsr_array(
            (matrix.data.reshape(-1, d, d)[:end], matrix.indices[:end], matrix.indptr[: owned + 1]),
            shape=(owned * d, all_columns * d),
        )
        self._inverse: Array = 1.0 / self._rows.diagonal().reshape(owned, d)

    def times(self, e: Array) -> Array:
        """A e of owned values (n, d). Collective."""
        self._in.array[: e.size] = e.ravel()
        self._in.scatter_forward()
        return np.asarray(self._rows @ self._in.array).reshape(e.shape)

    def diagonal_solve(self, r: Array) -> Array:
        """The diagonal's inverse times r (n, d)."""
        return np.asarray(r * self._inverse)

    def solve(self, load: Array, e: Array, project: Callable[[Array], None], rtol: float) -> None:
        """A e = load among e + the range of a symmetric projection, by conjugate gradients; in place. Collective.

        Args:
            load: (n, d). e: start and result (n, d). project: takes out of a vector what is not free, in place.
            rtol: of the residual, in the norm of the diagonal's inverse.
        """
        z = load.copy()
        project(z)
        goal = rtol**2 * self._dot(z, self.diagonal_solve(z))
        r = load - self.times(e)
        project(r)
        p, rho = np.zeros_like(r), 0.0
        for _ in range(_MOST_STEPS):
            np.multiply(r, self._inverse, out=z)
            project(z)
            rho, before = self._dot(r, z), rho
            if rho <= goal:
                break
            p *= rho / before if before else 0.0
            p += z
            q = self.times(p)
            project(q)
            alpha = rho / self._dot(p, q)
            e += np.multiply(p, alpha, out=z)
            q *= alpha
            r -= q

    def _dot(self, a: Array, b: Array) -> float:
        return float(self.comm.allreduce(float(np.vdot(a, b)), op=MPI.SUM))


def assembled(form: Any) -> Array:
    """A linear form's vector at the blocks that this rank owns, (n, d). Collective."""
    return np.asarray(sum(nodal(ufl.Form(integrals)) for integrals in _alike(form)))


def _alike(form: Any) -> list[list[Any]]:
    """A form's integrals in groups: within one, dolfinx wants all of a type to have the same subdomain data."""
    seen: dict[str, list[Any]] = {}
    groups: list[list[Any]] = []
    for integral in form.integrals():
        known, data = seen.setdefault(integral.integral_type(), []), integral.subdomain_data()
        place = next((i for i, other in enumerate(known) if other is data), len(known))
        known += [data] * (place == len(known))
        groups += [[]] * (place == len(groups))
        groups[place] = [*groups[place], integral]
    return groups
