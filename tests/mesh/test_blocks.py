"""Why: a block that is not the documented one, or not whole, would be solved all the same; and a bad partition."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from runs import on_ranks

from hvi_fenicsx import compat
from hvi_fenicsx.mesh import blocks

COMM = MPI.COMM_WORLD
GRIDS = [[1, 1], [3, 5], [16, 20], [2, 3, 4], [1, 7, 1]]


@pytest.mark.parametrize("cells", GRIDS)
def test_a_block_is_the_one_that_dolfinx_makes(cells: list[int]) -> None:
    size = [1.0, 2.0, 0.7][: len(cells)]
    corners = [np.zeros(len(cells)), np.array(size)]
    make = dmesh.create_rectangle if len(cells) == 2 else dmesh.create_box
    assert simplices(blocks.mesh(COMM, size, cells)) == simplices(make(COMM, corners, cells))


def simplices(mesh: dmesh.Mesh) -> set[frozenset[tuple[float, ...]]]:
    """The cells as sets of their corners."""
    corners = np.round(mesh.geometry.x[compat.geometry_dofmap(mesh)], 12)
    return {frozenset(tuple(map(float, x)) for x in cell) for cell in corners}


@pytest.mark.parametrize("cells", GRIDS)
def test_its_facets_are_those_that_dolfinx_finds(cells: list[int]) -> None:
    """And a form with edges, facets, orientations and interior facets has the same values."""
    d, size = len(cells), [1.0, 2.0, 0.7][: len(cells)]
    own = blocks.mesh(MPI.COMM_SELF, size, cells)
    corners, kind = own.geometry.x[:, :d].copy(), "triangle" if d == 2 else "tetrahedron"
    found = compat.simplex_mesh(MPI.COMM_SELF, compat.geometry_dofmap(own), corners, kind)
    for dimension, outer in ((d - 1, False), (d - 1, True), (1, False)):
        assert entities(own, dimension, outer=outer) == entities(found, dimension, outer=outer)
    assert np.allclose(energies(own), energies(found), rtol=1e-12)


def entities(mesh: dmesh.Mesh, dimension: int, *, outer: bool = False) -> set[frozenset[tuple[float, ...]]]:
    """Entities as sets of their corners; of the facets only the exterior ones, if so wanted."""
    mesh.topology.create_entities(dimension)
    chosen = np.arange(mesh.topology.index_map(dimension).size_local, dtype=np.int32)
    if outer:
        mesh.topology.create_connectivity(dimension, mesh.topology.dim)
        chosen = dmesh.exterior_facet_indices(mesh.topology)
    mesh.topology.create_connectivity(dimension, mesh.topology.dim)
    places = mesh.geometry.x[dmesh.entities_to_geometry(mesh, dimension, chosen, False)]
    return {frozenset(tuple(map(float, np.round(x, 12))) for x in place) for place in places}


def energies(mesh: dmesh.Mesh) -> list[float]:
    """Of a cubic function in a space of that degree: of its gradient, on the boundary, and across the facets."""
    f, n = fem.Function(fem.functionspace(mesh, ("Lagrange", 3))), ufl.FacetNormal(mesh)
    f.interpolate(lambda x: x[0] ** 3 - 2 * x[0] * x[1] ** 2 + x[2] * x[1])
    broken = fem.Function(fem.functionspace(mesh, ("Discontinuous Lagrange", 1)))
    broken.interpolate(lambda x: np.sin(9 * x[0]) + x[1] ** 2)
    forms = [ufl.inner(ufl.grad(f), ufl.grad(f)) * ufl.dx, f * ufl.dot(ufl.grad(f), n) * ufl.ds]
    forms.append(ufl.jump(broken) ** 2 * ufl.dS + ufl.jump(ufl.grad(f), n) ** 2 * ufl.dS)
    return [float(fem.assemble_scalar(fem.form(form))) for form in forms]


@pytest.mark.parametrize(("cells", "ranks"), [([3, 5], 2), ([16, 20], 40), ([2, 3, 4], 7)])
def test_each_cell_is_on_one_rank(cells: Sequence[int], ranks: int) -> None:
    count = np.zeros(cells, dtype=int)
    for rank in range(ranks):
        part = blocks.part_of_rank(cells, ranks, rank)
        count[tuple(itertools.starmap(slice, zip(*part, strict=True)))] += 1
    assert np.all(count == 1)


BETWEEN = [pytest.param(2, (16, 24), 1, marks=pytest.mark.long), (3, (24, 36), 1), (3, (16, 20), 2)]


@pytest.mark.parametrize(("ranks", "cells", "away"), BETWEEN)
def test_values_between_levels_cross_ranks_at_the_cuts_only(ranks: int, cells: tuple[int, int], away: int) -> None:
    """A vertex next to a cut is the mean of one on it; where the levels' cuts differ by a cell, so do the vertices."""
    found = on_ranks(ranks, "tests/mesh/block_ranks.py", *cells)
    assert sum(own for own, _, _ in found) == 2 * cells[0] * cells[1]
    assert max(own for own, _, _ in found) <= 1.1 * 2 * cells[0] * cells[1] / ranks
    assert 0 < sum(foreign for _, foreign, _ in found) <= ranks * sum(cells)
    assert max(distance for _, _, distance in found) <= away + 1e-9
