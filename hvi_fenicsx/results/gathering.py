"""A solution as plain arrays, in SI, by rank or on rank 0; its vertices are numbered as the unknowns are.

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
from ..report.contact_part import ContactPart
from ..report.solution_arrays import LoadArrays, Singles, SolutionArrays, members, of_members
from ..runtime.mpi import agree, joined
from ..runtime.row_order import RowOrder, distinct
from ..typing import Array, Entities, Integers
from ..workflow import Solution
from . import contact_rows


def solution_arrays(solution: Solution, von_mises: Singles | None = None) -> SolutionArrays | None:
    """A solution on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
        von_mises: of the parts of the cells that this rank owns, N/m², (c,); left out where it is None.
    """
    comm = solution.problem.domain.mesh.comm
    own = members(own_arrays(solution, von_mises, rows_of_parts(solution)))
    found = {key: joined(comm, values) if values.ndim else values for key, values in own.items()}
    return None if comm.rank else of_members(found)


def own_arrays(solution: Solution, von_mises: Singles | None, rows: Mapping[str, ContactPart]) -> SolutionArrays:
    """This rank's rows of each array: those of all ranks, one after the other, are the solution. Collective.

    Args:
        solution: what was found.
        von_mises: of the parts of the cells that this rank owns, N/m², (c,); left out where it is None.
        rows: this rank's rows of the parts of Γc.
    """
    problem = solution.problem
    d, owned = problem.scales.dimension, problem.space.dofmap.index_map.size_local
    fields: dict[str, npt.NDArray[Any]] = {"points": problem.positions[:owned, :d], "cells": _cells(problem)}
    if solution.solve_result is not None:
        fields["displacement"] = _by_node(problem, solution.solve_result.u) * problem.scales.displacement
    elif solution.solvability.direction is not None:
        points = np.asarray(problem.points / problem.scales.length)
        fields["escape_mode"] = problem.bodies.motion(points, solution.solvability.direction)[:owned]
    return SolutionArrays(
        **fields,
        von_mises=von_mises,
        degree=nodes.degree(problem.space),
        sides={name: _facets(problem, facets) for name, facets in problem.part_facets.items()},
        regions=_regions(problem),
        loads=_loads(problem),
        parts=rows,
    )


def rows_of_parts(solution: Solution) -> dict[str, ContactPart]:
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
    """This rank's stretch of facets by their global nodes, each once and ascending, (k, d). Collective."""
    corners = nodes.linear_facets(problem.space, facets)
    return distinct(problem.domain.mesh.comm, np.sort(spaces.global_numbers(problem.space, corners), axis=1))


def _regions(problem: Problem) -> dict[str, Integers]:
    """This rank's cells of each region, by their numbers among the cells of all ranks. Collective."""
    comm, parts = problem.domain.mesh.comm, nodes.parts_of_cell(problem.space)
    owned = problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local
    first = int(sum(agree(comm, owned)[: comm.rank])) * parts

    def numbers(cells: Entities) -> Integers:
        own = np.asarray(cells[cells < owned], dtype=np.int64)
        return np.asarray((first + own[:, None] * parts + np.arange(parts)).ravel())

    return {name: numbers(cells) for name, cells in sorted(problem.domain.regions.items())}


def _loads(problem: Problem) -> dict[str, LoadArrays]:
    """This rank's stretch of the loads that are no formulas, which a reader cannot evaluate, by part. Collective."""
    found: dict[str, list[SurfaceLoad]] = {}
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is not None and load is not None and not all(isinstance(v, Formula) for v in load.values):
            found.setdefault(where, []).append(load)
    return {name: _load(problem, problem.part_facets[name], loads) for name, loads in found.items()}


def _load(problem: Problem, facets: Entities, loads: Sequence[SurfaceLoad]) -> LoadArrays:
    """This rank's stretch of the loads on one part, added up, each vertex once. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    local = np.unique(nodes.facet_nodes(problem.space, facets))
    traction, pressure = np.zeros((len(local), d)), np.zeros(len(local))
    for load in loads:
        for i, component in enumerate(load.components):
            traction[:, i] += component.at(problem.positions[local])
        if load.pressure is not None:
            pressure += load.pressure.at(problem.positions[local])
    numbers = spaces.global_numbers(problem.space, local)
    order = RowOrder.of(comm, numbers[:, None].astype(np.float64))
    vertices, first = np.unique(order.sorted(numbers), return_index=True)
    return LoadArrays(vertices=vertices, traction=order.sorted(traction)[first], pressure=order.sorted(pressure)[first])


def part_arrays(problem: Problem, states: Sequence[ContactState]) -> dict[str, ContactPart]:
    """The parts of Γc by name, sorted by it, on rank 0; elsewhere this rank's rows of them. Collective.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    return {
        name: _joined(problem.domain.mesh.comm, own) for name, own in contact_rows.of_parts(problem, states).items()
    }


def _joined(comm: MPI.Comm, rows: ContactPart) -> ContactPart:
    columns = {name: joined(comm, values) for name, values in rows.columns.items()}
    others = {name: joined(comm, values) for name, values in vars(rows).items() if isinstance(values, np.ndarray)}
    return ContactPart(name=rows.name, columns=columns, **others)
