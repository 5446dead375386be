"""The hierarchical complement of degree p in degree 2p: what a space of twice the degree has between the nodes.

Each function belongs to a multi-index a of sum 2p over the corners of a cell; its point has the barycentric coordinates
a/2p. The points at which all of a is even are the nodes of degree p. A bubble is the function of degree 2p that is 1 at
its own point and 0 at all others. At degree 1 there is one for every edge, 4 λ_a λ_b.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh

from ...typing import Array

Index = tuple[int, ...]
"""A multi-index over the corners of a cell or of a facet."""


def quadrature(cell: str, degree: int) -> tuple[Array, Array]:
    """Barycentric points (q, corners) and weights (q,), whose sum is 1, of a simplex.

    Args:
        cell: its name, such as "triangle".
        degree: of the polynomials that are integrated exactly.
    """
    made: tuple[Any, Any] = basix.make_quadrature(basix.CellType[cell], degree)
    points, weights = made
    return np.column_stack([1 - points.sum(axis=1), points]), weights / weights.sum()


def indices(degree: int, corners: Sequence[int], count: int) -> list[Index]:
    """The bubbles that some corners have together: those on the edge, on the face or in the cell between them.

    Args:
        degree: p.
        corners: of the edge, face or cell.
        count: of all corners of the cell or facet.
    """
    found = []
    for parts in itertools.product(range(2 * degree, 0, -1), repeat=len(corners)):
        if sum(parts) == 2 * degree and any(part % 2 for part in parts):
            at = dict(zip(corners, parts, strict=True))
            found.append(tuple(at.get(corner, 0) for corner in range(count)))
    return found


def of_facet(degree: int, dimension: int) -> list[Index]:
    """The bubbles of a facet, over its corners.

    Args:
        degree: p.
        dimension: of space.
    """
    sets = (ends for size in range(2, dimension + 1) for ends in itertools.combinations(range(dimension), size))
    return [index for corners in sets for index in indices(degree, corners, dimension)]


def of_cell(degree: int, cell: str) -> list[Index]:
    """The bubbles of a cell over its corners, in the order of the element's degrees of freedom.

    Args:
        degree: p.
        cell: the name of its shape.
    """
    return [index for entities in _by_entity(degree, cell) for found in entities for index in found]


def _by_entity(degree: int, cell: str) -> list[list[list[Index]]]:
    topology: Any = basix.topology(basix.CellType[cell])
    return [[indices(degree, corners, len(topology)) for corners in entities] for entities in topology]


def shape(index: Index, barycentric: Array) -> Array:
    """The values of a bubble at points, (q,).

    Args:
        index: of the bubble.
        barycentric: the points, (q, corners).
    """
    factors = (_factor(order, sum(index))(barycentric[:, corner]) for corner, order in enumerate(index))
    return np.asarray(functools.reduce(np.multiply, factors))


def slope(index: Index, corner: int, barycentric: Array) -> Array:
    """The derivative of a bubble by one of the barycentric coordinates at points, (q,).

    Args:
        index: of the bubble.
        corner: number of the coordinate.
        barycentric: the points, (q, corners).
    """
    factors = [_factor(order, sum(index)) for order in index]
    factors[corner] = factors[corner].deriv()
    values = (factor(barycentric[:, i]) for i, factor in enumerate(factors))
    return np.asarray(functools.reduce(np.multiply, values))


@functools.cache
def _factor(order: int, degree: int) -> np.polynomial.Polynomial:
    """The factor of a bubble of one barycentric coordinate: 1 at order/degree, 0 at the points before it."""
    found = np.polynomial.Polynomial([1.0])
    for step in range(order):
        found = found * np.polynomial.Polynomial([-step, degree]) / (step + 1)
    return found


@functools.cache
def element(cell: str, degree: int) -> Any:
    """The bubbles of a triangle or tetrahedron, a scalar element.

    Args:
        cell: the name of its shape.
        degree: p.
    """
    kind = basix.CellType[cell]
    corners = np.asarray(basix.geometry(kind), dtype=np.float64)
    by_entity, d = _by_entity(degree, cell), corners.shape[1]
    where: list[Any] = [[_points(found, corners) for found in entities] for entities in by_entity]
    what = [[np.eye(len(found)).reshape(len(found), 1, len(found), 1) for found in entities] for entities in by_entity]
    empty: list[Any] = [[]] * (3 - d)
    smooth, standard, none = basix.SobolevSpace.H1, basix.PolysetType.standard, -1  # no Lagrange space is contained
    coefficients, highest, identity = _coefficients(cell, degree), 2 * degree, basix.MapType.identity
    made: Any = basix.ufl.custom_element(
        kind, [], coefficients, where + empty, what + empty, 0, identity, smooth, False, none, highest, standard
    )
    return made


def _points(found: Sequence[Index], corners: Array) -> Array:
    """The points of bubbles in a cell, (bubbles, d)."""
    if not found:
        return np.zeros((0, corners.shape[1]))
    return np.asarray(np.array(found) / sum(found[0]) @ corners)


def _coefficients(cell: str, degree: int) -> Array:
    """The bubbles in the orthonormal polynomials of degree 2p, (bubbles, polynomials)."""
    barycentric, weights = quadrature(cell, 4 * degree)
    kind, points = basix.CellType[cell], barycentric[:, 1:]
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, 2 * degree, points)
    values = [shape(index, barycentric) for index in of_cell(degree, cell)]
    volume = 1.0 / math.factorial(barycentric.shape[1] - 1)
    return np.asarray(np.einsum("iq,q,jq->ij", np.array(values), volume * weights, legendre))


def space(mesh: dmesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Vector-valued bubbles. Collective.

    Args:
        mesh: the mesh.
        degree: p, that of the solution.
    """
    mesh.topology.create_entities(1)
    scalar = element(mesh.topology.cell_name(), degree)
    return fem.functionspace(mesh, basix.ufl.blocked_element(scalar, shape=(mesh.geometry.dim,)))
