"""A whole result: every file of a folder that is being written but its log, in the order in which one needs another."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..model import Model, dump_scene
from ..problem.stress import stress_of_parts
from ..report import page, solution_arrays
from ..report.pictures.draw import draw
from ..report.solution_arrays import ReportError, SolutionArrays
from ..runtime import writing
from ..runtime.cost import Timer
from ..runtime.mpi import on_root
from ..typing import Array
from ..workflow import Solution
from . import gathering, tables, vtk_fields
from .output_folder import ResultFolder
from .summary import summary


def write_whole(
    folder: ResultFolder,
    solution: Solution,
    given: Mapping[str, Any],
    timer: Timer,
    tell: Callable[[str], None],
    *,
    pictures: bool = True,
    report: bool = True,
) -> dict[str, Any]:
    """Write all files but ``run.log``. Collective.

    Args:
        folder: being written.
        solution: what was found.
        given: further entries of the summary.
        timer: where time goes.
        tell: is given a line on rank 0 where pictures or page cannot be made; that does not cost the run.
        pictures: whether pictures are drawn.
        report: whether the page is written.

    Returns:
        The summary, on all ranks.
    """
    work, comm, solved = folder.work, folder.comm, solution.solve_result
    with timer("output"):
        sigma = None if solved is None else stress_of_parts(solution.problem.bulk, solved.u)
        arrays, record = gathering.solution_arrays(solution, sigma), {**summary(solution), **given}
        on_root(comm, lambda: _write_basis(folder, solution.scene, arrays, record))
        _write_fields(work, solution, sigma)
        if pictures:
            on_root(comm, lambda: made("pictures", tell, lambda: draw(work)), asleep=True)
        record["time"] = timer.report()
        on_root(comm, lambda: write_record(work, record))
        if report:
            on_root(comm, lambda: made("report", tell, lambda: page.write(work)))
    record["time"] = timer.report()
    on_root(comm, lambda: write_record(work, record))
    return record


def _write_basis(folder: ResultFolder, scene: Model, arrays: SolutionArrays | None, record: dict[str, Any]) -> None:
    """Write what pictures are drawn from. Rank 0 only."""
    assert arrays is not None
    work = folder.work
    if arrays.parts:
        tables.write(work / "contact.csv", tables.CONTACT, tables.contact_rows(arrays.parts))
    solution_arrays.save(work / solution_arrays.FILE, arrays)
    writing.text(work / "scene.toml", dump_scene(scene, folder.target))
    write_record(work, record)


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
