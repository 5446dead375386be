"""Runs the points of a study one after the other, each in a process of its own, and keeps what is finished."""

from __future__ import annotations

import contextlib
import signal
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from ..errors import ExitCode, HviError
from ..runtime import processes
from ..scene import dump_scene
from . import meshes
from .meshes import Setting
from .progress import Progress
from .store import Store, is_whole, write_json, write_text

PATIENCE = 5.0
"""Seconds for a child to end by itself."""
_OF_A_REFERENCE = 5.0
"""Its time limit, in that of a point."""
_START = 3.0
"""Seconds that a point takes at least, until the first has told: interpreter, libraries, caches."""


class Stopped(HviError):
    """Ctrl-C or SIGTERM: the finished points are kept."""

    exit_code = ExitCode.INTERRUPTED


@contextlib.contextmanager
def watched(folder: Path) -> Iterator[None]:
    """SIGINT and SIGTERM end the child that runs, and the study.

    Raises:
        Stopped: a signal came.
    """

    def note(number: int, frame: FrameType | None) -> None:
        raise Stopped(f"interrupted; what is finished is kept in {folder}; --resume goes on from there")

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, note) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


@dataclass(frozen=True)
class Job:
    """A point to run; ``stiffness`` of a reference."""

    setting: Setting
    stiffness: bool = False


@dataclass
class Runner:
    """Runs jobs into a store.

    Attributes:
        store: where they go. repeat: repetitions at most. limit: seconds after which a point is given up.
        progress: what is shown.
    """

    store: Store
    repeat: int
    limit: float
    progress: Progress
    _done: list[tuple[float, float]] = field(default_factory=list)

    def run(self, jobs: Sequence[Job], of: Sequence[Job]) -> None:
        """Run those that are not finished, of all that will be run.

        Interrupted, nothing is left behind of the point that was running.
        """
        todo = [job for job in of if not self.finished(job)]
        for job in [job for job in jobs if job in todo]:
            self.progress.step(_words(job), len(of) - len(todo), len(of), self._to_go(todo))
            self._one(job)
            todo.remove(job)

    def finished(self, job: Job) -> bool:
        """Whether a point is in the store, whole and with all that is wanted, or was given up after no less time."""
        record = self.store.record(job.setting)
        if record is None or record.get("limit", self._limit(job)) < self._limit(job):
            return False
        if "limit" in record:
            return True
        solution = self.store.path(job.setting).with_suffix(".npz")
        stiffness = stiffness_path(self.store, job.setting)
        wanted = [*([solution] if record["converged"] else []), *([stiffness] if job.stiffness else [])]
        return all(map(is_whole, wanted))

    def _limit(self, job: Job) -> float:
        return self.limit * (_OF_A_REFERENCE if job.stiffness else 1.0)

    def _to_go(self, jobs: Sequence[Job]) -> float:
        """Seconds that these will take, from what the finished ones took a start and an unknown."""
        start = min((s for s, _ in self._done), default=_START)
        rates = [max(0.0, s - start) / n for s, n in self._done if n > 0.0]
        rate = statistics.median(rates) if rates else 1e-4
        return sum(start + rate * (meshes.unknowns(job.setting)) for job in jobs)

    def _one(self, job: Job) -> None:
        path, began = self.store.path(job.setting), self.progress.seconds
        path.with_suffix(".json").unlink(missing_ok=True)
        write_text(path.with_suffix(".toml"), dump_scene(job.setting.scene))
        child = subprocess.Popen(
            [*_python(self.store.ranks), "-m", "hvi_fenicsx.studies.point", *self._arguments(job, path)],
            env=processes.environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            with _ended(child, path):
                _, errors = child.communicate(timeout=self._limit(job))
            if not path.with_suffix(".json").exists():
                self._failed(path, child.returncode, errors)
        except subprocess.TimeoutExpired:
            self._given_up(path, self._limit(job))
        self._done.append((self.progress.seconds - began, meshes.unknowns(job.setting)))

    def _arguments(self, job: Job, path: Path) -> list[str]:
        repeat = 1 if job.stiffness else self.repeat
        words = [str(path.with_suffix(".toml")), str(path), f"--repeat={repeat}"]
        words += ["--stiffness"] if job.stiffness else []
        return [*words, *([f"--accuracy={job.setting.accuracy}"] if job.setting.accuracy is not None else [])]

    def _failed(self, path: Path, code: int, errors: str) -> None:
        """A point that ended without a result is a result: it is listed with its reason, and not run again."""
        reason = (errors.strip().splitlines() or [f"ended with code {code}"])[-1]
        write_json(path.with_suffix(".json"), {"converged": False, "reason": reason, "exit_code": code, "cost": None})

    def _given_up(self, path: Path, limit: float) -> None:
        """A method that hangs must not hang a study: the point is run again only with a longer limit."""
        reason = f"not finished after {limit:g} s; --limit SECONDS --resume gives it longer"
        record = {
            "converged": False,
            "reason": reason,
            "exit_code": ExitCode.NOT_CONVERGED,
            "cost": None,
            "limit": limit,
        }
        write_json(path.with_suffix(".json"), record)


def stiffness_path(store: Store, setting: Setting) -> Path:
    """Of a reference's stiffness."""
    return store.path(setting).with_suffix(".stiffness.npz")


def _python(ranks: int) -> list[str]:
    return [sys.executable] if ranks == 1 else processes.launcher(ranks)


@contextlib.contextmanager
def _ended(child: subprocess.Popen[str], path: Path) -> Iterator[None]:
    """Whatever happens, of the child nothing remains: no process (it leads a group), no half-written file."""
    try:
        yield
    except BaseException:
        processes.end(child, PATIENCE)
        if not path.with_suffix(".json").exists():
            for file in (*path.parent.glob(f"{path.name}.*"), *path.parent.glob(f".{path.name}.*")):
                file.unlink(missing_ok=True)
        raise


def _words(job: Job) -> str:
    solver = job.setting.scene.solver
    width = solver.epsilon if solver.epsilon is not None else solver.epsilon_absolute
    law = "exact law" if width is None else f"{solver.smoothing}, ε = {width:g}"
    return f"{'reference: ' if job.stiffness else ''}{meshes.words(job.setting)}, {law}, {solver.method}"
