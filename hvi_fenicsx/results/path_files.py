"""All files of a load path but its pictures and its log, into a folder that is being written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dolfinx import fem

from ..certify import certificate
from ..equilibrium_paths.state import Event
from ..load_path import LoadPath
from ..problem.problem import Problem
from ..runtime import writing
from ..runtime.mpi import on_root
from ..scene import dump_scene
from ..workflow import Solution
from . import contact_rows, contact_table, path_table, table_file, vtk_fields
from .summary import plain, summary

_SHOWN = frozenset({Event.START, Event.JUMP, Event.TURN, Event.END})
"""The events whose states a film shows first; limit points come after them."""


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A state at a factor that was asked for.

    Attributes:
        row: the last row before it.
        factor: λ.
        problem: at that factor; it holds until the next crossing is asked for.
        u: the displacement, nondimensional.
    """

    row: int
    factor: float
    problem: Problem
    u: fem.Function


def shown_rows(path: LoadPath, most: int) -> list[int]:
    """The rows that a film shows: start, jumps, turns, end and largest factor, then limit points and others evenly.

    Args:
        path: the path.
        most: so many at most.
    """
    if not path.rows:
        return []
    last = len(path.rows) - 1
    marked = [n for n, row in enumerate(path.rows) if row.event in _SHOWN]
    chosen = set(_evenly([*{*marked, path.peak, 0, last}], most))
    for others in (path.folds, range(last + 1)):
        rest = sorted(set(others) - chosen)
        chosen.update(_evenly(rest, min(most - len(chosen), max(most // 2, 1) if others is path.folds else most)))
    return sorted(chosen)


def _evenly(rows: Sequence[int], most: int) -> list[int]:
    """At most so many of some rows, evenly among them."""
    ordered = sorted(rows)
    if len(ordered) <= most:
        return ordered
    return [] if most < 1 else [ordered[round(i * (len(ordered) - 1) / max(most - 1, 1))] for i in range(most)]


def write(
    folder: Path,
    target: Path,
    solution: Solution,
    path: LoadPath,
    frames: Iterable[tuple[int, fem.Function]],
    crossings: Iterable[Crossing],
) -> dict[str, Any]:
    """Write tables, fields and scene. Collective.

    Args:
        folder: where to.
        target: the folder that the files will be in, from which the scene's paths are given.
        solution: scene and problem, nothing solved.
        path: the path.
        frames: rows with their displacements, nondimensional, for ``displacement.pvd``.
        crossings: states for ``path_contact.csv``.

    Returns:
        The summary, on all ranks.
    """
    problem, comm = solution.problem, solution.problem.domain.mesh.comm
    vtk_fields.write_series(folder / "displacement.pvd", problem, _timed(path, frames))
    tables = [rows for one in crossings for rows in _contact_rows(one, solution.scene.solver.tolerance)]
    on_root(comm, lambda: _write_tables(folder, target, solution, path))
    if tables:
        table_file.write(comm, folder / "path_contact.csv", ("row", "factor", *contact_table.COLUMNS), tables)
    return {**summary(solution), **_outcome(path)}


def _timed(path: LoadPath, frames: Iterable[tuple[int, fem.Function]]) -> Iterator[tuple[float, float, fem.Function]]:
    """Time is the row: the factor may fall."""
    return ((float(row), path.rows[row].factor, u) for row, u in frames)


def _contact_rows(crossing: Crossing, tolerance: float) -> list[list[tuple[str, ...]]]:
    """This rank's rows of ``path_contact.csv`` of one state, by part. Collective."""
    found = certificate.examine(crossing.problem, crossing.u, tolerance)
    start, parts = (str(crossing.row), repr(crossing.factor)), contact_rows.of_parts(crossing.problem, found.states)
    return [[(*start, *cells) for cells in contact_table.cells({name: rows})] for name, rows in parts.items()]


def _write_tables(folder: Path, target: Path, solution: Solution, path: LoadPath) -> None:
    path_table.write_csv(folder / "path.csv", path)
    writing.text(folder / "scene.toml", dump_scene(solution.scene, target))


def _outcome(path: LoadPath) -> dict[str, Any]:
    """What the summary of a path says in the place of a solution's."""
    entry = plain(path.summary())
    return {
        "converged": path.converged,
        "reason": path.headline,
        "exit_code": int(path.exit_code),
        "method": "path",
        "path": entry,
    }
