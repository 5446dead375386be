"""A solution as studies compare it: the displacement, and what contact and laws do on Γc; made from its arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..report import solution_arrays
from ..report.solution_arrays import PartArrays, SolutionArrays
from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class PartFields:
    """A part of Γc with m vertices, in d dimensions.

    Attributes:
        facets: segments or triangles by their vertices, counted from 0 within the part, (k, d).
        points: the vertices, m, (m, d).
        weights: lumped lengths or areas, m or m², (m,).
        normals: outward unit normals, (m, d).
        slip: u_t, m, (m, d-1).
        friction: -σ_t, N/m², (m, d-1); zero where no law acts along the part, since the residual there is rounding.
        pressure: σ_n, negative in compression, N/m², (m,); zero where neither contact nor a law acts across the part.
        contact: 1 where the part is closed, (m,).
        drops: the slips at which the friction law drops, m, (j,).
        bounded: whether the part has contact.
    """

    facets: Integers
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
    """A solution with n vertices, in d dimensions.

    Attributes:
        points: the vertices, m, (n, d).
        cells: the vertices of each cell, (c, d+1).
        u: the displacement, m, (n, d).
        parts: the parts of Γc by name.
    """

    points: Array
    cells: Integers
    u: Array
    parts: Mapping[str, PartFields]


def fields(arrays: SolutionArrays) -> SolutionFields:
    """What is compared of a solution, which must have a displacement."""
    assert arrays.displacement is not None
    parts = {name: _part(part, arrays.points) for name, part in arrays.parts.items()}
    return SolutionFields(arrays.points, arrays.cells, arrays.displacement, parts)


def load(path: Path) -> SolutionFields:
    """What is compared of the solution in a file.

    Raises:
        ResultError: the file is missing or damaged.
    """
    return fields(solution_arrays.load(path))


def _part(part: PartArrays, points: Array) -> PartFields:
    """A part in the order of the body's vertices."""
    order = np.argsort(part.vertices)
    columns = {name: values[order] for name, values in part.columns.items()}
    bounded, slip = "contact" in columns, _tangential(columns, "u_t")
    return PartFields(
        facets=np.searchsorted(part.vertices[order], part.facets),
        points=points[part.vertices[order]],
        weights=part.weights[order],
        normals=part.normals[order],
        slip=slip,
        friction=_tangential(columns, "friction_t") if "friction_t1" in columns else np.zeros_like(slip),
        pressure=columns["sigma_n"] * (bounded or "branch_n" in columns),
        contact=columns["contact"] if bounded else np.zeros(len(order)),
        drops=part.drops,
        bounded=bounded,
    )


def _tangential(columns: Mapping[str, Array], name: str) -> Array:
    return np.column_stack([columns[f"{name}{i}"] for i in (1, 2) if f"{name}{i}" in columns])


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
