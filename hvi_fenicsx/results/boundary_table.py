"""``boundary.csv``: the vertices of every boundary table of the scene, with displacement, load and reaction, SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ..certify import placed_forces
from ..problem import part_areas, spaces
from ..problem.nodal_forces import NodalForces
from ..problem.problem import Problem
from ..runtime.row_order import RowOrder
from ..typing import Array, Entities
from ..workflow import Solution
from . import table_file

QUANTITIES = ("", "u_", "traction_", "reaction_")
"""The vertex, its displacement, the part's load there, what the part's support, contact and laws put on the body."""
COLUMNS = ("part", *(quantity + axis for quantity in QUANTITIES for axis in "xyz"))


def rows(solution: Solution) -> dict[str, Array]:
    """This rank's stretch of each part's rows, the columns after the first, (m, 12); NaN: an empty cell. Collective.

    Args:
        solution: what was found.
    """
    problem = solution.problem
    loads = placed_forces.loads(problem) if solution.forces is None else solution.forces.loads
    return {n: _sorted(problem, _columns(solution, loads, n, facets)) for n, facets in _places(solution).items()}


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


def _sorted(problem: Problem, columns: Array) -> Array:
    """This rank's stretch of the rows of all ranks, sorted by their points. Collective."""
    points = columns[:, : problem.scales.dimension]
    return RowOrder.of(problem.domain.mesh.comm, points).sorted(columns)


def write(comm: MPI.Comm, path: Path, table: Mapping[str, Array]) -> None:
    """Write the table. Collective.

    Args:
        comm: the ranks.
        path: the file.
        table: this rank's rows by part, as :func:`rows` gives them.

    Raises:
        InputError: on all ranks alike: it cannot be written.
    """
    table_file.write(comm, path, COLUMNS, (_cells(part, values) for part, values in table.items()))


def _cells(part: str, values: Array) -> Iterator[list[str]]:
    """The rows of a part as texts."""
    rows: Any = values.tolist()
    return ([part, *("" if math.isnan(v) else repr(v) for v in row)] for row in rows)
