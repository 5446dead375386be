"""The finite element of the displacement: its degree, its spaces, and the quadrature on Γc that goes with it.

An element of degree 2 begins here. What stands on degree 1 beside it: the vertices as dofs (mesh/vertex_dofs), the
transfer between levels (mesh/transfer), the surfaces of Γc (problem/contact_surface), the averaged dilatation
(problem/nodal_averaging), the blocks of Γc's vertices (system/contact_rows), the error estimate (certify/estimate), and
the arrays that are written (results/gathering).
"""

from __future__ import annotations

from dolfinx import fem
from dolfinx import mesh as dmesh

DEGREE = 1
CONTACT_RULE = {"quadrature_rule": "vertex", "quadrature_degree": 1}
"""Quadrature of bounds and laws on Γc (UFL metadata): the vertex rule of the paper, which lumps them at the nodes."""
LOAD_DEGREE = {2: 20, 3: 12}
"""Degree of the quadrature of a traction that varies, by dimension: what a mesh cannot follow must not be missed."""


def displacement_space(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """The space of the displacements, vectors. Collective."""
    return fem.functionspace(mesh, ("Lagrange", DEGREE, (mesh.geometry.dim,)))


def scalar_space(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """The scalar space of the same degree. Collective."""
    return fem.functionspace(mesh, ("Lagrange", DEGREE))
