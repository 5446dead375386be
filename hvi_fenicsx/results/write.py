"""All files of a run, into a folder that is being written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..problem.stress import von_mises
from ..report.solution_arrays import FILE, SolutionArrays, save
from ..runtime.mpi import on_root
from ..scene import dump_scene
from ..solution import Solution
from . import boundary_table, contact_table, gathering, vtk_fields
from .summary import summary


def write(folder: Path, solution: Solution, target: Path) -> dict[str, Any]:
    """Write the fields (all ranks), the tables and the arrays (rank 0). Collective.

    ``summary.json`` is written by :func:`write_record`, once the pictures are there too.

    Args:
        folder: where to.
        solution: what was found.
        target: the folder that the files will be in, from which the scene's paths are given.

    Returns:
        The summary, on all ranks.
    """
    problem, examination, solved = solution.problem, solution.examination, solution.solve_result
    comm = problem.domain.mesh.comm
    states = () if examination is None else examination.states
    stress = None
    if solved is not None:
        sigma = problem.bulk.stress(solved.u)
        stress = von_mises(sigma).astype(np.float32)
        vtk_fields.write_body(folder / "displacement.pvd", solution, sigma)
    elif solution.solvability.direction is not None:
        vtk_fields.write_escape(folder / "displacement.pvd", problem, solution.solvability.direction)
    if states:
        vtk_fields.write_contact(folder / "contact.pvd", problem, states)
    rows = boundary_table.rows(solution)
    on_root(comm, lambda: boundary_table.write_csv(folder / "boundary.csv", rows))
    arrays = gathering.solution_arrays(solution, stress)
    on_root(comm, lambda: _write_arrays(folder, arrays))
    on_root(comm, lambda: _text(folder / "scene.toml", dump_scene(solution.scene, target)))
    return summary(solution)


def _write_arrays(folder: Path, arrays: SolutionArrays | None) -> None:
    """``solution.npz``, and ``contact.csv`` where there is contact or a law. Rank 0 only."""
    assert arrays is not None
    if arrays.parts:
        contact_table.write_csv(folder / "contact.csv", arrays.parts)
    save(folder / FILE, arrays)


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write ``summary.json``. Rank 0 only.

    Args:
        folder: where to.
        record: the summary.
    """
    _text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
