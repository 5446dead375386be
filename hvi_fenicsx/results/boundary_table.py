"""``boundary.csv``: the vertices of every boundary table of the scene."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from dolfinx import fem

from ..problem.problem import Problem
from ..typing import Array

COLUMNS = ("part", "x", "y", "z")


def rows(problem: Problem, parts: Mapping[str, Sequence[str]]) -> list[tuple[str, Array]]:
    """The vertices of each part, m, (m, 3), on rank 0; elsewhere empty. Collective.

    Args:
        problem: what was solved.
        parts: the sides, or physical groups, that each part stands on.
    """
    return [(name, _vertices(problem, on)) for name, on in parts.items()]


def _vertices(problem: Problem, on: Sequence[str]) -> Array:
    space = problem.space
    facets = problem.domain.facets(on)
    dofs = fem.locate_dofs_topological(space, problem.domain.dimension - 1, facets)
    owned = np.unique(dofs[dofs < space.dofmap.index_map.size_local])
    gathered = problem.domain.mesh.comm.gather(problem.points[owned], root=0)
    found = np.concatenate(gathered) if gathered else np.empty((0, 3))
    return found[np.lexsort(found.T[::-1])]


def write_csv(path: Path, table: Sequence[tuple[str, Array]], dimension: int) -> None:
    """Write the table; z is empty in the plane. Rank 0 only.

    Args:
        path: the file.
        table: the vertices of each part, m, (m, 3).
        dimension: of the body, 2 or 3.
    """
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for part, points in table:
            cells = [[repr(float(c)) for c in point[:dimension]] for point in points]
            writer.writerows([part, *cell, *[""] * (3 - dimension)] for cell in cells)
