"""The files of ``hvi equilibria`` beside the result folders: the table and the summary."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..certify.contact_state import ContactState
from ..equilibrium_search.bodies import Equilibria
from ..equilibrium_search.found import Found
from ..equilibrium_search.search import falls_passed
from ..equilibrium_search.stationarity import StationaryPoint
from ..errors import ExitCode
from ..model import dump_scene
from ..results import ResultFolder, plain, tables
from ..results.summary import common
from ..results.whole import write_record
from ..runtime import writing
from ..runtime.mpi import largest, on_root
from ..typing import Array
from ..workflow import Preparation, Solution

TABLE = "equilibria.csv"
COLUMNS = ("index", "energy", "kind", "max_slip", "max_opening", "broken", "folder")


@dataclass(frozen=True, kw_only=True)
class EquilibriumRow:
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


def row(index: int, bodies: Equilibria, point: StationaryPoint, solution: Solution, folder: str) -> EquilibriumRow:
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
    return EquilibriumRow(
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


def _opening(state: ContactState) -> Array:
    return np.where(np.isfinite(state.gap), state.gap, -state.normal)


def _largest(values: Array) -> float:
    return float(np.max(values, initial=0.0))


def write(
    folder: ResultFolder, prepared: Preparation, found: Found, rows: list[EquilibriumRow], code: ExitCode, command: str
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
    entry = _entry(found, rows, prepared.problem.scales.energy)
    record = common(prepared) | plain(
        {"reason": found.reason, "exit_code": int(code), "equilibria": entry, "command": command}
    )

    def act() -> None:
        tables.write(folder.work / TABLE, COLUMNS, ([getattr(r, name) for name in COLUMNS] for r in rows))
        writing.text(folder.work / "scene.toml", dump_scene(prepared.scene, folder.target))
        write_record(folder.work, record)

    on_root(folder.comm, act)


def _entry(found: Found, rows: list[EquilibriumRow], unit: float) -> dict[str, Any]:
    """The entry ``equilibria`` of the summary."""
    return {
        "count": len(rows),
        "complete": found.complete,
        "lowest_energy": rows[0].energy if rows else None,
        "lower_bound": math.nan if found.lower_bound is None else found.lower_bound * unit,
        "gap": found.gap,
        "proven": found.proven,
        "nodes": found.nodes,
        "continua": [r.index for r in rows if not r.isolated],
        "uncertified": [r.index for r in rows if not r.certified],
    }
