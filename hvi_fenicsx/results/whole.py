"""A whole result: every file of a folder that is being written but its log, in the order in which one needs another."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ..errors import HviError
from ..problem.cell_stress import mean_stress
from ..report.html import render
from ..report.pictures.draw import PictureProcess, waiting
from ..runtime.mpi import asleep_until_all, on_root
from ..runtime.timing import Timer
from ..solution import Solution
from .folder import ResultFolder
from .write import write_basis, write_fields, write_record

_PATIENCE = 120.0
"""Seconds that pictures may take after all else is written."""


def write_whole(
    folder: ResultFolder,
    solution: Solution,
    timer: Timer,
    given: Mapping[str, Any],
    tell: Callable[[str], None],
    pictures: PictureProcess | None,
    *,
    report: bool = True,
) -> dict[str, Any]:
    """Write all files of a result but ``run.log``. Collective.

    Pictures and report are made from the other files; one that fails costs a line, not the run. A process of its own
    draws, while one rank writes the fields. Several ranks write them before, and then leave it the processors: beside
    it each message between them would wait for one.

    Args:
        folder: being written.
        solution: what was found.
        timer: where time goes.
        given: further entries of the summary.
        tell: is given that line, on rank 0.
        pictures: what draws; None on other ranks than the first, and where nothing is to be drawn.
        report: whether the page is written.

    Returns:
        The summary, on all ranks.
    """
    work, comm, solved = folder.work, folder.comm, solution.solve_result
    with timer("output"):
        sigma = None if solved is None else mean_stress(solution.problem.bulk, solved.u)
        record = {**write_basis(work, solution, folder.target, sigma), **given}
        on_root(comm, lambda: write_record(work, record))
        if comm.size > 1:
            write_fields(work, solution, sigma)
        with _drawn(pictures, tell):
            if comm.size == 1:
                write_fields(work, solution, sigma)
        asleep_until_all(comm)
    with timer("output"):
        record["time"] = timer.report()
        on_root(comm, lambda: write_record(work, record))
        if report:
            on_root(comm, lambda: _told("report", tell, lambda: render.write(work)))
    record["time"] = timer.report()
    on_root(comm, lambda: write_record(work, record))
    return record


@contextlib.contextmanager
def picture_process(
    folder: ResultFolder, dimension: int, tell: Callable[[str], None], *, wanted: bool
) -> Iterator[PictureProcess | None]:
    """Start what will draw the pictures of a folder; None on other ranks than the first, and where there is none.

    Its libraries take half a second to load: who starts it before the solution is found need not wait for them.

    Args:
        folder: being written.
        dimension: of the body.
        tell: is given a line where it cannot be started, on rank 0.
        wanted: whether pictures are drawn.
    """
    with contextlib.ExitStack() as stack:
        started: list[PictureProcess] = []
        if wanted and folder.comm.rank == 0:
            _told("pictures", tell, lambda: started.append(stack.enter_context(waiting(folder.work, dimension))))
        yield next(iter(started), None)


@contextlib.contextmanager
def _drawn(pictures: PictureProcess | None, tell: Callable[[str], None]) -> Iterator[None]:
    """Draw pictures during a block, and wait for them at its end."""
    if pictures is None:
        yield
        return
    pictures.begin()
    yield
    _told("pictures", tell, functools.partial(pictures.finish, _PATIENCE))


def _told(what: str, tell: Callable[[str], None], make: Callable[[], object]) -> None:
    """Make something from the other files; a line says why it failed."""
    try:
        make()
    except HviError as error:
        tell(f"{what}: {error}")
