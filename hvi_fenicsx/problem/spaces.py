"""The finite element of the displacement: its degree, its basis, and the quadrature on Γc that goes with it.

A basis function belongs to each node (mesh/nodes). Bounds and laws act on the coefficients at the nodes of Γc, weighted
with the integrals of the basis functions there; so these must be positive, and a uniform traction is in balance with
nodal forces that are exactly those of the law or the contact. At degree 1 that is the vertex rule of the paper. At
degree 2 in the plane it is Simpson's rule. In space Lagrange's functions of the vertices have no integral over a facet,
and the basis is transformed (Popp, Wohlmuth, Gee and Wall 2012): a share of each function of an edge goes to its ends.
The functions are those of Lagrange's element in any case; a linear one has its nodal values as coefficients.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc

from .. import compat
from ..effects import Averaged
from ..mesh import nodes
from ..runtime import forms
from ..typing import Array, Entities, Integers
from .vectors import assembled, nodal

EDGE_SHARE = {2: 0.0, 3: 0.125}
"""The share of an edge's function that goes to each of its ends at degree 2, by dimension (docs/degree-2.md)."""
_VERTEX_RULE = {"quadrature_rule": "vertex", "quadrature_degree": 1}
_CURVED_DEGREE = 6
"""Degree of that rule on curved facets: normals times areas have degree 2, areas alone are not polynomials."""
LOAD_DEGREE = {2: 20, 3: 12}
"""Degree of the quadrature of a traction that varies, by dimension: what a mesh cannot follow must not be missed."""


def contact_rule(space: fem.FunctionSpace) -> dict[str, Any]:
    """The quadrature of the basis functions on Γc, and of their products with normals, as UFL metadata.

    Args:
        space: of the displacements.
    """
    if nodes.degree(space) == 1:
        return _VERTEX_RULE
    return {"quadrature_degree": 2 if compat.geometry_degree(space.mesh) == 1 else _CURVED_DEGREE}


def displacement_space(mesh: dmesh.Mesh, degree: int = 1) -> fem.FunctionSpace:
    """The space of the displacements, vectors. Collective.

    Args:
        mesh: the mesh.
        degree: of the elements, 1 or 2.
    """
    d = mesh.geometry.dim
    if degree == 1 or EDGE_SHARE[d] == 0.0:
        return fem.functionspace(mesh, ("Lagrange", degree, (d,)))
    scalar = transformed(mesh.topology.cell_name(), EDGE_SHARE[d])
    return fem.functionspace(mesh, basix.ufl.blocked_element(scalar, shape=(d,)))


def global_numbers(space: fem.FunctionSpace, local: Entities) -> Integers:
    """Local nodes of this rank, in an array of any shape, by their numbers over all ranks.

    Args:
        space: of the displacements.
        local: the nodes.
    """
    found = space.dofmap.index_map.local_to_global(np.ascontiguousarray(local, dtype=np.int32).ravel())
    return found.reshape(np.shape(local))


