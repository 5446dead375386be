"""The files of a load path: what the run found, written, drawn and told on a page."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from .equilibrium_paths.state import End
from .load_path import LoadPath
from .path import journal
from .path.following import PathRun
from .report.html import path_page
from .results import ResultFolder, path_files
from .results.path_files import Crossing
from .results.whole import made
from .results.write import write_record
from .runtime import writing
from .runtime.mpi import on_root
from .workflow import unsolved


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
    comm, timer = folder.comm, run.prepared.timer
    with timer("output"):
        rows = path_files.shown_rows(path, run.wanted.states)
        frames = ((row, run.displacement(row)) for row in rows)
        solution = unsolved(run.prepared)
        record = path_files.write(folder.work, folder.target, solution, path, frames, _crossings(run))
        record = {**record, **given}
        on_root(comm, lambda: _from_files(folder, record, path, tell, draw=draw))
    record["time"] = timer.report()
    on_root(comm, lambda: write_record(folder.work, record))
    return record


def _crossings(run: PathRun) -> Iterator[Crossing]:
    for factor in run.wanted.contact_at:
        for row, problem, u in run.crossings(factor):
            yield Crossing(row=row, factor=factor, problem=problem, u=u)


def _from_files(
    folder: ResultFolder, record: dict[str, Any], path: LoadPath, tell: Callable[[str], None], *, draw: bool
) -> None:
    """Picture and page, from the other files; that one cannot be made costs a line. Rank 0 only."""
    write_record(folder.work, record)
    if path.end == End.INTERRUPTED and (folder.target / journal.NAME).exists():
        with writing.told(folder.work / journal.NAME):
            shutil.copyfile(folder.target / journal.NAME, folder.work / journal.NAME)
    if path.rows and draw:
        from .report.pictures import path_picture  # loads the plotting library

        made("picture", tell, lambda: path_picture.draw(folder.work))
    if path.rows:
        made("report", tell, lambda: path_page.write(folder.work))
