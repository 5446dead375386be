"""All files of a run, into a folder that is being written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..journal import Journal
from ..parallel import on_root
from ..scene import dump_scene
from ..solution import Solution
from . import fields, sides, table
from .summary import summary


def write(folder: Path, solution: Solution) -> dict[str, Any]:
    """Write the fields (all ranks) and the tables (rank 0); returns the summary, on all ranks. Collective.

    ``summary.json`` and ``run.log`` are written by :func:`write_record`, once the pictures are there too.
    """
    problem, examined, solved = solution.problem, solution.examined, solution.solved
    comm = problem.domain.mesh.comm
    if solved is not None and examined is not None:
        fields.write_body(folder / "displacement.pvd", problem, solved.u, solution.estimate)
        if examined.states:
            fields.write_contact(folder / "contact.pvd", problem, examined.states)
        rows = table.rows(problem, examined.states)
        on_root(comm, lambda: table.write_csv(folder / "contact.csv", rows) if examined.states else None)
    elif solution.solvability.direction is not None:
        fields.write_escape(folder / "displacement.pvd", problem, solution.solvability.direction)
    lying = sides.rows(problem, solution.scene.parts)
    on_root(comm, lambda: sides.write_csv(folder / "boundary.csv", lying, problem.scales.dimension))
    on_root(comm, lambda: _text(folder / "scene.toml", dump_scene(solution.scene)))
    return summary(solution)


def write_record(folder: Path, record: dict[str, Any], journal: Journal) -> None:
    """``summary.json`` and ``run.log``. Rank 0 only."""
    _text(folder / "run.log", "\n".join(journal.lines) + "\n")
    _text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