def pressure_space(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """The space of averaged volumetric stresses, P1: at degree 2 with Taylor and Hood's displacements. Collective."""
    return fem.functionspace(mesh, ("Lagrange", 1))


def edge_share(space: fem.FunctionSpace) -> float:
    """The share of an edge's function that goes to each of its ends, 0 where coefficients are values.

    Args:
        space: of the displacements.
    """
    return 0.0 if nodes.degree(space) == 1 else EDGE_SHARE[space.mesh.geometry.dim]


def values(space: fem.FunctionSpace, coefficients: Array) -> Array:
    """The values of a displacement at the local nodes, (n, d).

    Args:
        space: of the displacements.
        coefficients: at the local nodes, ghosts among them, of any shape that reshapes to (n, d).
    """
    found, share = coefficients.reshape(-1, space.mesh.geometry.dim), edge_share(space)
    if share == 0.0:
        return found
    return (1 - 2 * share) * found + share * found[nodes.edge_ends(space)].sum(axis=1)


def in_lagrange_basis(u: fem.Function) -> fem.Function:
    """The same displacement with its values at the nodes as coefficients, as files and other programs read it.

    Args:
        u: a displacement, ghosts updated.
    """
    mesh = u.function_space.mesh
    lagrange = fem.functionspace(mesh, ("Lagrange", nodes.degree(u.function_space), (mesh.geometry.dim,)))
    return carried_over(u, lagrange)


def carried_over(u: fem.Function, space: fem.FunctionSpace) -> fem.Function:
    """A displacement in another space on the same cells; at degree 1 it has the values of degree 2 at the vertices.

    Args:
        u: the displacement, ghosts updated.
        space: of degree 1 or 2.
    """
    found = fem.Function(space)
    found.interpolate(u)
    return found


def positions(space: fem.FunctionSpace, coefficients: Array) -> Array:
    """Where the local nodes are, m, (n, 3): the inverse of :func:`coefficients_of` for the position.

    Args:
        space: of the displacements.
        coefficients: of the position.
    """
    straight = edge_share(space) == 0.0 or compat.geometry_degree(space.mesh) == 1
    return coefficients if straight else values(space, coefficients)


def coefficients_of(space: fem.FunctionSpace, points: Array) -> Array:
    """The coefficients of the position, m, (n, 3); on straight cells the nodes themselves, as of all linear functions.

    Args:
        space: of the displacements.
        points: the local nodes, ghosts among them, m, (n, 3).
    """
    share = edge_share(space)
    if share == 0.0 or compat.geometry_degree(space.mesh) == 1:
        return points
    return (points - share * points[nodes.edge_ends(space)].sum(axis=1)) / (1 - 2 * share)


def simplex_functions(degree: int, barycentric: Array, share: float = 0.0) -> Array:
    """The basis functions of the nodes of a facet or a cell, corners first, at points of it, (q, nodes).

    Args:
        degree: 1 or 2.
        barycentric: the points, (q, corners).
        share: of an edge's function that goes to each of its ends (:func:`edge_share`); by default Lagrange's basis.
    """
    return barycentric if degree == 1 else quadratic_functions(0, barycentric, share)[0]


def quadratic_functions(order: int, barycentric: Array, share: float = 0.0) -> Array:
    """Those of degree 2, and their derivatives by all coordinates but the first up to an order, (k, q, nodes).

    Args:
        order: 0 or 1.
        barycentric: the points, (q, corners).
        share: as for :func:`simplex_functions`.
    """
    kind = {2: "interval", 3: "triangle", 4: "tetrahedron"}[barycentric.shape[1]]
    points = np.pad(barycentric[:, 1:], ((0, 1), (0, 0)))  # a corner more: basix takes one point at least
    return transformed(kind, share).tabulate(order, points)[:, :-1]


@functools.cache
def transformed(cell: str, share: float) -> Any:
    """The transformed element of degree 2, a scalar one; Lagrange's without a share.

    With the share α, the coefficient of an edge is (u - α (u_a + u_b))/(1 - 2α), u at the middle, u_a and u_b at the
    ends.

    Args:
        cell: its kind.
        share: of an edge's function that goes to each of its ends.
    """
    kind = basix.CellType[cell]
    topology: Any = basix.topology(kind)
    corners: Any = basix.geometry(kind)
    d, extra = corners.shape[1], share / (1 - 2 * share)
    ends, inside = corners[np.array(topology[1])], [*map(len, topology[2:]), *[0] * (3 - d)]
    where: list[list[Any]] = [list(corners[:, None]), [np.vstack([pair.mean(axis=0), pair]) for pair in ends]]
    weights = np.array([1 + 2 * extra, -extra, -extra]).reshape(1, 1, 3, 1)
    what: list[list[Any]] = [[np.ones((1, 1, 1, 1))] * len(corners), [weights] * len(ends)]
    return basix.ufl.custom_element(
        kind,
        [],
        np.eye(len(corners) + len(ends)),
        where + [[np.zeros((0, d))] * n for n in inside],
        what + [[np.zeros((0, 1, 0, 1))] * n for n in inside],
        0,
        basix.MapType.identity,
        basix.SobolevSpace.H1,
        False,
        2,
        2,
        basix.PolysetType.standard,
    )


@dataclass(frozen=True)
class Dilatation:
    """The averages of one region, assembled, nondimensional.

    Attributes:
        averaged: what is averaged, as its effect contributes it.
        divergence: D, vertices by unknowns.
        stiffness: λ/V by vertex; zero at the vertices outside of the region.
    """

    averaged: Averaged
    divergence: PETSc.Mat
    stiffness: PETSc.Vec

    def matrix(self) -> PETSc.Mat:
        """Dᵀ (λ/V) D. Collective."""
        weighted = self.divergence.copy()
        weighted.diagonalScale(self.stiffness, None)
        return self.divergence.transposeMatMult(weighted)

    def _nodal_pressure(self, u: fem.Function) -> PETSc.Vec:
        average = self.divergence.createVecLeft()
        self.divergence.mult(u.x.petsc_vec, average)
        average.pointwiseMult(average, self.stiffness)
        return average

    def pressure(self, u: fem.Function) -> fem.Function:
        """The averaged volumetric stress (λ/V) D u, a P1 field, ghosts updated. Collective."""
        (scalar,) = self.averaged.volume.arguments()
        pressure = fem.Function(scalar.ufl_function_space())
        pressure.x.array[: self.stiffness.local_size] = self._nodal_pressure(u).array_r
        pressure.x.scatter_forward()
        return pressure

    def force(self, u: fem.Function) -> Array:
        """Dᵀ (λ/V) D u at the unknowns that this rank owns. Collective."""
        force = self.divergence.createVecRight()
        self.divergence.multTranspose(self._nodal_pressure(u), force)
        return np.array(force.array_r)

    def dilated(self, v: Any) -> Any:
        """The UFL form ∫ φ_i div v dx over the region.

        Args:
            v: a displacement of any space, or a sum of such.
        """
        _, vector = self.averaged.divergence.arguments()
        return ufl.replace(self.averaged.divergence, {vector: v})

    def work(self, pressure: Any, v: Any) -> Any:
        """The UFL form ∫ p div v dx over the region.

        Args:
            pressure: p, a P1 field or a scalar test function.
            v: a displacement or test function of any space.
        """
        scalar, vector = self.averaged.divergence.arguments()
        return ufl.replace(self.averaged.divergence, {scalar: pressure, vector: v})

    def tested(self, q: Any) -> Any:
        """The UFL form ∫ q dx over the region.

        Args:
            q: a scalar test function, perhaps times a field: what that adds to σ_33.
        """
        (scalar,) = self.averaged.volume.arguments()
        return ufl.replace(self.averaged.volume, {scalar: q})

    def error(self, u: fem.Function) -> Array:
        """2μ/d ∫ (div u - p/λ)² of every owned cell, (cells,). Collective."""
        pressure, mesh = self.pressure(u), u.function_space.mesh
        q, d = ufl.TestFunction(fem.functionspace(mesh, ("Discontinuous Lagrange", 0))), mesh.geometry.dim
        volume, dilated = nodal(self.tested(q)), nodal(self.work(q, u))
        mean = np.divide(dilated, volume, out=np.zeros_like(dilated), where=volume > 0)
        at = mean - pressure.x.array[pressure.function_space.dofmap.list[: len(mean)]] / self.averaged.modulus
        squares = np.sum(at**2, axis=1) + np.sum(at, axis=1) ** 2
        return self.averaged.shear / d * volume[:, 0] * squares / ((d + 1) * (d + 2))


def assemble(averaged: Averaged) -> Dilatation:
    """Assemble the averages that an effect contributes. Collective."""
    divergence = assemble_matrix(forms.compiled(averaged.divergence))
    divergence.assemble()
    volume = assembled(forms.compiled(averaged.volume))
    stiffness = divergence.createVecLeft()
    v = volume.array_r
    # vertices outside of the region have no volume and average nothing
    stiffness.array[:] = np.divide(averaged.modulus, v, out=np.zeros_like(v), where=v > 0)
    return Dilatation(averaged, divergence, stiffness)


def add(matrix: PETSc.Mat, parts: Sequence[Dilatation]) -> PETSc.Mat:
    """A stiffness matrix with the volumetric part added. Collective.

    Args:
        matrix: without it; freed where a new one is needed.
        parts: the regions that are averaged.
    """
    maps: Any = matrix.getLGMap()
    for part in parts:
        wider = part.matrix()
        wider.axpy(1.0, matrix, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        wider.setBlockSize(matrix.getBlockSize())
        matrix.destroy()
        matrix = wider
        matrix.setLGMap(*maps)
    return matrix
