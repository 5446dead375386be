"""Bodies on one mesh: each side and region must be the same pieces of the body, however dolfinx numbers them."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import mesh as dmesh
from mpi4py import MPI

from hvi_fenicsx import compat
from hvi_fenicsx.mesh import blocks
from hvi_fenicsx.mesh.joined import PlacedBody, joined

TURN = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("takes_topology", [True, False])
@pytest.mark.parametrize(("size", "cells"), [([1.0, 0.5], [4, 2]), ([1.0, 0.5, 0.25], [3, 2, 2])])
def test_sides_and_bodies_are_where_their_bodies_are(size, cells, takes_topology, monkeypatch):
    monkeypatch.setattr(compat, "TAKES_TOPOLOGY", takes_topology)
    d = len(size)
    bodies = [
        PlacedBody(name=name, domain=blocks.block(MPI.COMM_WORLD, size, n), origin=np.full(d, at), rotation=turn)
        for name, n, at, turn in (
            ("lower", cells, 0.0, np.eye(d)),
            ("upper", [2 * n for n in cells], 3.0, TURN[:d, :d]),
        )
    ]
    domain = joined(MPI.COMM_WORLD, bodies)
    assert len(domain.regions["lower"]) + len(domain.regions["upper"]) == len(compat.geometry_dofmap(domain.mesh))
    for body in bodies:
        assert same(middles(domain.mesh, d, domain.regions[body.name]), own(body, d, None))
        for side, facets in body.domain.sides.items():
            there = middles(domain.mesh, d - 1, domain.sides[f"{body.name}.{side}"])
            assert same(there, own(body, d - 1, facets))


def own(body, dimension, facets):
    """The middles of a body's entities in their place."""
    d, mesh = body.domain.dimension, body.domain.mesh
    chosen = np.arange(len(compat.geometry_dofmap(mesh)), dtype=np.int32) if facets is None else facets
    return body.at(middles(mesh, dimension, chosen)[:, :d])


def middles(mesh, dimension, entities):
    mesh.topology.create_connectivity(dimension, mesh.topology.dim)
    return dmesh.compute_midpoints(mesh, dimension, entities)[:, : mesh.geometry.dim]


def same(one, other):
    """Whether two sets of points are the same."""
    one, other = (points[np.lexsort(np.round(points, 9).T)] for points in (one, other))
    return len(one) > 0 and np.allclose(one, other, atol=1e-12)
