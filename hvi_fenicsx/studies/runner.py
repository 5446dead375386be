"""Runs the points of a study one after the other, each in a process of its own, and keeps what is finished."""

from __future__ import annotations

import contextlib
import signal
import statistics
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from ..errors import ExitCode
from ..runtime import processes, writing
from ..scene import dump_scene
from .errors import StudyInterruptedError
from .progress import StudyProgress
from .setting import Setting
from .store import Store, failed, is_whole, write_json
from .thresholds import DEFAULT, Thresholds

_OWN_FAULTS = (signal.SIGSEGV, signal.SIGBUS, signal.SIGABRT, signal.SIGFPE, signal.SIGILL)
"""Signals that a process raises itself when it crashes."""


COMPLAINT = "point: "
"""How the message of a point begins."""


@contextlib.contextmanager
def watched(folder: Path) -> Iterator[None]:
    """SIGINT, SIGTERM and SIGHUP end the child that runs, and the study.

    Raises:
        StudyInterruptedError: a signal came.
    """

    def note(number: int, frame: FrameType | None) -> None:
        raise StudyInterruptedError(f"interrupted; what is finished is kept in {folder}; --resume goes on from there")

    before = {number: signal.getsignal(number) for number in processes.STOP}
    processes.catch(processes.STOP, note)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@dataclass(frozen=True)
class PointRun:
    """A point to run.

    Attributes:
        setting: what it solves.
        stiffness: whether its stiffness is kept, since it will be the reference.
    """

    setting: Setting
    stiffness: bool = False

    @property
    def text(self) -> str:
        """The setting in words."""
        role = "reference: " if self.stiffness else ""
        setting = self.setting
        return f"{role}{setting.mesh}, degree {setting.degree}, {setting.law}, {setting.scene.solver.method}"


@dataclass
class Runner:
    """Runs points into a store.

    Attributes:
        store: where they go.
        repeat: repetitions of each at most.
        limit: seconds after which a point is given up.
        progress: what is shown.
        thresholds: how long processes may take.
    """

    store: Store
    repeat: int
    limit: float
    progress: StudyProgress
    thresholds: Thresholds = DEFAULT
    _done: list[tuple[float, float]] = field(default_factory=list)

    def run(self, runs: Sequence[PointRun], everything: Sequence[PointRun]) -> None:
        """Run those points that are not finished.

        Interrupted, nothing is left behind of the point that was running.

        Args:
            runs: the points.
            everything: all points of the study, for the time to go.
        """
        todo = [one for one in everything if not self.finished(one)]
        for one in [one for one in runs if one in todo]:
            self.progress.show(
                one.text, done=len(everything) - len(todo), total=len(everything), to_go=self._to_go(todo)
            )
            self._one(one)
            todo.remove(one)

    def finished(self, one: PointRun) -> bool:
        """Whether a point is in the store, whole and with all that is wanted, or was given up after no less time."""
        record = self.store.record(one.setting)
        if record is None or record.get("killed") or record.get("limit", self._limit(one)) < self._limit(one):
            return False
        if "limit" in record:
            return True
        wanted = [self.store.solution(one.setting)] if record["converged"] else []
        wanted += [self.store.stiffness(one.setting)] if one.stiffness else []
        return all(map(is_whole, wanted))

    def _limit(self, one: PointRun) -> float:
        return self.limit * (self.thresholds.reference_limit if one.stiffness else 1.0)

    def _to_go(self, runs: Sequence[PointRun]) -> float:
        """Seconds that these will take, from what the finished ones took a start and an unknown."""
        start = min((s for s, _ in self._done), default=self.thresholds.start)
        rates = [max(0.0, s - start) / n for s, n in self._done if n > 0.0]
        rate = statistics.median(rates) if rates else self.thresholds.seconds_per_unknown
        return sum(start + rate * one.setting.unknowns for one in runs)

    def _one(self, one: PointRun) -> None:
        path, began = self.store.path(one.setting), self.progress.seconds
        self.store.announce(one.setting)
        path.with_suffix(".json").unlink(missing_ok=True)
        writing.text(path.with_suffix(".toml"), dump_scene(one.setting.scene))
        words = [*_python(self.store.ranks), "-m", "hvi_fenicsx.studies.point", *self._arguments(one, path)]
        try:
            code, errors = self._ended(words, path, self._limit(one))
            if not path.with_suffix(".json").exists():
                self._failed(path, code, errors)
        except subprocess.TimeoutExpired:
            self._given_up(path, self._limit(one))
        self._done.append((self.progress.seconds - began, one.setting.unknowns))

    def _ended(self, words: list[str], path: Path, limit: float) -> tuple[int, str]:
        """What a child ends with and what it says of errors; whatever happens, nothing else remains of it."""
        with _session(self.store.ranks) as session:
            child = _started(words, path.parent, session)
            with _none_left(child, path, self.thresholds.kill_after):
                _, errors = child.communicate(timeout=limit)
        return child.returncode, errors

    def _arguments(self, one: PointRun, path: Path) -> list[str]:
        repeat = 1 if one.stiffness else self.repeat
        arguments = [str(path.with_suffix(".toml")), str(path), f"--repeat={repeat}"]
        arguments += ["--stiffness"] if one.stiffness else []
        return [*arguments, *([f"--accuracy={one.setting.accuracy}"] if one.setting.accuracy is not None else [])]

    def _failed(self, path: Path, code: int, errors: str) -> None:
        """A point that ended without a result is a result: it is listed with its reason, and not run again.

        One that was killed from outside is listed too, but not finished.

        Raises:
            NotWrittenError: its files could not be written: nor can those of the others.
        """
        writing.raise_handed_over(code, errors)
        reason = _reason(errors, code)
        record = failed(reason, code)
        if (killer := _killer(code)) is not None:
            record |= {"reason": f"killed from outside ({killer.name}); --resume runs it again", "killed": True}
        write_json(path.with_suffix(".json"), record)

    def _given_up(self, path: Path, limit: float) -> None:
        """A method that hangs must not hang a study: the point is run again only with a longer limit."""
        reason = f"not finished after {limit:g} s; --limit SECONDS --resume gives it longer"
        record = failed(reason, ExitCode.NOT_CONVERGED)
        write_json(path.with_suffix(".json"), {**record, "limit": limit})


