"""A solution as plain arrays on rank 0, in SI, whatever the ranks; its vertices are numbered as the unknowns are.

At degree 2 its vertices are the nodes, and its cells and facets the parts of those of the mesh: the once refined mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI

from ..certify.contact_state import ContactState
from ..effects import Direction, SurfaceLoad
from ..formula import Formula
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..report.solution_arrays import LoadArrays, PartArrays, Singles, SolutionArrays
from ..runtime.mpi import agree
from ..solution import Solution
from ..typing import Array, Entities, Integers
from . import arc_length, contact_table


def solution_arrays(solution: Solution, von_mises: Singles | None = None) -> SolutionArrays | None:
    """A solution on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
        von_mises: of the cells that this rank owns, N/m², (c,); left out where it is None.
    """
    problem = solution.problem
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    owned = problem.space.dofmap.index_map.size_local
    fields: dict[str, npt.NDArray[Any]] = {"points": problem.positions[:owned, :d], "cells": _cells(problem)}
    if solution.solve_result is not None:
        fields["displacement"] = _by_node(problem, solution.solve_result.u) * problem.scales.displacement
    elif solution.solvability.direction is not None:
        points = np.asarray(problem.points / problem.scales.length)
        fields["escape_mode"] = problem.bodies.motion(points, solution.solvability.direction)[:owned]
    if von_mises is not None:
        fields["von_mises"] = np.repeat(von_mises, nodes.parts_of_cell(problem.space))
    gathered = {name: _joined(comm, values) for name, values in fields.items()}
    sides = {name: _facets(problem, facets) for name, facets in problem.part_facets.items()}
    loads, regions = _loads(problem), _regions(problem)
    parts = part_arrays(problem, () if solution.examination is None else solution.examination.states)
    if comm.rank:
        return None
    return SolutionArrays(
        **gathered, degree=nodes.degree(problem.space), sides=sides, regions=regions, loads=loads, parts=parts
    )


def _by_node(problem: Problem, u: fem.Function) -> Array:
    """The vectors at the nodes that this rank owns, (n, d)."""
    owned = problem.space.dofmap.index_map.size_local
    return np.asarray(spaces.values(problem.space, u.x.array)[:owned], dtype=np.float64)


def _cells(problem: Problem) -> Integers:
    """The cells that this rank owns by their global nodes, at degree 2 their parts, (c, d+1)."""
    return _globally(problem, nodes.linear_cells(problem.space))


def _globally(problem: Problem, vertices: Entities) -> Integers:
    """Local vertices of any shape by their global numbers."""
    found = problem.space.dofmap.index_map.local_to_global(np.ascontiguousarray(vertices, dtype=np.int32).ravel())
    return np.asarray(found, dtype=np.int64).reshape(vertices.shape)


def _facets(problem: Problem, facets: Entities) -> Integers:
    """Local facets by their global nodes, each once and ascending, (k, d); right on rank 0 alone. Collective."""
    corners = nodes.linear_facets(problem.space, facets)
    return np.unique(np.sort(_joined(problem.domain.mesh.comm, _globally(problem, corners)), axis=1), axis=0)


def _regions(problem: Problem) -> dict[str, Integers]:
    """The cells of each region, as numbers of the gathered cells; right on rank 0 alone. Collective."""
    comm, parts = problem.domain.mesh.comm, nodes.parts_of_cell(problem.space)
    owned = problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local
    first = int(sum(agree(comm, owned)[: comm.rank])) * parts

    def numbers(cells: Entities) -> Integers:
        own = np.asarray(cells[cells < owned], dtype=np.int64)
        return np.asarray((first + own[:, None] * parts + np.arange(parts)).ravel())

    return {name: _joined(comm, numbers(cells)) for name, cells in sorted(problem.domain.regions.items())}


def _loads(problem: Problem) -> dict[str, LoadArrays]:
    """The loads of each part that are no formulas, which a reader of files cannot evaluate. Collective."""
    found: dict[str, list[SurfaceLoad]] = {}
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is not None and load is not None and not all(isinstance(v, Formula) for v in load.values):
            found.setdefault(where, []).append(load)
    return {name: _load(problem, problem.part_facets[name], loads) for name, loads in found.items()}


def _load(problem: Problem, facets: Entities, loads: Sequence[SurfaceLoad]) -> LoadArrays:
    """Loads on one part, added up; right on rank 0 alone. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    local = np.unique(nodes.facet_nodes(problem.space, facets))
    traction, pressure = np.zeros((len(local), d)), np.zeros(len(local))
    for load in loads:
        for i, component in enumerate(load.components):
            traction[:, i] += component.at(problem.positions[local])
        if load.pressure is not None:
            pressure += load.pressure.at(problem.positions[local])
    vertices, first = np.unique(_joined(comm, _globally(problem, local)), return_index=True)
    return LoadArrays(
        vertices=vertices, traction=_joined(comm, traction)[first], pressure=_joined(comm, pressure)[first]
    )


def part_arrays(problem: Problem, states: Sequence[ContactState]) -> dict[str, PartArrays]:
    """The parts of Γc by name, sorted by it, on rank 0; elsewhere empty. Collective.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    ordered = sorted(states, key=lambda state: state.surface.part)
    found = {state.surface.part: _part(problem, state) for state in ordered}
    return {name: part for name, part in found.items() if part is not None}


def _part(problem: Problem, state: ContactState) -> PartArrays | None:
    """A part in the order of ``contact.csv``. Collective."""
    comm, scales, surface = problem.domain.mesh.comm, problem.scales, state.surface
    columns = {name: _joined(comm, values) for name, values in contact_table.columns(problem, state).items()}
    vertices = _joined(comm, _globally(problem, surface.blocks))
    weights = _joined(comm, surface.weights * scales.length ** (scales.dimension - 1))
    normals = _joined(comm, surface.normals)
    slips = [law.term for law in state.laws if law.term.direction is Direction.SLIP]
    each = [term.stretch[:, None] * term.exact.concave.kinks for term in slips]
    drops = _joined(comm, np.concatenate([np.empty((len(surface.weights), 0)), *each], axis=1))
    facets = _facets(problem, surface.facets)
    if scales.dimension == 2:
        pairs = _joined(comm, arc_length.edges(problem, surface))
    if comm.rank:
        return None
    if scales.dimension == 2:
        order, s = arc_length.along(np.column_stack([columns["x"], columns["y"]]), vertices, pairs)
        columns = {name: values[order] for name, values in columns.items()} | {"s": s}
    else:
        order = arc_length.lexicographic(np.column_stack([columns[axis] for axis in "xyz"]))
        columns = {name: values[order] for name, values in columns.items()}
    return PartArrays(
        columns=columns,
        vertices=vertices[order],
        facets=facets[np.isin(facets, vertices).all(axis=1)],
        weights=weights[order],
        normals=normals[order],
        drops=drops[order] * scales.displacement,
    )


def _joined(comm: MPI.Comm, values: npt.NDArray[Any]) -> Any:
    """What all ranks have, one after the other, on rank 0; elsewhere their own. Collective."""
    pieces = comm.gather(np.ascontiguousarray(values), root=0)
    return values if pieces is None else np.concatenate(pieces)
