"""The points of a study, solved one after the other and measured against the reference; what is found is kept.

A point's name is a digest of its scene and the mesh file's content. The journal of a folder has a record for each
finished point, so a study that is resumed, or widened by further axes, finds what it has; the reference itself is
solved again where a point is missing.
"""

from __future__ import annotations

import gc
import hashlib
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpi4py import MPI

from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.control import Goal, solve_to_goal
from ..errors import ExitCode, HviError
from ..model import dump_scene
from ..results.gathering import solution_arrays
from ..results.summary import summary
from ..runtime import log
from ..runtime.cost import Timer
from ..runtime.manifest import __version__
from ..runtime.mpi import largest, on_root, time_over
from ..runtime.writing import Journal, Record
from ..solvers.method import never
from ..workflow import Solution, find_solution, prepare
from .errors import Fields, ReferenceSolution, stiffness
from .plan import Plan, Point
from .transfer import mesh_width

PHASES = ("mesh", "assembly", "setup", "solve", "certificate")
"""What a point costs: compilation is paid once for all, and a study writes no results."""
PATIENCE = 15.0
"""Seconds after which no further repetition of a point begins."""
_RECORDED = ("dofs", "converged", "reason", "exit_code", "energy", "epsilon", "iterations")
"""What is kept of a point's summary."""
_LOG = log.logger("study")


