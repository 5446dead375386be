"""A solution as studies compare it: the displacement, and what contact and laws do on Γc; made from its arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import basix
import numpy as np

from ..mesh import nodes
from ..report import solution_arrays
from ..report.contact_part import ContactPart
from ..report.solution_arrays import SolutionArrays
from ..typing import Array, Integers, Mask


@dataclass(frozen=True, kw_only=True)
class PartFields:
    """A part of Γc with m nodes, in d dimensions.

    Attributes:
        facets: segments or triangles by their nodes, counted from 0 within the part, (k, d).
        quadratic: the facets of degree 2 by their nodes, corners first, (q, nodes); their parts begin ``facets``.
        points: the nodes, m, (m, d).
        weights: lumped lengths or areas, m or m², (m,).
        normals: outward unit normals, (m, d).
        slip: u_t, m, as vectors, (m, d): tangents may turn their sign from node to node of a curved part.
        friction: -σ_t, N/m², likewise; zero where no law acts along the part, since the residual there is rounding.
        pressure: σ_n, negative in compression, N/m², (m,); zero where neither contact nor a law acts across the part.
        contact: 1 where the part is closed, (m,).
        drops: the slips at which the friction law drops at each node, m, (m, j).
        bounded: whether the part has contact.
    """

    facets: Integers
    quadratic: Integers
    points: Array
    weights: Array
    normals: Array
    slip: Array
    friction: Array
    pressure: Array
    contact: Array
    drops: Array
    bounded: bool


@dataclass(frozen=True)
class SolutionFields:
    """A solution with n nodes, in d dimensions.

    Attributes:
        points: the nodes, m, (n, d).
        cells: the nodes of each cell, corners first, (c, nodes).
        u: the displacement, m, (n, d).
        parts: the parts of Γc by name.
    """

    points: Array
    cells: Integers
    u: Array
    parts: Mapping[str, PartFields]

    @property
    def corners(self) -> Integers:
        """The vertices of each cell, (c, d+1)."""
        return self.cells[:, : self.points.shape[1] + 1]


def fields(arrays: SolutionArrays) -> SolutionFields:
    """What is compared of a solution, which must have a displacement."""
    assert arrays.displacement is not None
    cells = arrays.cells if arrays.degree == 1 else nodes.joined(arrays.cells)
    ends = _edge_ends(cells, *arrays.points.shape)
    parts = {name: _part(part, arrays.points, ends) for name, part in arrays.parts.items()}
    return SolutionFields(arrays.points, cells, arrays.displacement, parts)


def _edge_ends(cells: Integers, count: int, d: int) -> Integers:
    """The vertices whose middle each node is, (n, 2); a vertex is named twice."""
    found = np.repeat(np.arange(count)[:, None], 2, axis=1)
    edges = basix.topology(basix.CellType[{2: "triangle", 3: "tetrahedron"}[d]])[1]
    for node, ends in zip(cells.T[d + 1 :], edges, strict=False):
        found[node] = cells[:, list(ends)]
    return found


def load(path: Path) -> SolutionFields:
    """What is compared of the solution in a file.

    Raises:
        ResultError: the file is missing or damaged.
    """
    return fields(solution_arrays.load(path))


def _part(part: ContactPart, points: Array, ends: Integers) -> PartFields:
    """A part in the order of the body's nodes."""
    order = np.argsort(part.vertices)
    facets, quadratic = _in_order(part.facets, ends)
    bounded = "contact" in part.columns
    return PartFields(
        facets=np.searchsorted(part.vertices[order], facets),
        quadratic=np.searchsorted(part.vertices[order], quadratic),
        points=points[part.vertices[order]],
        weights=part.weight[order],
        normals=part.normal[order],
        slip=part.vectors("slip")[order],
        friction=np.nan_to_num(part.vectors("friction")[order]),
        pressure=part["sigma_n"][order] * (bounded or "branch_n" in part.columns),
        contact=np.nan_to_num(part["contact"][order]),
        drops=part.drops[order],
        bounded=bounded,
    )


def _in_order(facets: Integers, ends: Integers) -> tuple[Integers, Integers]:
    """Facets with the parts of those of degree 2 first; and these by their nodes, where all their parts are there.

    Args:
        facets: by their nodes in the body, (k, d).
        ends: the vertices whose middle each node is, (n, 2).
    """
    middle = ends[:, 0] != ends[:, 1]
    candidates = _around(facets, ends, middle)
    if not len(candidates):
        return facets, candidates
    count = len(middle)
    there = _keys(facets, count)
    each = nodes.parts(candidates)
    whole = np.isin(_keys(each, count), there).reshape(len(candidates), -1).all(axis=1)
    of_whole = nodes.parts(candidates[whole])
    rest = facets[~np.isin(there, _keys(of_whole, count))]
    return np.vstack([of_whole, rest]), candidates[whole]


def _around(facets: Integers, ends: Integers, middle: Mask) -> Integers:
    """The facets of degree 2 about the midpoints in these facets, by their nodes, (q, nodes)."""
    if facets.shape[1] == 2:
        own = np.unique(facets)
        own = own[middle[own]]
        return np.column_stack([ends[own], own])
    centres = facets[middle[facets].all(axis=1)]
    corners = [_common(ends[centres[:, i]], ends[centres[:, j]]) for i, j in ((1, 2), (0, 2), (0, 1))]
    return np.column_stack([*corners, centres])


def _common(one: Integers, other: Integers) -> Integers:
    """The number that each pair shares with the other's, (k,)."""
    shared = (one[:, 0] == other[:, 0]) | (one[:, 0] == other[:, 1])
    return np.where(shared, one[:, 0], one[:, 1])


def _keys(facets: Integers, count: int) -> Integers:
    """A number for each facet, whatever the order of its nodes, (k,)."""
    return np.asarray(np.sort(facets, axis=1) @ count ** np.arange(facets.shape[1]))


def width(points: Array, cells: Integers) -> float:
    """The edge of an equilateral cell as large as the largest one, m: it halves where a mesh is refined uniformly.

    Args:
        points: the vertices, m, (n, d).
        cells: the vertices of each cell, (c, d+1).
    """
    corners = points[cells]
    d = corners.shape[1] - 1
    edges = (corners[:, 1:] - corners[:, :1])[:, :, :d]
    largest = float(np.max(np.abs(np.linalg.det(edges)), initial=0.0))
    return (largest * (2.0 / np.sqrt(3.0) if d == 2 else np.sqrt(2.0))) ** (1.0 / d)
