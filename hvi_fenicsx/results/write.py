"""All files of a run, into a folder that is being written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..runtime.log import Journal
from ..runtime.mpi import on_root
from ..scene import dump_scene
from ..workflow import Solution
from . import boundary_table, contact_table, vtk_fields
from .summary import summary


def write(folder: Path, solution: Solution) -> dict[str, Any]:
    """Write the fields (all ranks) and the tables (rank 0); returns the summary, on all ranks. Collective.

    ``summary.json`` and ``run.log`` are written by :func:`write_record`, once the pictures are there too.
    """
    problem, examination, solved = solution.problem, solution.examination, solution.solve_result
    comm = problem.domain.mesh.comm
    if solved is not None and examination is not None:
        vtk_fields.write_body(folder / "displacement.pvd", problem, solved.u, solution.estimate)
        if examination.states:
            vtk_fields.write_contact(folder / "contact.pvd", problem, examination.states)
        rows = contact_table.rows(problem, examination.states)
        on_root(comm, lambda: contact_table.write_csv(folder / "contact.csv", rows) if examination.states else None)
    elif solution.solvability.direction is not None:
        vtk_fields.write_escape(folder / "displacement.pvd", problem, solution.solvability.direction)
    lying = boundary_table.rows(problem, solution.scene.parts)
    on_root(comm, lambda: boundary_table.write_csv(folder / "boundary.csv", lying, problem.scales.dimension))
    on_root(comm, lambda: _text(folder / "scene.toml", dump_scene(solution.scene)))
    return summary(solution)


def write_record(folder: Path, record: dict[str, Any], journal: Journal) -> None:
    """``summary.json`` and ``run.log``. Rank 0 only."""
    _text(folder / "run.log", "\n".join(journal.lines) + "\n")
    _text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
