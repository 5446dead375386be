"""The files of a solution, into a folder that is being written: first what pictures are made from, then the rest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..problem.stress import von_mises
from ..report.solution_arrays import FILE, members
from ..runtime import writing
from ..runtime.mpi import on_root
from ..scene import dump_scene
from ..typing import Array
from ..workflow import Solution
from . import array_file, boundary_table, contact_table, gathering, vtk_fields


def write_basis(folder: Path, solution: Solution, target: Path, sigma: Array | None) -> None:
    """Write the arrays, ``contact.csv`` and the scene, from which pictures and page are made. Collective.

    ``summary.json`` is written by :func:`write_record`.

    Args:
        folder: where to.
        solution: what was found.
        target: the folder that the files will be in, from which the scene's paths are given.
        sigma: the stress in the parts of the cells that this rank owns, N/m², (c, 3, 3); None where nothing was solved.
    """
    comm = solution.problem.domain.mesh.comm
    stress = None if sigma is None else von_mises(sigma).astype(np.float32)
    rows = gathering.rows_of_parts(solution)
    if rows:
        contact_table.write(comm, folder / "contact.csv", rows)
    array_file.write(comm, folder / FILE, members(gathering.own_arrays(solution, stress, rows)))
    on_root(comm, lambda: writing.text(folder / "scene.toml", dump_scene(solution.scene, target)))


def write_fields(folder: Path, solution: Solution, sigma: Array | None) -> None:
    """Write the fields for ParaView and ``boundary.csv``. Collective.

    Args:
        folder: where to.
        solution: what was found.
        sigma: as for :func:`write_basis`.
    """
    problem, mode = solution.problem, solution.solvability.direction
    states = () if solution.examination is None else solution.examination.states
    if sigma is not None:
        vtk_fields.write_body(folder / "displacement.pvd", solution, sigma)
    elif mode is not None:
        vtk_fields.write_escape(folder / "displacement.pvd", problem, mode)
    if states:
        vtk_fields.write_contact(folder / "contact.pvd", problem, states)
    boundary_table.write(problem.domain.mesh.comm, folder / "boundary.csv", boundary_table.rows(solution))


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write ``summary.json``. Rank 0 only.

    Args:
        folder: where to.
        record: the summary.
    """
    writing.text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
