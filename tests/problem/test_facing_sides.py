"""A part that holds two sides which lie on each other is refused: each would get a rigid obstacle of its own."""

from __future__ import annotations

import dolfinx
import numpy as np
import pytest
import ufl
from basix.ufl import element
from mpi4py import MPI

import hvi_fenicsx as hvi

POINTS = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [1, 0], [2, 0], [2, 1], [1, 1]], dtype=float)
CELLS = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], dtype=np.int64)
NAMES = {"left": 1, "joint_of_a": 2, "joint_of_b": 3, "right": 4}


def body(joint_of_b: int) -> hvi.Body:
    """Two unit squares that lie on each other at x = 1 and share no vertex; the facets of b's side have this tag."""
    domain = ufl.Mesh(element("Lagrange", "triangle", 1, shape=(2,)))
    mesh = dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells=CELLS, x=POINTS, e=domain)
    mesh.topology.create_connectivity(1, 2)
    mesh.topology.create_connectivity(2, 1)
    where = {0.0: 1, 2.0: 4}
    found = {}
    for x, tag in where.items():
        facets = dolfinx.mesh.locate_entities_boundary(mesh, 1, lambda p, x=x: np.isclose(p[0], x))
        found |= dict.fromkeys(facets.tolist(), tag)
    for facet in dolfinx.mesh.locate_entities_boundary(mesh, 1, lambda p: np.isclose(p[0], 1.0)):
        (cell,) = mesh.topology.connectivity(1, 2).links(facet)
        in_a = mesh.geometry.x[mesh.geometry.dofmap[cell]][:, 0].min() < 0.5
        found[int(facet)] = 2 if in_a else joint_of_b
    facets = np.array(sorted(found), dtype=np.int32)
    tags = dolfinx.mesh.meshtags(mesh, 1, facets, np.array([found[int(f)] for f in facets], dtype=np.int32))
    names = {name: tag for name, tag in NAMES.items() if tag != 3 or joint_of_b == 3}
    return hvi.Body(mesh, facets=tags, names=names)


def model(around: hvi.Body) -> hvi.Model:
    """Both squares held at their far sides, with a bond at the joint's part of a."""
    return hvi.Model(
        around,
        [
            hvi.Isotropic(youngs_modulus=2.15e11, poisson_ratio=0.29),
            hvi.Displacement("left", [0.0, 0.0]),
            hvi.Displacement("right", [0.0, 0.0]),
            hvi.Adhesion("joint_of_a", hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=9e-6)),
        ],
    )


def test_two_sides_that_face_each_other_in_one_part_are_refused() -> None:
    with pytest.raises(hvi.InputError, match=r"joint_of_a: two sides lie on each other at \(1, "):
        hvi.solve(model(body(joint_of_b=2)))


def test_one_of_the_sides_alone_is_a_part() -> None:
    assert hvi.solve(model(body(joint_of_b=3))).converged
