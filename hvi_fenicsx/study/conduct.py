"""A study conducted: its points solved one after the other, measured against the reference, and written into a folder.

A point's name is a digest of its scene and the mesh file's content. The journal of a folder has a record for each
finished point, so a study that is resumed, or widened by further axes, finds what it has; the reference itself is
solved again where a point is missing.
"""

from __future__ import annotations

import gc
import json
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpi4py import MPI

from ..errors import ExitCode, HviError, InputError
from ..report import page
from ..report.solution_arrays import ReportError
from ..results import ResultFolder
from ..results.gathering import solution_arrays
from ..results.summary import summary
from ..results.whole import write_table
from ..runtime import log, writing
from ..runtime.cost import Timer
from ..runtime.manifest import MARKS, __version__
from ..runtime.mpi import largest, on_root, time_over
from ..runtime.writing import Journal, Record, understood
from ..schema import Finite, Positive, Table
from ..solvers.method import never
from ..workflow import Solution, find_solution, prepare
from . import pictures
from .errors import Fields, ReferenceSolution, mesh_width, stiffness
from .plan import Plan, Point
from .table import PHASES, Study, evaluate

JOURNAL = "study.journal"
"""The file in which finished points are kept."""
PATIENCE = 15.0
"""Seconds after which no further repetition of a point begins."""
_LOG = log.logger("study")


class _PointRecord(Table):
    """What the journal has of a point: as in :class:`.Row`, with the seconds after which it was given up."""

    point: str
    dofs: int | None
    converged: bool
    reason: str
    exit_code: int
    energy: Finite | None
    epsilon: Finite | None
    iterations: dict[str, int | None] | None
    seconds: Positive | None
    runs: int | None
    phases: dict[str, Finite] | None
    h: Positive | None = None
    errors: dict[str, Finite | None] | None = None
    epsilon_part: dict[str, Finite | None] | None = None
    limit: Positive | None = None


