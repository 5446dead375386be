"""The points of a study, solved one after the other by the ranks that ask for it, and kept in files.

A point's name is a digest of its scene, the mesh file's content, the number of ranks and the program's version; so a
study that is resumed, or widened by further axes, finds what it has.
"""

from __future__ import annotations

import gc
import hashlib
import json
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI
from scipy import sparse

from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.control import solve_to_goal
from ..accuracy.goal import Goal
from ..errors import ExitCode, HviError, NotWrittenError
from ..model import dump_scene
from ..report import solution_arrays as archive
from ..report.errors import ResultError
from ..report.solution_arrays import SolutionArrays
from ..results.gathering import solution_arrays
from ..results.summary import summary
from ..runtime import log, manifest, writing
from ..runtime.manifest import Manifest
from ..runtime.mpi import largest, on_root, time_over
from ..runtime.timing import Timer
from ..runtime.versions import __version__
from ..solvers.context import never
from ..workflow import Solution, find_solution, prepare
from .errors import stiffness
from .plan import Plan, Point
from .transfer import mesh_width

PHASES = ("mesh", "assembly", "setup", "solve", "certificate")
"""What a point costs: compilation is paid once for all, and a study writes no results."""
PATIENCE = 15.0
"""Seconds after which no further repetition of a point begins."""
RECORDED = ("dofs", "converged", "reason", "exit_code", "energy", "epsilon", "iterations")
"""What is kept of a point's summary."""
_POINTS, _ENDINGS = "points", (".json", ".npz", ".stiffness.npz")
_LOG = log.logger("study")


