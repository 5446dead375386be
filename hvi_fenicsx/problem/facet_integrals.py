"""Integrals over facets with curved edges, by quadrature."""

from __future__ import annotations

import basix
import numpy as np
from dolfinx import fem

from .. import compat
from ..mesh import nodes
from ..typing import Array, Entities
from . import spaces

_DEGREE = 12
"""Degree of the quadrature: areas are square roots of polynomials, nearly constant ones."""


def is_curved(space: fem.FunctionSpace) -> bool:
    """Whether the space lives on curved cells."""
    return compat.geometry_degree(space.mesh) > 1


def samples(space: fem.FunctionSpace, facets: Entities) -> tuple[Array, Array, Array]:
    """Quadrature points of facets of curved cells.

    Args:
        space: of degree 2.
        facets: local facets (f of them).

    Returns:
        The points (q of them), m, (f, q, d), their weights, whose sum is the facet's size, (f, q), and the
        displacement's basis functions there, (q, nodes).
    """
    d = space.mesh.geometry.dim
    at = nodes.points(space)[nodes.facet_nodes(space, facets)][:, :, :d]
    return from_nodes(at, spaces.edge_share(space))


def from_nodes(at: Array, share: float) -> tuple[Array, Array, Array]:
    """The same, for facets by their nodes.

    Args:
        at: the nodes, corners first, then midpoints of edges in the order of basix, m, (f, n, d).
        share: of an edge's function that goes to each of its ends (:func:`.spaces.edge_share`).
    """
    kind = {2: basix.CellType.interval, 3: basix.CellType.triangle}[at.shape[2]]
    places, weights = (np.asarray(part, dtype=np.float64) for part in basix.make_quadrature(kind, _DEGREE))
    element = basix.create_element(basix.ElementFamily.P, kind, 2, basix.LagrangeVariant.gll_warped)
    table = np.asarray(element.tabulate(1, places))[:, :, :, 0]
    slopes = np.einsum("iqn,fnd->fqid", table[1:], at)
    gram = np.einsum("fqid,fqjd->fqij", slopes, slopes)
    barycentric = np.column_stack([1 - places.sum(axis=1), places])
    functions = spaces.simplex_functions(2, barycentric, share)
    return np.einsum("qn,fnd->fqd", table[0], at), weights * np.sqrt(np.linalg.det(gram)), functions
