"""The strain in the cells, from displacements at the nodes."""

from __future__ import annotations

import itertools

import numpy as np

from ..mesh import nodes
from ..problem import facet_integrals
from ..problem.problem import Problem
from ..typing import Array, Entities

_AT_ONCE = 8_192
"""Cells that are handled at a time: what fits a cache takes half of the time."""


def of_parts(problem: Problem, u: Array) -> Array:
    """The mean symmetric gradient in the parts of the owned cells of a displacement (n, d) by its values at the nodes.

    It is zero across a plane body. The mean gradient of a quadratic function in a part is its gradient at the middle.

    Args:
        problem: the space.
        u: the displacement, (n, d).

    Returns:
        Shape (parts, 3, 3), the parts being those of :func:`.nodes.linear_cells`.
    """
    cells, middles = nodes.owned_cells(problem.space), nodes.middles_of_parts(problem.space)
    strain = np.zeros((len(cells), len(middles), 3, 3))
    for start in range(0, len(cells), _AT_ONCE):
        own = cells[start : start + _AT_ONCE]
        for number in range(len(middles)):
            middle = middles[number]
            corners, values = _corners(problem, own, middle), _like_at(problem, own, u, middle)
            _put_strain(strain[start : start + _AT_ONCE, number], corners, values)
    return strain.reshape(-1, 3, 3)


def _corners(problem: Problem, cells: Entities, point: Array) -> Array:
    """The corners of the straight cells that have the slopes which cells have at a point, (c, d+1, d)."""
    positions = problem.positions[:, : problem.scales.dimension]
    if facet_integrals.is_curved(problem.space):
        return _like_at(problem, cells, positions, point)
    return positions[cells[:, : positions.shape[1] + 1]]


def _like_at(problem: Problem, cells: Entities, values: Array, point: Array) -> Array:
    """The corners' values of linear functions with the gradients that functions have at a point, (c, d+1, d).

    Args:
        problem: the space.
        cells: by their nodes, (c, nodes).
        values: of the functions at the nodes, (n, d).
        point: its barycentric coordinates, (d+1,).
    """
    corners = len(point)
    found = values[cells[:, :corners]]
    if nodes.degree(problem.space) == 1:
        return found
    found = found * (4 * point - 1)[:, None]
    for number, (a, b) in enumerate(nodes.edges(problem.space)):
        middle = 4 * values[cells[:, corners + number]]
        found[:, a] += point[b] * middle
        found[:, b] += point[a] * middle
    return found


def _put_strain(strain: Array, points: Array, values: Array) -> None:
    """Put the symmetric gradients of linear functions into tensors (c, 3, 3).

    Args:
        strain: the tensors, zero across a plane body.
        points: the corners of the cells, (c, d+1, d).
        values: of the functions at the corners, (c, d+1, d).
    """
    slopes = _slopes(np.ascontiguousarray(points.transpose(1, 2, 0)))
    corners = np.ascontiguousarray(values.transpose(1, 2, 0))
    rises = corners[1:] - corners[0]
    d = len(slopes)
    for i, j in itertools.combinations_with_replacement(range(d), 2):
        products = [rises[k, i] * slopes[k, j] + rises[k, j] * slopes[k, i] for k in range(d)]
        strain[:, i, j] = strain[:, j, i] = np.sum(products, axis=0) / 2


def _slopes(corners: Array) -> Array:
    """The gradients of the barycentric coordinates after the first of cells by their corners (d+1, d, c), (d, d, c)."""
    sides = corners[1:] - corners[0]
    if len(sides) == 2:
        (a, b), (c, e) = sides
        return np.array([[e, -c], [-b, a]]) / (a * e - b * c)
    crossed = [np.cross(sides[i - 2], sides[i - 1], axis=0) for i in range(3)]
    return np.array(crossed) / np.sum(sides[0] * crossed[0], axis=0)
