"""A study conducted: its points solved and measured, its tables, pictures and page written into a folder."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from mpi4py import MPI

from ..errors import NotWrittenError
from ..model import Model
from ..report import page
from ..report.errors import ReportError
from ..results.folder import inputs_of
from ..results.output_folder import Existing, OutputFolder, placed
from ..runtime import writing
from ..runtime.manifest import MARKS
from ..runtime.mpi import on_root
from ..solvers.context import never
from . import pictures
from .measure import Measurement, Store, write_json
from .plan import Plan
from .table import Study, evaluate


def conduct(
    plan: Plan,
    comm: MPI.Comm,
    folder: Path | None,
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
        folder: where it goes; None: nowhere.
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
    with _target(comm, folder, existing, inputs) as (target, output):
        store = Store(target, comm.size)
        Measurement(store=store, comm=comm, repeats=repeats, limit=limit, interrupted=interrupted).run(plan)
        return on_root(comm, lambda: _finished(plan, store, output))


@contextmanager
def _target(
    comm: MPI.Comm, folder: Path | None, existing: Existing, inputs: Iterable[Path]
) -> Iterator[tuple[Path, OutputFolder | None]]:
    """The folder of the points, on all ranks; on rank 0, what writes it where the user wants it. Collective."""
    if folder is None:
        with tempfile.TemporaryDirectory() if comm.rank == 0 else nullcontext() as aside:
            yield Path(comm.bcast(aside, root=0)), None
        return
    made: list[OutputFolder] = []

    def opened() -> Path:
        output = OutputFolder(folder, "study")
        output.check(existing, inputs)
        made.append(output)
        if existing == "replace":
            output.clear()
        return output.target

    try:
        target = on_root(comm, opened)
        yield target, made[0] if made else None
    except NotWrittenError as error:  # named by the file in a folder that the user knows
        raise (made[0].in_words(error) if made else placed(error, target, None)) from None
    finally:
        for output in made:
            output.close()


def _finished(plan: Plan, store: Store, output: OutputFolder | None) -> tuple[Study, list[str]]:
    """Rank 0 only."""
    study = evaluate(plan, store)
    if output is None:
        return study, []
    with output.told():
        return study, fill(output, study, plan.own.scene, store)


def fill(output: OutputFolder, study: Study, scene: Model, store: Store) -> list[str]:
    """Write tables, pictures and page of a study beside its points.

    Args:
        output: the folder of the study.
        study: what was found.
        scene: what was studied.
        store: the points, in that folder.

    Returns:
        What could not be done, or was moved aside, in words.
    """
    work = output.stage()
    pictures.draw(study, work)
    writing.text(work / "study.csv", study.as_csv())
    write_json(work / MARKS["study"], study.as_data())
    warnings = []
    try:
        page.write_study(work)
    except ReportError as error:  # it costs a line, not the study
        warnings.append(str(error))
    return [*warnings, *output.move_in(inputs_of(scene, output.target), store.listed())]
