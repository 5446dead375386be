"""The files of ``hvi equilibria`` beside the result folders: the table and the summary."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import results
from ..certify.contact_state import ContactState
from ..errors import ExitCode
from ..results.write import write_record
from ..runtime import memory, versions, writing
from ..runtime.mpi import largest, on_root
from ..scene import Scene, dump_scene
from ..stationary_points.bodies import Equilibria
from ..stationary_points.found import Found
from ..stationary_points.point_list import StationaryPoint
from ..stationary_points.search import falls_passed
from ..workflow import Preparation, Solution

TABLE = "equilibria.csv"
COLUMNS = ("index", "energy", "kind", "max_slip", "max_opening", "broken", "folder")


@dataclass(frozen=True, kw_only=True)
class Row:
    """One equilibrium in ``equilibria.csv``.

    Attributes:
        index: from 1, by energy.
        energy: J/m or J.
        kind: minimiser, saddle or undecided.
        max_slip: largest |u_t| on Γc, m.
        max_opening: largest displacement off the obstacle, m.
        broken: unknowns of Γc beyond a drop of their law, or on or beyond a falling part.
        folder: of its result.
        isolated: False where it stands for a continuum.
        certified: whether its certificate passed.
    """

    index: int
    energy: float
    kind: str
    max_slip: float
    max_opening: float
    broken: int
    folder: str
    isolated: bool
    certified: bool


def row(index: int, bodies: Equilibria, point: StationaryPoint, solution: Solution, folder: str) -> Row:
    """The row of an equilibrium. Collective.

    Args:
        index: from 1, by energy.
        bodies: that were searched.
        point: the equilibrium.
        solution: the same of the whole bodies.
        folder: of its result.
    """
    problem, examination = solution.problem, solution.examination
    assert bodies.problem is not None
    assert examination is not None
    comm, unit = problem.domain.mesh.comm, problem.scales.displacement
    slip = max((_largest(np.linalg.norm(s.slip, axis=1)) for s in examination.states), default=0.0)
    opening = max((_largest(_opening(s)) for s in examination.states), default=0.0)
    return Row(
        index=index,
        energy=examination.energy * problem.scales.energy,
        kind=point.kind,
        max_slip=largest(comm, slip) * unit,
        max_opening=largest(comm, opening) * unit,
        broken=falls_passed(bodies.problem, point.x) if point.x.size else 0,
        folder=folder,
        isolated=point.isolated,
        certified=solution.converged,
    )


def _opening(state: ContactState) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.where(np.isfinite(state.gap), state.gap, -state.normal)


def _largest(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(np.max(values, initial=0.0))


def write(
    folder: results.ResultFolder, prepared: Preparation, found: Found, rows: list[Row], code: ExitCode, command: str
) -> None:
    """Write table, summary and scene. Collective.

    Args:
        folder: being written.
        prepared: the scene.
        found: by the search.
        rows: of its equilibria.
        code: what the command ends with.
        command: the command line.
    """
    record = _record(prepared, found, rows, code, command)
    on_root(folder.comm, lambda: _write(folder, prepared.scene, found, rows, record))


def _write(folder: results.ResultFolder, scene: Scene, found: Found, rows: list[Row], record: dict[str, Any]) -> None:
    with writing.told(folder.work / TABLE), (folder.work / TABLE).open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows([_cell(getattr(r, name)) for name in COLUMNS] for r in rows)
    writing.text(folder.work / "scene.toml", dump_scene(scene, folder.target))
    write_record(folder.work, record)


def _cell(value: object) -> str:
    return repr(float(value)) if isinstance(value, float) else str(value)


def _record(prepared: Preparation, found: Found, rows: list[Row], code: ExitCode, command: str) -> dict[str, Any]:
    """``summary.json``. Collective."""
    scales, comm = prepared.problem.scales, prepared.system.comm
    bound = math.nan if found.lower_bound is None else found.lower_bound * scales.energy
    return dict(
        results.plain(
            {
                "scene": prepared.scene.title,
                "dofs": prepared.system.dofs,
                "ranks": comm.size,
                "reason": found.reason,
                "exit_code": int(code),
                "equilibria": {
                    "count": len(rows),
                    "complete": found.complete,
                    "lowest_energy": rows[0].energy if rows else None,
                    "lower_bound": bound,
                    "gap": found.gap,
                    "proven": found.proven,
                    "nodes": found.nodes,
                    "continua": [r.index for r in rows if not r.isolated],
                    "barriers": barriers(found, rows),
                    "uncertified": [r.index for r in rows if not r.certified],
                },
                "solvability": prepared.solvability.summary(),
                "time": {name: largest(comm, value) for name, value in prepared.timer.report().items()},
                "peak_memory_mb": memory.peak(comm),
                "versions": versions.versions(),
                "command": command,
            }
        )
    )


def barriers(found: Found, rows: list[Row]) -> list[dict[str, Any]]:
    """The saddles that join two minimisers, and how far they are above these; by the rows' indices.

    Args:
        found: by the search.
        rows: of its equilibria.
    """
    return [
        {
            "saddle": rows[p.saddle].index,
            "between": [rows[m].index for m in p.minimisers],
            "energy": rows[p.saddle].energy,
            "heights": [rows[p.saddle].energy - rows[m].energy for m in p.minimisers],
        }
        for p in found.passes
    ]
