"""A whole result: every file of a folder that is being written but its log, in the order in which one needs another."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..model import dump_scene
from ..problem.stress import stress_of_parts
from ..report import page, solution_arrays
from ..report.errors import ReportError
from ..report.pictures.draw import PictureProcess, waiting
from ..runtime import writing
from ..runtime.cost import Timer
from ..runtime.mpi import is_processor_free, on_root
from ..typing import Array
from ..workflow import Solution
from . import gathering, tables, vtk_fields
from .output_folder import ResultFolder
from .summary import summary

_PATIENCE = 120.0
"""Seconds that pictures may take after all else is written."""


@dataclass(frozen=True, kw_only=True)
class BegunResult:
    """A result of which that is written from which pictures are drawn.

    Attributes:
        folder: being written.
        timer: where time goes.
        tell: is given a line on rank 0 where pictures or page cannot be made; that does not cost the run.
        pictures: what draws; None on other ranks than the first, and where nothing is to be drawn.
        sigma: the stress in the parts of the cells that this rank owns, N/m², (c, 3, 3); None where nothing was solved.
    """

    folder: ResultFolder
    timer: Timer
    tell: Callable[[str], None]
    pictures: PictureProcess | None
    sigma: Array | None

    def finish(self, solution: Solution, given: Mapping[str, Any], *, report: bool = True) -> dict[str, Any]:
        """Write all other files but ``run.log``. Collective.

        Args:
            solution: what was found, now with the estimate of its error.
            given: further entries of the summary.
            report: whether the page is written.

        Returns:
            The summary, on all ranks.
        """
        work, comm = self.folder.work, self.folder.comm
        with self.timer("output"):
            record = {**summary(solution), **given}
            _write_fields(work, solution, self.sigma)
            on_root(comm, self._draw, asleep=True)
            record["time"] = self.timer.report()
            on_root(comm, lambda: write_record(work, record))
            if report:
                on_root(comm, lambda: made("report", self.tell, lambda: page.write(work)))
        record["time"] = self.timer.report()
        on_root(comm, lambda: write_record(work, record))
        return record

    def _draw(self) -> None:
        """Have the pictures drawn, and wait for them."""
        if (drawing := self.pictures) is not None:
            drawing.begin()
            made("pictures", self.tell, lambda: drawing.finish(_PATIENCE))


def begin_whole(
    folder: ResultFolder,
    solution: Solution,
    timer: Timer,
    tell: Callable[[str], None],
    pictures: PictureProcess | None,
) -> BegunResult:
    """Write what pictures are drawn from; no estimate of an error is needed. Collective.

    They are drawn from now on where a processor of rank 0's machine is without a rank; else when nothing else but files
    is left to do, since drawing would then take the time of a rank for which the others wait.

    Args:
        folder: being written.
        solution: what was found.
        timer: where time goes.
        tell: is given a line on rank 0 where pictures or page fail.
        pictures: what draws; None on other ranks than the first, and where nothing is to be drawn.
    """
    comm, work, solved = folder.comm, folder.work, solution.solve_result
    with timer("output"):
        sigma = None if solved is None else stress_of_parts(solution.problem.bulk, solved.u)
        arrays, record = gathering.solution_arrays(solution, sigma), summary(solution)

        def write_basis() -> None:
            assert arrays is not None
            if arrays.parts:
                tables.write(work / "contact.csv", tables.CONTACT, tables.contact_rows(arrays.parts))
            solution_arrays.save(work / solution_arrays.FILE, arrays)
            writing.text(work / "scene.toml", dump_scene(solution.scene, folder.target))
            write_record(work, record)

        on_root(comm, write_basis)
        if is_processor_free(comm) and pictures is not None:
            pictures.begin()
    return BegunResult(folder=folder, timer=timer, tell=tell, pictures=pictures, sigma=sigma)


def _write_fields(folder: Path, solution: Solution, sigma: Array | None) -> None:
    """Write the fields for ParaView and ``boundary.csv``. Collective."""
    problem, mode = solution.problem, solution.solvability.direction
    states = () if solution.examination is None else solution.examination.states
    if sigma is not None:
        vtk_fields.write_body(folder / "displacement.pvd", solution, sigma)
    elif mode is not None:
        vtk_fields.write_escape(folder / "displacement.pvd", problem, mode)
    if states:
        vtk_fields.write_contact(folder / "contact.pvd", problem, states)
    rows = list(tables.boundary_rows(solution))
    on_root(problem.domain.mesh.comm, lambda: tables.write(folder / "boundary.csv", tables.BOUNDARY, rows))


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write ``summary.json``. Rank 0 only.

    Args:
        folder: where to.
        record: the summary.
    """
    writing.text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


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
            made("pictures", tell, lambda: started.append(stack.enter_context(waiting(folder.work, dimension))))
        yield next(iter(started), None)


def made(what: str, tell: Callable[[str], None], make: Callable[[], object]) -> None:
    """Make pictures or a page from the other files of a result; that they cannot be made costs a line. Rank 0 only.

    Args:
        what: what is made.
        tell: is given the line.
        make: makes it.

    Raises:
        NotWrittenError: a file could not be written: then the result is not whole.
    """
    try:
        make()
    except ReportError as error:
        tell(f"{what}: {error}")