class NoReferenceError(HviError):
    """There is nothing to measure against; the exit code is that of the reference's run."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code


class StudyInterruptedError(HviError):
    """Ctrl-C or SIGTERM: the finished points are kept."""

    exit_code = ExitCode.INTERRUPTED


def _fill(work: Path, study: Study) -> list[str]:
    """Write tables, pictures and page of a study; what could not be done, in words. Rank 0 only."""
    pictures.draw(study, work)
    lines = study.lines()
    write_table(work / "study.csv", list(lines[0]), ([*line.values()] for line in lines))
    text = json.dumps(study.as_data(), indent=1, ensure_ascii=False, allow_nan=False)
    writing.text(work / MARKS["study"], f"{text}\n")
    try:
        page.write_study(work)
    except ReportError as error:  # it costs a line, not the study
        return [str(error)]
    return []


@dataclass(kw_only=True)
class Measurement:
    """How the points of a study are solved, and what they cost and found.

    Attributes:
        plan: what is run.
        comm: the ranks that solve it.
        repeats: solves of each point at most, for the median of its time.
        limit: seconds after which a point is given up; never the reference.
        interrupted: whether to stop; collective.
        known: the records of finished points by their names; on rank 0 alone.
    """

    plan: Plan
    comm: MPI.Comm
    repeats: int
    limit: float | None = None
    interrupted: Callable[[], bool] = never
    known: dict[str, Record] = field(default_factory=dict)
    _journal: Journal | None = None
    _reference: ReferenceSolution | None = None
    _exact: tuple[Point | None, Fields | None] = (None, None)

    def conduct(
        self, target: Path | None, *, force: bool = False, resume: bool = False, inputs: Iterable[Path] = ()
    ) -> tuple[Study, list[str]]:
        """Solve, measure and write a study; the same on all ranks. Collective.

        Args:
            target: the folder where it goes; None: nowhere.
            force: whether a study that is in the folder is begun anew.
            resume: whether it is gone on with.
            inputs: files that must not be replaced.

        Returns:
            What was found, and warnings about what could not be done or was moved aside.

        Raises:
            InputError: the folder cannot be used; on all ranks alike, as all errors.
            NoReferenceError: no solution exists (3), or the reference is not certified (4).
            StudyInterruptedError: it was asked to stop; finished points are kept.
        """
        plan, comm = self.plan, self.comm
        if target is None:
            self.run()
            return on_root(comm, lambda: evaluate(plan, self.known, comm.size)), []
        with ResultFolder(
            comm, target, force=force, resume=resume and not force, inputs=inputs, kind="study"
        ) as folder:
            folder.unfinished = True  # it may be gone on with along further axes
            on_root(comm, lambda: self._resume(folder))
            self.run()
            with understood(folder.target / JOURNAL):
                study = on_root(comm, lambda: evaluate(plan, self.known, comm.size))
            warnings = on_root(comm, lambda: _fill(folder.work, study))
            folder.commit(plan.own.scene)
            return study, [*warnings, *folder.kept]

    def _resume(self, folder: ResultFolder) -> None:
        """Keep records in a journal, and know those of the same reference in it. Rank 0 only."""
        known = folder.begin_journal(JOURNAL, [self.plan.reference[0].name, f"{__version__} {self.comm.size}"])
        self._journal = folder.journal
        try:
            self.known = {_PointRecord.made(record).point: record for record in known}
        except InputError as error:
            raise InputError(f"{folder.target / JOURNAL}: {error}; --force begins anew") from None

    def run(self) -> None:
        """Solve what is not finished, the reference first: without it the rest is in vain. Collective.

        Raises:
            NoReferenceError: no solution exists (3), or the reference is not certified (4); on all ranks alike.
            StudyInterruptedError: it was asked to stop; on all ranks alike.
            NotWrittenError: a record cannot be written; on all ranks alike.
        """
        finest, *coarser = self.plan.reference
        points = [*coarser, *self.plan.points]
        missing = on_root(self.comm, lambda: [n for n, point in enumerate(points) if not self._has(point)])
        if not missing and on_root(self.comm, lambda: self._has(finest)):
            return
        self._begin(finest)
        for number in missing:
            _LOG.info("%s of %s points: %s", number + 1, len(points), points[number], extra={"moving": True})
            self._one(points[number])

    def _has(self, point: Point) -> bool:
        """Whether a point is finished, or was given up after no less time than now. Rank 0 only."""
        record = self.known.get(point.name)
        if record is None:
            return False
        given_up = record.get("limit")
        return given_up is None or (self.limit is not None and given_up >= self.limit)

    def _keep(self, record: Record) -> None:
        """Rank 0 only."""
        self.known[record["point"]] = record
        if self._journal is not None:
            self._journal.append(record)

    def _begin(self, finest: Point) -> None:
        """Solve the reference. Collective."""
        _LOG.info("reference: %s", finest, extra={"moving": True})
        record, solution = self._measured(finest, None)
        if solution is None:
            text = (
                f"the reference ({finest.mesh}, exact law) has no certified solution: {record['reason']}; "
                "see `hvi run`, or choose coarser meshes with --axis mesh=..."
            )
            raise NoReferenceError(text, record["exit_code"] or ExitCode.NOT_CONVERGED)
        arrays, matrix = solution_arrays(solution), stiffness(solution)
        if arrays is not None and matrix is not None:
            self._reference = ReferenceSolution(arrays, matrix, finest.scene.body.interfaces)
        on_root(self.comm, lambda: self._keep(record))

    def _one(self, point: Point) -> None:
        """Measure a point; one that fails is a result too. Collective."""
        record, solution = self._measured(point, self.limit)
        found, exact = self._fields(solution), self.plan.exact_like(point)
        if point == exact:
            self._exact = point, found
        smoothed = bool(point.scene.solver.smoothing) and solution is not None
        if smoothed and self._exact[0] != exact:
            self._exact = exact, self._fields(self._measured(exact, None, repeats=0)[1])
        on_root(self.comm, lambda: self._keep({**record, **self._errors(found, smoothed=smoothed)}))

    def _errors(self, found: Fields | None, *, smoothed: bool) -> Record:
        """What is measured of a point's fields, which a failed one has not. Rank 0 only."""
        reference, exact = self._reference, self._exact[1]
        if found is None or reference is None:
            return {}
        part = reference.errors(found, exact) if smoothed and exact is not None else None
        return {"errors": reference.errors(found), "epsilon_part": part}

    def _fields(self, solution: Solution | None) -> Fields | None:
        """A certified solution on the reference's nodes, on rank 0; None for another. Collective."""
        arrays, reference = None if solution is None else solution_arrays(solution), self._reference
        return None if arrays is None or reference is None else reference.transfer(arrays)

    def _measured(
        self, point: Point, limit: float | None, repeats: int | None = None
    ) -> tuple[Record, Solution | None]:
        """A point's record and, if it is certified, its solution. Collective."""
        over = time_over(self.comm, limit)
        try:
            record, solution = self._timed(point, over, self.repeats if repeats is None else repeats)
        except HviError as error:
            record, solution = _failed(str(error), error.exit_code), None
        if self.interrupted():
            raise StudyInterruptedError("interrupted; what is finished is kept, --resume goes on from there")
        if solution is None and over():
            reason = f"not finished after {limit:g} s; --limit SECONDS --resume gives it longer"
            record = {**_failed(reason, ExitCode.NOT_CONVERGED), "limit": limit}
        return {**record, "point": point.name}, solution

    def _timed(self, point: Point, over: Callable[[], bool], repeats: int) -> tuple[Record, Solution | None]:
        """Solve it once to fill caches, and again for the median of its time. Collective."""
        solution = self._solved(point, Timer(), over)
        whole = summary(solution)
        record: dict[str, Any] = {key: whole[key] for key in _PointRecord.model_fields if key in whole}
        times = [whole["time"]]
        while record["converged"] and self._again(times, repeats):
            gc.collect()
            timer = Timer()
            self._solved(point, timer, never)
            times.append({phase: largest(self.comm, seconds) for phase, seconds in timer.report().items()})
        record |= _cost(times[1:] or times)
        arrays = solution_arrays(solution) if record["converged"] else None
        record |= {} if arrays is None else {"h": mesh_width(arrays)}
        return record, solution if record["converged"] else None

    def _again(self, times: Sequence[Mapping[str, float]], repeats: int) -> bool:
        """Whether one more run is wanted; rank 0 decides. Collective."""
        wanted = len(times) <= repeats and sum(map(_seconds, times[1:] or times)) < PATIENCE and not self.interrupted()
        return bool(self.comm.bcast(wanted, root=0))

    def _solved(self, point: Point, timer: Timer, over: Callable[[], bool]) -> Solution:
        """Collective."""
        prepared = prepare(point.scene, self.comm, timer)
        found = find_solution(prepared, interrupted=lambda: self.interrupted() or over())
        found.free()
        return found.solution


def _failed(reason: str, code: int) -> dict[str, Any]:
    """The record of a point that has no certified solution."""
    return dict.fromkeys(_PointRecord.model_fields) | {"converged": False, "reason": reason, "exit_code": code}


def _seconds(times: Mapping[str, float]) -> float:
    """The cost of one run by its times by phase, s."""
    return sum(times[phase] for phase in PHASES)


def _cost(times: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """The median cost and the median of each phase, s, and the number of runs."""
    phases = {phase: statistics.median(t[phase] for t in times) for phase in PHASES}
    return {"seconds": statistics.median(map(_seconds, times)), "runs": len(times), "phases": phases}
