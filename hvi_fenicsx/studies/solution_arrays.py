"""What a solved point leaves behind: the displacement and the state of Γc as plain arrays, in SI, whatever the ranks.

Stored so, points of any meshes can be compared later, by one process, without solving anything again.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI
from scipy import sparse

from ..certify.contact_state import State
from ..effects import Direction
from ..mesh.vertex_dofs import dof_of_node
from ..problem.scaling import Scales
from ..typing import Array, Entities, Integers, Mask
from ..workflow import Solution


@dataclass(frozen=True)
class PartSample:
    """The vertices (m) of one part of Γc.

    Attributes:
        facets: its segments or triangles by their vertices, (k, d), counted from 0 within the part.
        points: m, (m, d). weights: lumped lengths or areas, SI, (m,). normals: outward unit, (m, d).
        slip: u_t in m, (m, d-1). friction: -σ_t in N/m², (m, d-1), and pressure: σ_n, negative in compression, (m,);
            zero where neither a law nor contact acts, since what the residual holds there is rounding.
        contact: 1 where closed, (m,). drops: the slips at which the friction law drops, m, (k,).
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
    bounded: Mask


@dataclass(frozen=True)
class Sample:
    """A solution: vertices (n, d) in m, cells (c, d+1), displacement (n, d) in m, and the parts of Γc by name."""

    points: Array
    cells: Integers
    u: Array
    parts: Mapping[str, PartSample]


def take(solution: Solution) -> Sample | None:
    """The sample of a solution on rank 0; None elsewhere. Collective."""
    assert solution.solve_result is not None
    assert solution.examination is not None
    space, scales = solution.problem.space, solution.problem.scales
    comm, d = space.mesh.comm, scales.dimension
    index_map = space.dofmap.index_map
    owned = index_map.size_local
    cells = space.mesh.topology.index_map(space.mesh.topology.dim).size_local
    points = solution.problem.points[:owned, :d]
    u = solution.solve_result.u.x.array.reshape(-1, d)[:owned] * scales.displacement
    corners = index_map.local_to_global(space.dofmap.list[:cells].ravel()).reshape(-1, d + 1)
    parts = {s.surface.part: _part(solution, s) for s in solution.examination.states}
    points, corners, u = (_joined(comm, a) for a in (points, corners, u))
    return None if comm.rank else Sample(points, corners, u, {k: p for k, p in parts.items() if p is not None})


def _part(solution: Solution, state: State) -> PartSample | None:
    """One part, gathered on rank 0. Collective."""
    space, scales = solution.problem.space, solution.problem.scales
    comm, to_global = space.mesh.comm, space.dofmap.index_map.local_to_global
    facets = _joined(comm, to_global(_corners(space, state).ravel()).reshape(-1, scales.dimension))
    numbers = _joined(comm, to_global(state.surface.blocks))
    gathered = {name: _joined(comm, values) for name, values in _columns(state, scales).items()}
    if comm.rank:
        return None
    order = np.argsort(numbers)
    inside = np.unique(np.sort(facets, axis=1), axis=0)
    drops = [t.exact.concave.kinks for t in state.terms if t.direction is Direction.SLIP]
    return PartSample(
        facets=np.searchsorted(numbers[order], inside),
        drops=np.concatenate([np.empty(0), *drops]) * scales.displacement,
        bounded=np.array(state.bounds is not None),
        **{name: values[order] for name, values in gathered.items()},
    )


def _corners(space: fem.FunctionSpace, state: State) -> Entities:
    """The local vertices of a part's facets, (f, d)."""
    d, facets = space.mesh.geometry.dim, state.surface.facets
    if not len(facets):
        return np.empty((0, d), dtype=np.int32)  # dolfinx divides by their number
    return dof_of_node(space)[dolfinx.mesh.entities_to_geometry(space.mesh, d - 1, facets)]


def _columns(state: State, scales: Scales) -> dict[str, Array]:
    """What a part's vertices (m) on this rank have, by the sample's names, SI."""
    d, surface = scales.dimension, state.surface
    rubs = any(t.direction is Direction.SLIP for t in state.terms)
    presses = state.bounds is not None or any(t.direction is not Direction.SLIP for t in state.terms)
    return {
        "points": surface.points[:, :d],
        "weights": surface.weights * scales.length ** (d - 1),
        "normals": surface.normals,
        "slip": state.slip * scales.displacement,
        "friction": state.friction * scales.stress * rubs,
        "pressure": state.pressure * scales.stress * presses,
        "contact": state.contact.astype(float),
    }


def _joined(comm: MPI.Comm, values: npt.NDArray[Any]) -> Any:
    pieces = comm.gather(np.ascontiguousarray(values), root=0)
    return values if pieces is None else np.concatenate(pieces)


def width(sample: Sample) -> float:
    """The edge of an equilateral cell as large as the largest one, m: refined uniformly, it halves."""
    corners = sample.points[sample.cells]
    d = corners.shape[1] - 1
    edges = (corners[:, 1:] - corners[:, :1])[:, :, :d]
    largest = float(np.max(np.abs(np.linalg.det(edges)), initial=0.0))
    return (largest * (2.0 / np.sqrt(3.0) if d == 2 else np.sqrt(2.0))) ** (1.0 / d)


def save(path: Path, sample: Sample) -> None:
    """Write a sample, whole or not at all."""
    arrays: dict[str, Any] = {"points": sample.points, "cells": sample.cells, "u": sample.u}
    for name, part in sample.parts.items():
        arrays |= {f"part:{name}:{key}": value for key, value in vars(part).items()}
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    with open(aside, "wb") as file:
        np.savez(file, **arrays)
    os.replace(aside, path)


def load(path: Path) -> Sample:
    """Read a sample."""
    with np.load(path) as stored:
        parts: dict[str, dict[str, Any]] = {}
        for key in stored.files:
            if key.startswith("part:"):
                name, column = key.removeprefix("part:").rsplit(":", 1)
                parts.setdefault(name, {})[column] = stored[key]
        found = {name: PartSample(**columns) for name, columns in parts.items()}
        return Sample(stored["points"], stored["cells"], stored["u"], found)


def stiffness(solution: Solution) -> sparse.csr_array | None:
    """The matrix of a(u, v) in the sample's numbering, nondimensional, on rank 0; None elsewhere. Collective.

    Its energy norm does not feel rigid motions.
    """
    problem = solution.problem
    matrix = problem.bulk.matrix()
    starts, columns, values = matrix.getValuesCSR()
    size = matrix.getSize()[0]
    matrix.destroy()
    comm = problem.space.mesh.comm
    counts, columns, values = (_joined(comm, a) for a in (np.diff(starts), columns, values))
    return None if comm.rank else sparse.csr_array((values, columns, np.append(0, np.cumsum(counts))), (size, size))