class NoReferenceError(HviError):
    """There is nothing to measure against; the exit code is that of the reference's run."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code


class StudyInterruptedError(HviError):
    """Ctrl-C or SIGTERM: the finished points are kept."""

    exit_code = ExitCode.INTERRUPTED


def name_of(point: Point) -> str:
    """The name of a point."""
    digest = hashlib.sha256(f"{point.accuracy}\n{dump_scene(point.scene)}".encode())
    for file in point.scene.files():
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(kw_only=True)
class Records:
    """What finished points cost and found, by their names; on rank 0 alone.

    Attributes:
        known: the records.
        journal: in which they are kept; None: nowhere.
    """

    known: dict[str, Record] = field(default_factory=dict)
    journal: Journal | None = None

    @classmethod
    def of(cls, file: Path, plan: Plan, ranks: int) -> Records:
        """Those of a journal, if they were measured against the reference of a plan.

        Args:
            file: the journal.
            plan: of the study.
            ranks: by how many ranks points are measured.
        """
        journal = Journal(file, f"{__version__} {ranks} {name_of(plan.reference[0])}")
        return cls(known={record["point"]: record for record in journal.records}, journal=journal)

    def add(self, record: Record) -> None:
        """Keep a record."""
        self.known[record["point"]] = record
        if self.journal is not None:
            self.journal.append(record)

    def has(self, point: Point, limit: float | None) -> bool:
        """Whether a point is finished, or was given up after no less time than now.

        Args:
            point: of the study.
            limit: seconds that a point may take.
        """
        record = self.known.get(name_of(point))
        if record is None:
            return False
        given_up = record.get("limit")
        return given_up is None or (limit is not None and given_up >= limit)


@dataclass(kw_only=True)
class Measurement:
    """How the points of a study are solved.

    Attributes:
        records: what is known, and is added; of rank 0.
        comm: the ranks that solve them.
        repeats: solves of each at most, for the median of its time.
        limit: seconds after which a point is given up; never the reference.
        interrupted: whether to stop; collective.
    """

    records: Records
    comm: MPI.Comm
    repeats: int
    limit: float | None = None
    interrupted: Callable[[], bool] = never

    def run(self, plan: Plan) -> None:
        """Solve what is not finished of a plan, the reference first: without it the rest is in vain. Collective.

        Raises:
            NoReferenceError: no solution exists (3), or the reference is not certified (4); on all ranks alike.
            StudyInterruptedError: it was asked to stop; on all ranks alike.
            NotWrittenError: a record cannot be written; on all ranks alike.
        """
        finest, *coarser = plan.reference
        points, has = [*coarser, *plan.points], self.records.has
        missing = on_root(self.comm, lambda: [n for n, point in enumerate(points) if not has(point, self.limit)])
        if not missing and on_root(self.comm, lambda: has(finest, None)):
            return
        self._reference: ReferenceSolution | None = None
        self._exact: tuple[Point | None, Fields | None] = (None, None)
        self._begin(finest)
        for number in missing:
            _LOG.info("%s of %s points: %s", number + 1, len(points), points[number], extra={"moving": True})
            self._one(plan, points[number])

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
        on_root(self.comm, lambda: self.records.add(record))

    def _one(self, plan: Plan, point: Point) -> None:
        """Measure a point; one that fails is a result too. Collective."""
        record, solution = self._measured(point, self.limit)
        found, exact = self._fields(solution), plan.exact_like(point)
        if point == exact:
            self._exact = point, found
        smoothed = point.scene.solver.smoothing and point.accuracy is None and solution is not None
        if smoothed and self._exact[0] != exact:
            self._exact = exact, self._fields(self._measured(exact, None, repeats=0)[1])
        on_root(self.comm, lambda: self.records.add({**record, **self._errors(found, smoothed=bool(smoothed))}))

    def _errors(self, found: Fields | None, *, smoothed: bool) -> Record:
        """What is measured of a point's fields, which a failed one has not. Rank 0 only."""
        reference, exact = self._reference, self._exact[1]
        if found is None or reference is None:
            return {}
        part = reference.errors(found, exact) if smoothed and exact is not None else None
        return {"errors": reference.errors(found), "epsilon_part": part, "left_out": reference.left_out(found)}

    def _fields(self, solution: Solution | None) -> Fields | None:
        """A certified solution on the reference's nodes, on rank 0; None for another. Collective."""
        arrays, reference = None if solution is None else solution_arrays(solution), self._reference
        return None if arrays is None or reference is None else reference.transfer(arrays)

    def _measured(
        self, point: Point, limit: float | None, repeats: int | None = None
    ) -> tuple[Record, Solution | None]:
        """A point's record and, if it is certified, its solution. Collective."""
        over, name = time_over(self.comm, limit), {"point": name_of(point)}
        try:
            record, solution = self._timed(point, over, self.repeats if repeats is None else repeats)
        except HviError as error:
            record, solution = _failed(str(error), error.exit_code), None
        if self.interrupted():
            raise StudyInterruptedError("interrupted; what is finished is kept, --resume goes on from there")
        if solution is None and over():
            reason = f"not finished after {limit:g} s; --limit SECONDS --resume gives it longer"
            return {**name, **_failed(reason, ExitCode.NOT_CONVERGED), "limit": limit}, None
        return {**name, **record}, solution

    def _timed(self, point: Point, over: Callable[[], bool], repeats: int) -> tuple[Record, Solution | None]:
        """Solve it once to fill caches, and again for the median of its time. Collective."""
        solution = self._solved(point, Timer(), over)
        whole = summary(solution)
        record: dict[str, Any] = {key: whole[key] for key in _RECORDED}
        times = [whole["time"]]
        while record["converged"] and self._again(times, repeats):
            gc.collect()
            timer = Timer()
            self._solved(point, timer, never)
            times.append({phase: largest(self.comm, seconds) for phase, seconds in timer.report().items()})
        record |= _cost(times[1:] or times)
        if not record["converged"]:
            return record, None
        arrays = solution_arrays(solution)
        return record | {"h": None if arrays is None else mesh_width(arrays)}, solution

    def _again(self, times: Sequence[Mapping[str, float]], repeats: int) -> bool:
        """Whether one more run is wanted; rank 0 decides. Collective."""
        wanted = len(times) <= repeats and sum(map(_seconds, times[1:] or times)) < PATIENCE and not self.interrupted()
        return bool(self.comm.bcast(wanted, root=0))

    def _solved(self, point: Point, timer: Timer, over: Callable[[], bool]) -> Solution:
        """The scene on its mesh, or on one made for an accuracy. Collective."""

        def stop() -> bool:
            return self.interrupted() or over()

        if point.accuracy is None:
            found = find_solution(prepare(point.scene, self.comm, timer), interrupted=stop)
            found.free()
            return found.solution
        solver = AdaptiveSolver(timer=timer, interrupted=stop)
        reached = solve_to_goal(point.scene, self.comm, Goal(point.accuracy), solver, lambda line: None)
        timer.seconds["solve"] += timer.seconds["estimate"]  # which steers the refinement: part of what it costs
        return reached.solution


def _failed(reason: str, code: int) -> dict[str, Any]:
    """The record of a point that has no certified solution."""
    empty = dict.fromkeys((*_RECORDED, "seconds", "runs", "phases"))
    return empty | {"converged": False, "reason": reason, "exit_code": code}


def _seconds(times: Mapping[str, float]) -> float:
    """The cost of one run by its times by phase, s."""
    return sum(times[phase] for phase in PHASES)


def _cost(times: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """The median cost and the median of each phase, s, and the number of runs."""
    phases = {phase: statistics.median(t[phase] for t in times) for phase in PHASES}
    return {"seconds": statistics.median(map(_seconds, times)), "runs": len(times), "phases": phases}