def _killer(code: int) -> signal.Signals | None:
    """The signal that ended a process (or, by its own exit code, mpirun's ranks), if it came from outside."""
    number = -code if code < 0 else code - 128
    found = next((known for known in signal.Signals if known == number), None)
    return None if found in _OWN_FAULTS else found


def _reason(errors: str, code: int) -> str:
    """The point's own words; behind them mpirun may have written, and without them Python."""
    lines = errors.strip().splitlines() or [f"ended with code {code}"]
    own = [line.removeprefix(COMPLAINT) for line in lines if line.startswith(COMPLAINT)]
    return (own or lines)[-1]


def _python(ranks: int) -> list[str]:
    return [*processes.PYTHON] if ranks == 1 else processes.launcher(ranks)


@contextlib.contextmanager
def _session(ranks: int) -> Iterator[dict[str, str]]:
    """Variables of a child; mpirun gets a folder of its own."""
    if ranks == 1:
        yield {}
        return
    with processes.temporary_folder("--np") as folder:
        yield processes.session(folder)


def _started(words: list[str], folder: Path, session: dict[str, str]) -> subprocess.Popen[str]:
    """A child in a folder, which leads a group."""
    return subprocess.Popen(
        words,
        env={**processes.environment(), **session},
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=processes.die_with_parent,
    )


@contextlib.contextmanager
def _none_left(child: subprocess.Popen[str], path: Path, patience: float) -> Iterator[None]:
    """Whatever happens, of the child nothing remains: no process (it leads a group), no half-written file."""
    try:
        yield
    except BaseException:
        processes.end(child, patience)
        if not path.with_suffix(".json").exists():
            for file in (*path.parent.glob(f"{path.name}.*"), *path.parent.glob(f".{path.name}.*")):
                file.unlink(missing_ok=True)
        raise
