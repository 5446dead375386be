"""A solution as plain arrays on rank 0, in SI, whatever the ranks; its vertices are numbered as the unknowns are.

At degree 2 its vertices are the nodes, and its cells and facets the parts of those of the mesh: the once refined mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI

from ..certify.contact_state import ContactState
from ..effects import SurfaceLoad
from ..formula import Formula
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..report.solution_arrays import LoadArrays, PartArrays, Singles, SolutionArrays
from ..runtime.mpi import agree, joined
from ..solution import Solution
from ..typing import Array, Entities, Integers
from . import contact_rows


def solution_arrays(
    solution: Solution, von_mises: Singles | None = None, rows: Mapping[str, PartArrays] | None = None
) -> SolutionArrays | None:
    """A solution on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
        von_mises: of the parts of the cells that this rank owns, N/m², (c,); left out where it is None.
        rows: this rank's rows of the parts of Γc, where they are known already.
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
        fields["von_mises"] = von_mises
    gathered = {name: joined(comm, values) for name, values in fields.items()}
    sides = {name: _facets(problem, facets) for name, facets in problem.part_facets.items()}
    loads, regions = _loads(problem), _regions(problem)
    parts = joined_parts(comm, rows_of_parts(solution) if rows is None else rows)
    if comm.rank:
        return None
    return SolutionArrays(
        **gathered, degree=nodes.degree(problem.space), sides=sides, regions=regions, loads=loads, parts=parts
    )


def rows_of_parts(solution: Solution) -> dict[str, PartArrays]:
    """This rank's rows of the parts of Γc, by name; none where nothing was solved. Collective.

    Args:
        solution: what was found.
    """
    states = () if solution.examination is None else solution.examination.states
    return contact_rows.of_parts(solution.problem, states)


def _by_node(problem: Problem, u: fem.Function) -> Array:
    """The vectors at the nodes that this rank owns, (n, d)."""
    owned = problem.space.dofmap.index_map.size_local
    return np.asarray(spaces.values(problem.space, u.x.array)[:owned], dtype=np.float64)


def _cells(problem: Problem) -> Integers:
    """The cells that this rank owns by their global nodes, at degree 2 their parts, (c, d+1)."""
    return spaces.global_numbers(problem.space, nodes.linear_cells(problem.space))


def _facets(problem: Problem, facets: Entities) -> Integers:
    """Local facets by their global nodes, each once and ascending, (k, d); right on rank 0 alone. Collective."""
    corners = nodes.linear_facets(problem.space, facets)
    return _distinct(joined(problem.domain.mesh.comm, spaces.global_numbers(problem.space, corners)))


def _distinct(facets: Integers) -> Integers:
    """Facets each once and ascending, (k, d)."""
    return np.unique(np.sort(facets, axis=1), axis=0)


def _regions(problem: Problem) -> dict[str, Integers]:
    """The cells of each region, as numbers of the gathered cells; right on rank 0 alone. Collective."""
    comm, parts = problem.domain.mesh.comm, nodes.parts_of_cell(problem.space)
    owned = problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local
    first = int(sum(agree(comm, owned)[: comm.rank])) * parts

    def numbers(cells: Entities) -> Integers:
        own = np.asarray(cells[cells < owned], dtype=np.int64)
        return np.asarray((first + own[:, None] * parts + np.arange(parts)).ravel())

    return {name: joined(comm, numbers(cells)) for name, cells in sorted(problem.domain.regions.items())}


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
    vertices, first = np.unique(joined(comm, spaces.global_numbers(problem.space, local)), return_index=True)
    return LoadArrays(vertices=vertices, traction=joined(comm, traction)[first], pressure=joined(comm, pressure)[first])


def part_arrays(problem: Problem, states: Sequence[ContactState]) -> dict[str, PartArrays]:
    """The parts of Γc by name, sorted by it, on rank 0; elsewhere this rank's rows of them. Collective.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    return joined_parts(problem.domain.mesh.comm, contact_rows.of_parts(problem, states))


def joined_parts(comm: MPI.Comm, rows: Mapping[str, PartArrays]) -> dict[str, PartArrays]:
    """The parts of Γc on rank 0; elsewhere this rank's rows of them. Collective.

    Args:
        comm: the ranks.
        rows: of this rank, by part.
    """
    return {name: _joined_part(comm, own) for name, own in rows.items()}


def _joined_part(comm: MPI.Comm, rows: PartArrays) -> PartArrays:
    vertices = joined(comm, rows.vertices)
    facets = _distinct(joined(comm, rows.facets))
    return PartArrays(
        columns={name: joined(comm, values) for name, values in rows.columns.items()},
        vertices=vertices,
        facets=facets[np.isin(facets, vertices).all(axis=1)],
        weights=joined(comm, rows.weights),
        normals=joined(comm, rows.normals),
        drops=joined(comm, rows.drops),
    )
