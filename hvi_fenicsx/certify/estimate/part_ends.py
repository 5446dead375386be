"""Loads whose part ends within a facet: the mesh loads this facet as a whole, or not at all.

What is too much there, or too little, is a load of its own. The displacement that it causes is found in u_h's space,
and counts in the cells at these facets: smaller ones make it smaller, wherever the body gives way.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from dolfinx import fem

from ...effects.base import SurfaceLoad
from ...problem import spaces
from ...problem.problem import Problem
from ...runtime.mpi import total
from ...typing import Array, Entities, Mask
from .block_forces import gathered, summed
from .boundary_data import FacetSamples, sample
from .dual_norm import DualNorm
from .thresholds import Thresholds


def squares(problem: Problem, bubbles: fem.FunctionSpace, inverse: DualNorm, thresholds: Thresholds) -> Array:
    """η_K² of the owned cells that the ends of loaded parts add. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        inverse: of the system's stiffness.
        thresholds: how finely facets are sampled.
    """
    d = problem.scales.dimension
    cells = np.zeros(problem.domain.mesh.topology.index_map(d).size_local)
    forces: list[tuple[Entities, Array]] = []
    for on, missing in _missing(problem, bubbles, thresholds):
        functions = spaces.simplex_functions(on.facets.degree, on.barycentric, spaces.edge_share(problem.space))
        weighted = on.facets.areas[:, None, None] * on.weights[:, None] * missing
        forces.append((on.facets.nodes.ravel(), np.einsum("fqd,qn->fnd", weighted, functions).reshape(-1, d)))
        np.add.at(cells, on.facets.cells, np.sum(np.abs(weighted), axis=(1, 2)) ** 2)
    whole = total(problem.domain.mesh.comm, float(cells.sum()))
    if whole == 0.0:
        return cells
    lacking = gathered(problem.space, summed(forces, d)).everywhere(problem.space.dofmap.index_map.size_local)
    _, norm = inverse.solve(problem.combined(lacking))
    return np.asarray(norm**2 * cells / whole)


def _missing(
    problem: Problem, bubbles: fem.FunctionSpace, thresholds: Thresholds
) -> Iterator[tuple[FacetSamples, Array]]:
    """Facets of each side of which a piece is loaded, and the traction that they lack, nondimensional, (f, q, d).

    The others lack the load where they reach into the piece; those that the mesh loads have too much of it beyond.
    """
    for where, effect, _ in problem.contributions:
        load, piece = effect.surface_load(), problem.pieces.get(where or "")
        if where is None or load is None or piece is None or piece.where is None:
            continue
        loaded = problem.part_facets[where]
        for facets, given in ((loaded, 1.0), (np.setdiff1d(problem.domain.facets(piece.on), loaded), 0.0)):
            on = sample(problem, bubbles, facets, thresholds)
            share = piece.where.at(on.points.reshape(-1, 3)).reshape(on.points.shape[:2]) - given
            yield on, share[:, :, None] * _tractions(problem, on, load, share != 0.0)


def _tractions(problem: Problem, on: FacetSamples, load: SurfaceLoad, where: Mask) -> Array:
    """A load, as far as it is known between nodes, at chosen ones of the sample points, nondimensional, (f, q, d)."""
    found = np.zeros((*where.shape, problem.scales.dimension))
    for axis, value in enumerate(load.components):
        if value.everywhere:
            found[where, axis] = value.at(on.points[where])
    if load.pressure is not None and load.pressure.everywhere:
        normals = np.broadcast_to(_outward(problem, on)[:, None], found.shape)
        found[where] -= load.pressure.at(on.points[where])[:, None] * normals[where]
    return np.asarray(found / problem.scales.stress)


def _outward(problem: Problem, on: FacetSamples) -> Array:
    """The outward unit normals of facets, (f, d)."""
    corners, d = on.corners[:, :, : problem.scales.dimension], problem.scales.dimension
    sides = corners[:, 1:] - corners[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1]) if d == 3 else sides[:, 0, ::-1] * [1.0, -1.0]
    cells = problem.positions[problem.space.dofmap.list[on.facets.cells]].mean(axis=1)[:, :d]
    inward = np.sum((cells - corners.mean(axis=1)) * normals, axis=1) > 0.0
    normals = np.where(inward[:, None], -normals, normals)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
