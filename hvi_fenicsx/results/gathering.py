"""A solution as plain arrays, in SI, on rank 0; its vertices are numbered as the unknowns are.

At degree 2 its vertices are the nodes, and its cells and facets the parts of those of the mesh: the once refined mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..effects import SurfaceLoad
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..problem.stress import stress_of_parts, von_mises
from ..report.reader import Result
from ..report.solution_arrays import LoadArrays, SolutionArrays
from ..runtime.mpi import agree, joined
from ..typing import Array, Entities, Integers
from ..workflow import Solution
from .contact_parts import contact_parts
from .summary import summary


def result(solution: Solution) -> Result | None:
    """A solution in memory as a finished result, of which pictures are made, on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
    """
    solved = solution.solve_result
    stress = None if solved is None else stress_of_parts(solution.problem.bulk, solved.u)
    arrays, record = solution_arrays(solution, stress), summary(solution)
    return (
        None
        if arrays is None
        else Result(folder=Path("."), scene={"title": solution.scene.title}, summary=record, arrays=arrays)
    )


def solution_arrays(solution: Solution, stress: Array | None = None) -> SolutionArrays | None:
    """A solution on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
        stress: in the parts of the cells that this rank owns, N/m², (c, 3, 3); left out where it is None.
    """
    problem = solution.problem
    comm, d, owned = problem.domain.mesh.comm, problem.scales.dimension, problem.space.dofmap.index_map.size_local
    fields = {"points": problem.positions[:owned, :d], "cells": _cells(problem)}
    if solution.solve_result is not None:
        u = spaces.values(problem.space, solution.solve_result.u.x.array)
        fields["displacement"] = np.asarray(u[:owned], dtype=np.float64) * problem.scales.displacement
    elif (mode := solution.solvability.direction) is not None:
        fields["escape_mode"] = problem.bodies.motion(np.asarray(problem.points / problem.scales.length), mode)[:owned]
    if stress is not None:
        fields["von_mises"] = von_mises(stress).astype(np.float32)
    found: dict[str, Any] = {name: joined(comm, values) for name, values in fields.items()}
    found |= {"sides": {name: _facets(problem, facets) for name, facets in problem.part_facets.items()}}
    found |= {"regions": _regions(problem), "loads": _loads(problem)}
    found["parts"] = contact_parts(problem, () if solution.examination is None else solution.examination.states)
    return None if comm.rank else SolutionArrays(degree=nodes.degree(problem.space), **found)


def _cells(problem: Problem) -> Integers:
    """The cells that this rank owns by their global nodes, at degree 2 their parts, (c, d+1)."""
    return spaces.global_numbers(problem.space, nodes.linear_cells(problem.space))


def _facets(problem: Problem, facets: Entities) -> Integers:
    """The facets that ranks know by their global nodes, each once and ascending, (k, d); on rank 0. Collective."""
    corners = spaces.global_numbers(problem.space, nodes.linear_facets(problem.space, facets))
    return np.unique(joined(problem.domain.mesh.comm, np.sort(corners, axis=1)), axis=0)


def _regions(problem: Problem) -> dict[str, Integers]:
    """The cells of each region, by their numbers among the cells of all ranks; on rank 0. Collective."""
    comm, parts = problem.domain.mesh.comm, nodes.parts_of_cell(problem.space)
    owned = problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local
    first = int(sum(agree(comm, owned)[: comm.rank]))

    def numbers(cells: Entities) -> npt.NDArray[Any]:
        own = first + cells[cells < owned].astype(np.int64)
        return joined(comm, (own[:, None] * parts + np.arange(parts)).ravel())

    return {name: numbers(cells) for name, cells in sorted(problem.domain.regions.items())}


def _loads(problem: Problem) -> dict[str, LoadArrays]:
    """The loads by part; on rank 0. Collective."""
    found: dict[str, list[SurfaceLoad]] = {}
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is not None and load is not None:
            found.setdefault(where, []).append(load)
    return {name: _load(problem, problem.part_facets[name], loads) for name, loads in found.items()}


def _load(problem: Problem, facets: Entities, loads: Sequence[SurfaceLoad]) -> LoadArrays:
    """The loads on one part, added up, each vertex once; on rank 0. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    local = np.unique(nodes.facet_nodes(problem.space, facets))
    values = np.zeros((len(local), d + 1))
    for load in loads:
        for i, component in enumerate(load.components):
            values[:, i] += component.at(problem.positions[local])
        if load.pressure is not None:
            values[:, d] += load.pressure.at(problem.positions[local])
    numbers, every = (joined(comm, own) for own in (spaces.global_numbers(problem.space, local), values))
    vertices, first = np.unique(numbers, return_index=True)
    return LoadArrays(vertices=vertices, traction=every[first, :d], pressure=every[first, d])
