"""All files of a load path but its log, into a folder that is being written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any

import numpy as np

from ..certify import certificate
from ..model import dump_scene
from ..paths.load_path import LoadPath
from ..paths.state import End
from ..report import page
from ..results import vtk_fields, whole
from ..results.gathering import contact_parts
from ..results.output_folder import ResultFolder
from ..results.summary import plain, summary
from ..runtime import writing
from ..runtime.mpi import on_root
from ..workflow import unsolved
from .certifying import ALWAYS
from .following import PathRun

JOURNAL = "path.journal"
"""The file in which the states of a path are kept while it is followed."""


def shown_rows(path: LoadPath, most: int) -> list[int]:
    """The rows that a film shows: start, jumps, turns, end and largest factor, then limit points and others evenly.

    Args:
        path: the path.
        most: so many at most.
    """
    if not path.rows:
        return []
    last, chosen = len(path.rows) - 1, list[int]()
    marked = [n for n, row in enumerate(path.rows) if row.event in ALWAYS]
    for rows in ([0, last, path.peak, *marked], path.folds, range(last + 1)):
        rest, room = np.array(sorted({*rows} - {*chosen}), dtype=np.int64), most - len(chosen)
        places = np.linspace(0, len(rest) - 1, min(len(rest), room)).round().astype(int)
        chosen += rest[places].tolist()
    return sorted(chosen)


def write(
    folder: ResultFolder,
    run: PathRun,
    path: LoadPath,
    given: Mapping[str, Any],
    tell: Callable[[str], None],
    *,
    draw: bool,
) -> dict[str, Any]:
    """Write all files of a path but ``run.log``. Collective.

    Args:
        folder: being written.
        run: that found the path.
        path: the path.
        given: further entries of the summary.
        tell: is given a line where picture or page cannot be made, on rank 0.
        draw: whether to make a picture.

    Returns:
        The summary, on all ranks.
    """
    comm, timer, work = folder.comm, run.prepared.timer, folder.work
    with timer("output"):
        # time is the row: the factor may fall
        shown = shown_rows(path, run.wanted.states)
        frames = ((float(row), path.rows[row].factor, run.displacement(row)) for row in shown)
        vtk_fields.write_series(work / "displacement.pvd", run.prepared.problem, frames)
        rows = list(_contact_rows(run))
        if run.interrupted():
            path = replace(path, end=End.INTERRUPTED, reason=path.reason or "its files were being written")
        folder.unfinished = path.end == End.INTERRUPTED
        outcome = {"converged": path.converged, "reason": path.headline, "exit_code": int(path.exit_code)}
        outcome |= {"method": "path", "path": plain(path.summary())}
        record = {**summary(unsolved(run.prepared)), **outcome, **given}
        on_root(comm, lambda: _write_on_root(folder, run, path, record, rows))
        if path.rows and draw:
            on_root(comm, lambda: whole.made("picture", tell, lambda: page.draw(work)))
        if path.rows:
            on_root(comm, lambda: whole.made("report", tell, lambda: page.write_path(work)))
    record["time"] = timer.report()
    on_root(comm, lambda: whole.write_record(work, record))
    return record


def _contact_rows(run: PathRun) -> Iterator[tuple[Any, ...]]:
    """The rows of ``path_contact.csv``: at the factors that were asked for, until a signal. On rank 0; collective."""
    for factor in takewhile(lambda _: not run.interrupted(), run.wanted.contact_at):
        for row, problem, u in run.crossings(factor):
            found = certificate.examine(problem, u, run.prepared.scene.solver.tolerance)
            parts = contact_parts(problem, found.states)
            yield from ((row, float(factor), *cells) for cells in whole.contact_rows(parts))


def _write_on_root(
    folder: ResultFolder, run: PathRun, path: LoadPath, record: dict[str, Any], rows: Sequence[tuple[Any, ...]]
) -> None:
    """Tables, scene and summary. Rank 0 only."""
    work = folder.work
    whole.write_path(work / "path.csv", path)
    if rows:
        whole.write_table(work / "path_contact.csv", ("row", "factor", *whole.CONTACT), rows)
    writing.text(work / "scene.toml", dump_scene(run.prepared.scene, folder.target))
    whole.write_record(work, record)
