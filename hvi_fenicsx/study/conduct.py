"""A study conducted: its points solved and measured, its tables, pictures and page written into a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path

from mpi4py import MPI

from ..report import page
from ..report.solution_arrays import ReportError
from ..results import ResultFolder
from ..results.output_folder import Existing
from ..runtime import writing
from ..runtime.manifest import MARKS
from ..runtime.mpi import on_root
from ..solvers.method import never
from . import pictures
from .measure import Measurement, Records
from .plan import Plan
from .table import Study, evaluate

JOURNAL = "study.journal"
"""The file in which finished points are kept."""


def conduct(
    plan: Plan,
    comm: MPI.Comm,
    target: Path | None,
    *,
    repeats: int,
    existing: Existing = "refuse",
    inputs: Iterable[Path] = (),
    limit: float | None = None,
    interrupted: Callable[[], bool] = never,
) -> tuple[Study, list[str]]:
    """Solve, measure and write a study; the same on all ranks. Collective.

    Args:
        plan: what is run.
        comm: the ranks that solve it.
        target: the folder where it goes; None: nowhere.
        repeats: solves of each point at most, for the median of its time.
        existing: what to do with a study that is in the folder.
        inputs: files that must not be replaced.
        limit: seconds after which a point is given up; None: never.
        interrupted: whether to stop; collective.

    Returns:
        What was found, and warnings about what could not be done or was moved aside.

    Raises:
        InputError: the folder cannot be used; on all ranks alike, as all errors.
        NoReferenceError: no solution exists (3), or the reference is not certified (4).
        StudyInterruptedError: it was asked to stop; finished points are kept.
    """

    def found(records: Records) -> Study:
        Measurement(records=records, comm=comm, repeats=repeats, limit=limit, interrupted=interrupted).run(plan)
        return on_root(comm, lambda: evaluate(plan, records, comm.size))

    if target is None:
        return found(Records()), []
    with ResultFolder(comm, target, existing, inputs, kind="study") as folder:
        known = [Records()]
        on_root(comm, lambda: known.append(_opened(folder, plan, anew=existing == "replace")))
        study = found(known[-1])
        warnings = on_root(comm, lambda: _fill(folder.work, study))
        folder.commit(plan.own.scene, keep=[JOURNAL])
        return study, [*warnings, *folder.kept]


def _opened(folder: ResultFolder, plan: Plan, *, anew: bool) -> Records:
    """What is known of the points. Rank 0 only."""
    file = folder.announce(JOURNAL)
    if anew:
        file.unlink(missing_ok=True)
    return Records.of(file, plan, folder.comm.size)


def _fill(work: Path, study: Study) -> list[str]:
    """Write tables, pictures and page of a study; what could not be done, in words. Rank 0 only."""
    pictures.draw(study, work)
    writing.text(work / "study.csv", study.as_csv())
    text = json.dumps(study.as_data(), indent=1, ensure_ascii=False, allow_nan=False)
    writing.text(work / MARKS["study"], f"{text}\n")
    try:
        page.write_study(work)
    except ReportError as error:  # it costs a line, not the study
        return [str(error)]
    return []
