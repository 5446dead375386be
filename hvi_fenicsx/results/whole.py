"""A whole result: every file of a folder that is being written but its log, in the order in which one needs another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..errors import HviError
from ..report.html import render
from ..report.pictures import draw as pictures
from ..runtime.mpi import on_root
from ..runtime.timing import Timer
from ..solution import Solution
from .folder import ResultFolder
from .write import write, write_record


def write_whole(
    folder: ResultFolder,
    solution: Solution,
    timer: Timer,
    given: Mapping[str, Any],
    tell: Callable[[str], None],
    *,
    draw: bool,
) -> dict[str, Any]:
    """Write all files of a result but ``run.log``. Collective.

    Pictures and report are made from the other files; one that fails costs a line, not the run.

    Args:
        folder: being written.
        solution: what was found.
        timer: where time goes.
        given: further entries of the summary.
        tell: is given that line, on rank 0.
        draw: whether to make pictures.

    Returns:
        The summary, on all ranks.
    """
    work, comm = folder.work, folder.comm
    with timer("output"):
        record = {**write(work, solution, folder.target), **given}
        if draw:
            on_root(comm, lambda: _from_files("pictures", pictures.draw, work, record, tell))
    with timer("output"):
        record["time"] = timer.report()
        on_root(comm, lambda: _from_files("report", render.write, work, record, tell))
    record["time"] = timer.report()
    on_root(comm, lambda: write_record(work, record))
    return record


def _from_files(
    what: str, make: Callable[[Path], object], folder: Path, record: dict[str, Any], tell: Callable[[str], None]
) -> None:
    write_record(folder, record)
    try:
        make(folder)
    except HviError as error:
        tell(f"{what}: {error}")