class NoReferenceError(HviError):
    """There is nothing to measure against; the exit code is that of the reference's run."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code


class StudyInterruptedError(HviError):
    """Ctrl-C or SIGTERM: the finished points are kept."""

    exit_code = ExitCode.INTERRUPTED


@dataclass(frozen=True)
class Store:
    """The points in the folder of a study; rank 0 alone uses it.

    Attributes:
        folder: the folder.
        ranks: that solve its points.
    """

    folder: Path
    ranks: int

    def open(self) -> None:
        """Make the folder ready for points.

        Raises:
            OSError: it cannot be written.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        if manifest.read(self.folder) is None:  # first of all: without it the folder would be one of others
            manifest.write(self.folder, Manifest(kind="study", files={}))
        (self.folder / _POINTS).mkdir(exist_ok=True)

    def name(self, point: Point) -> str:
        """The name of a point."""
        text = f"{__version__} {self.ranks} {point.accuracy}\n{dump_scene(point.scene)}"
        digest = hashlib.sha256(text.encode())
        for file in point.scene.files():
            digest.update(file.read_bytes())
        return digest.hexdigest()[:16]

    def file(self, point: Point, ending: str) -> Path:
        """A file of a point.

        Args:
            point: the point.
            ending: ``.json`` of its record, ``.npz`` of its solution, ``.stiffness.npz`` of a reference's stiffness.
        """
        return self.folder / _POINTS / f"{self.name(point)}{ending}"

    def record(self, point: Point) -> dict[str, Any] | None:
        """What a finished point cost and found; None where it is not finished, or its record is damaged."""
        try:
            found = json.loads(self.file(point, ".json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and found.keys() >= {*RECORDED, "seconds", "phases"} else None

    def solution(self, point: Point) -> SolutionArrays | None:
        """The solution of a certified point; None for another.

        Raises:
            ResultError: it is missing or damaged.
        """
        return archive.load(self.file(point, ".npz")) if (self.record(point) or {}).get("converged") else None

    def stiffness(self, reference: Point) -> sparse.csr_array:
        """The stiffness of a reference.

        Raises:
            ResultError: it is missing or damaged.
        """
        file = self.file(reference, ".stiffness.npz")
        try:
            return sparse.csr_array(sparse.load_npz(file))
        except Exception as error:  # whatever a damaged archive makes numpy raise
            raise ResultError(f"{file}: damaged ({error})") from None

    def finished(self, point: Point, limit: float | None, *, is_reference: bool) -> bool:
        """Whether a point is there, whole and with all that is wanted, or was given up after no less time.

        Args:
            point: the point.
            limit: seconds after which it would be given up; None: never.
            is_reference: whether its stiffness is wanted.
        """
        record = self.record(point)
        if record is None or (record.get("limit") is not None and (limit is None or record["limit"] < limit)):
            return False
        try:
            self.solution(point)
            if is_reference and record["converged"]:
                self.stiffness(point)
        except ResultError:
            return False
        return True

    def announce(self, point: Point) -> None:
        """List a point's files as the program's own, before they are there.

        Raises:
            NotWrittenError: the list cannot be written.
        """
        names = [f"{_POINTS}/{self.name(point)}{ending}" for ending in _ENDINGS]
        manifest.add(self.folder, names, changing=True)
        self.file(point, ".json").unlink(missing_ok=True)

    def listed(self) -> dict[str, str | None]:
        """The files of all points, as a manifest lists them."""
        found = manifest.read(self.folder)
        files = found.files if found else {}
        return {name: known for name, known in files.items() if name.startswith(f"{_POINTS}/")}


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """How the points of a study are solved.

    Attributes:
        store: where they go.
        comm: the ranks that solve them.
        repeats: solves of each at most, for the median of its time.
        limit: seconds after which a point is given up; never the reference.
        interrupted: whether to stop; collective.
    """

    store: Store
    comm: MPI.Comm
    repeats: int
    limit: float | None = None
    interrupted: Callable[[], bool] = never

    def run(self, plan: Plan) -> None:
        """Solve what is not finished of a plan, the reference first: without it the rest is in vain. Collective.

        Raises:
            NoReferenceError: no solution exists (3), or the reference is not certified (4); on all ranks alike.
            StudyInterruptedError: it was asked to stop; on all ranks alike.
            NotWrittenError: files cannot be written; on all ranks alike.
        """
        on_root(self.comm, self.store.open)
        finest, *coarser = plan.reference
        self._one(finest, "reference", is_reference=True)
        _check(finest, on_root(self.comm, lambda: self.store.record(finest) or {}))
        points = [*coarser, *plan.points]
        for number, point in enumerate(points):
            self._one(point, f"{number} of {len(points)} points are finished")

    def _one(self, point: Point, progress: str, *, is_reference: bool = False) -> None:
        """Measure a point, unless it is finished; one that fails is a result too. Collective."""
        limit, store = None if is_reference else self.limit, self.store
        if on_root(self.comm, lambda: store.finished(point, limit, is_reference=is_reference)):
            return
        _LOG.info("%s: %s", progress, point, extra={"moving": True})
        on_root(self.comm, lambda: store.announce(point))
        over = time_over(self.comm, limit)
        try:
            record = self._measured(point, over, is_reference=is_reference)
        except NotWrittenError:
            raise
        except HviError as error:
            record = _failed(str(error), error.exit_code)
        if self.interrupted():
            words = f"interrupted; what is finished is kept in {store.folder}; --resume goes on from there"
            raise StudyInterruptedError(words)
        if not record["converged"] and over():
            reason = f"not finished after {limit:g} s; --limit SECONDS --resume gives it longer"
            record = _failed(reason, ExitCode.NOT_CONVERGED) | {"limit": limit}
        on_root(self.comm, lambda: write_json(store.file(point, ".json"), record))

    def _measured(self, point: Point, over: Callable[[], bool], *, is_reference: bool) -> dict[str, Any]:
        """Solve it once to fill caches, and again for the median of its time; its record. Collective."""
        first = self._solved(point, Timer(), over)
        whole = summary(first)
        record = {key: whole[key] for key in RECORDED} | {"h": None}
        if first.converged:
            record["h"] = self._keep(point, first, is_reference=is_reference)
        times = [whole["time"]]
        del first
        while not is_reference and record["converged"] and self._again(times):
            gc.collect()
            timer = Timer()
            self._solved(point, timer, never)
            times.append({phase: largest(self.comm, seconds) for phase, seconds in timer.report().items()})
        return record | _cost(times[1:] or times)

    def _again(self, times: Sequence[Mapping[str, float]]) -> bool:
        """Whether one more run is wanted; rank 0 decides. Collective."""
        spent = sum(map(seconds_of, times[1:] or times))
        wanted = len(times) <= self.repeats and spent < PATIENCE and not self.interrupted()
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

    def _keep(self, point: Point, solution: Solution, *, is_reference: bool) -> float | None:
        """Write the solution and, of a reference, its stiffness; the mesh width. Collective."""
        found = solution_arrays(solution)
        matrix = stiffness(solution) if is_reference else None

        def write() -> float:
            assert found is not None
            archive.save(self.store.file(point, ".npz"), found)
            if matrix is not None:
                path = self.store.file(point, ".stiffness.npz")
                with writing.whole(path) as aside, aside.open("wb") as file:
                    sparse.save_npz(file, matrix, compressed=False)
            return mesh_width(found)

        return on_root(self.comm, write)


def _check(reference: Point, record: Mapping[str, Any]) -> None:
    """Refuse a reference that is not certified."""
    if not record.get("converged"):
        text = (
            f"the reference ({reference.mesh}, exact law) has no certified solution: {record.get('reason')}; "
            "see `hvi run`, or choose coarser meshes with --axis mesh=..."
        )
        raise NoReferenceError(text, record.get("exit_code") or ExitCode.NOT_CONVERGED)


def _failed(reason: str, code: int) -> dict[str, Any]:
    """The record of a point that has no certified solution."""
    empty = dict.fromkeys((*RECORDED, "h", "seconds", "runs", "phases"))
    return empty | {"converged": False, "reason": reason, "exit_code": code}


def seconds_of(times: Mapping[str, float]) -> float:
    """The cost of one run by its times by phase, s."""
    return sum(times[phase] for phase in PHASES)


def _cost(times: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """The median cost and the median of each phase, s, and the number of runs."""
    phases = {phase: statistics.median(t[phase] for t in times) for phase in PHASES}
    return {"seconds": statistics.median(map(seconds_of, times)), "runs": len(times), "phases": phases}


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write JSON, whole or not at all.

    Args:
        path: the file.
        data: what it says.

    Raises:
        NotWrittenError: it cannot be written.
    """
    writing.text(path, json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
