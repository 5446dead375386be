"""``boundary.csv``: the vertices of every boundary table of the scene, with displacement, load and reaction, SI."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..certify import placed_forces
from ..certify.placed_forces import NodalForces
from ..problem import part_areas, spaces
from ..problem.problem import Problem
from ..solution import Solution
from ..typing import Array, Entities

QUANTITIES = ("", "u_", "traction_", "reaction_")
"""The vertex, its displacement, the part's load there, what the part's support, contact and laws put on the body."""
COLUMNS = ("part", *(quantity + axis for quantity in QUANTITIES for axis in "xyz"))


def rows(solution: Solution) -> dict[str, Array]:
    """The columns after the first, by part, (m, 12) on rank 0; NaN where a cell is empty. Collective.

    Args:
        solution: what was found.
    """
    problem = solution.problem
    loads = placed_forces.loads(problem) if solution.forces is None else solution.forces.loads
    return {n: _gathered(problem, _columns(solution, loads, n, facets)) for n, facets in _places(solution).items()}


def _places(solution: Solution) -> dict[str, Entities]:
    """The local facets of the boundary tables and of the sides of interfaces, by name."""
    problem = solution.problem
    found = {name: problem.part_facets[name] for name in solution.scene.parts}
    sides = {f"{one.name}{placed_forces.SECOND}": one.sides.second for one in problem.interfaces}
    return found | {name: problem.domain.facets([side]) for name, side in sides.items()}


def _columns(solution: Solution, loads: Mapping[str, NodalForces], part: str, facets: Entities) -> Array:
    """The columns at the vertices of a part that this rank owns, in the order of the table, (m, 12). Collective."""
    problem, forces = solution.problem, solution.forces
    blocks = part_areas.vertices(problem, facets)
    d, scales = problem.scales.dimension, problem.scales
    found = np.full((len(blocks), len(QUANTITIES), 3), np.nan)
    found[:, 0, :d] = problem.positions[blocks, :d]
    if part in loads:
        found[:, 2, :d] = loads[part].at(blocks) * scales.force / part_areas.lumped(problem, facets)[blocks, None]
    if solution.solve_result is not None and forces is not None:
        found[:, 1, :d] = spaces.values(problem.space, solution.solve_result.u.x.array)[blocks] * scales.displacement
        reaction = forces.reactions.get(part)
        found[:, 3, :d] = 0.0 if reaction is None else reaction.at(blocks) * scales.force
    return found.reshape(len(blocks), len(COLUMNS) - 1)


def _gathered(problem: Problem, columns: Array) -> Array:
    """The rows of all ranks, sorted by their points, on rank 0; elsewhere its own. Collective."""
    gathered = problem.domain.mesh.comm.gather(columns, root=0)
    found = columns if gathered is None else np.concatenate(gathered)
    return np.asarray(found[np.lexsort(found[:, 2::-1].T)])


def write_csv(path: Path, table: Mapping[str, Array]) -> None:
    """Write the table. Rank 0 only.

    Args:
        path: the file.
        table: the columns after the first, by part, (m, 12); NaN leaves a cell empty.
    """
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for part, values in table.items():
            cells: Any = values.tolist()
            writer.writerows([part, *("" if math.isnan(v) else repr(v) for v in row)] for row in cells)
