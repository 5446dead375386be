"""``hvi equilibria``: all equilibria of a scene, or the lowest with a proof, each in a result folder of its own."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import console, results
from ..errors import ExitCode
from ..report.html import equilibria_page
from ..report.pictures import equilibria as picture
from ..results.whole import made, picture_process, write_whole
from ..runtime import log
from ..runtime.mpi import on_root, time_over
from ..runtime.signals import Interrupt
from ..runtime.timing import Timer
from ..scene import read_scene
from ..stationary_points.bodies import Equilibria
from ..stationary_points.found import Found, Saved
from ..stationary_points.progress_words import Clock, certified_in_words, counted
from ..system import petsc_options
from ..workflow import Preparation, prepare
from . import equilibria_files as files
from . import search_file, target, telling
from .search_file import SearchFile
from .telling import COMM

BETWEEN = 0.2
"""Seconds between two reports of progress."""
MOST_TOLD = 20
"""Equilibria that are told on the terminal."""
MOST_DRAWN = 10
"""Equilibria whose result folders get pictures."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """What ``hvi equilibria`` is asked for.

    Attributes:
        options: the words of the command line.
        prepared: the scene, assembled.
        folder: where the results go.
        interrupted: whether to stop (collective).
        saved: what an earlier search left.
    """

    options: argparse.Namespace
    prepared: Preparation
    folder: results.ResultFolder
    interrupted: Callable[[], bool]
    saved: Saved | None


def execute(options: argparse.Namespace) -> int:
    """Search a scene's equilibria and write them; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    goes_to = target.path_of(options, "-equilibria")
    if options.resume and (code := target.finished(goes_to, scene, "the search is made again", _proven)) is not None:
        return code
    saved = on_root(COMM, lambda: search_file.read(goes_to, scene)) if options.resume else None
    display = telling.on_first_rank(log.TerminalDisplay)
    with target.opened(options, goes_to) as folder, log.Handlers(*display):
        prepared, interrupt = prepare(scene, COMM, timer), Interrupt(COMM)
        interrupt.watch()
        return _run(
            Request(options=options, prepared=prepared, folder=folder, interrupted=interrupt.requested, saved=saved)
        )


def _proven(record: dict[str, Any]) -> bool:
    """Whether a summary is of a search that came to its end."""
    return bool(record.get("equilibria", {}).get("proven"))


def _run(request: Request) -> int:
    """Search, write and tell; the exit code. Collective."""
    prepared, folder, interrupted = request.prepared, request.folder, request.interrupted
    run_logs = telling.on_first_rank(lambda: log.RunLog(folder.work / "run.log"))
    with log.Handlers(*run_logs):
        telling.say(console.heading(prepared, COMM.size))
        bodies, kept = Equilibria(prepared, interrupted=interrupted), SearchFile(folder, prepared.scene)
        found = bodies.find(
            lowest=request.options.lowest,
            gap=request.options.gap,
            stop=_stop(interrupted, request.options.limit),
            report=_reporter(),
            saved=request.saved,
            keep=kept.keep,
        )
        on_root(COMM, lambda: kept.write_left(found.left))
        code = _exit_code(prepared, found, interrupted=interrupted())
        telling.say([f"result: {found.reason}; {counted(found.nodes, 'box', 'boxes')}"])
        rows = list(_all_written(request, bodies, found))
        files.write(folder, prepared, found, rows, code, request.options.given)
        if rows:
            draw = not request.options.no_pictures and not interrupted()
            on_root(COMM, lambda: _picture_and_page(folder.work, draw=draw))
        telling.say(_lines(prepared, found, rows))
    on_root(COMM, lambda: telling.finish(run_logs))
    folder.commit(prepared.scene)
    telling.say([*console.warnings(folder.kept), target.where(folder.target, prepared.timer)])
    return int(code)


def _stop(interrupted: Callable[[], bool], limit: float | None) -> Callable[[], bool]:
    """Whether to stop: a signal, or the time is over. Collective."""
    late = time_over(COMM, limit)
    return lambda: interrupted() or late()


def _reporter() -> Callable[[str], None]:
    last = [0.0]

    def report(text: str) -> None:
        if time.monotonic() - last[0] > BETWEEN:
            last[0] = time.monotonic()
            telling.LOG.debug("%s", text, extra={"moving": True})

    return report


def _picture_and_page(folder: Path, *, draw: bool) -> None:
    """From the other files; that one cannot be made costs a line. Rank 0 only."""
    if draw:
        made("picture", telling.LOG.info, lambda: picture.draw(folder))
    made("report", telling.LOG.info, lambda: equilibria_page.write(folder))


def _exit_code(prepared: Preparation, found: Found, *, interrupted: bool) -> ExitCode:
    if prepared.solvability.state == "escapes":
        return ExitCode.NO_SOLUTION
    if found.proven:
        return ExitCode.CERTIFIED
    return ExitCode.INTERRUPTED if interrupted else ExitCode.NOT_CONVERGED


def _all_written(request: Request, bodies: Equilibria, found: Found) -> Iterator[files.Row]:
    """Write all equilibria, and tell how many are written; their rows. Collective."""
    report, clock, count = _reporter(), Clock(), len(found.points)
    for i in range(count):
        yield _written(request, bodies, found, i)
        report(certified_in_words(i + 1, count, clock))


def _written(request: Request, bodies: Equilibria, found: Found, i: int) -> files.Row:
    """Write one equilibrium into a result folder of its own; its row. After a signal nothing is drawn. Collective."""
    solution, folder = bodies.solution(found.points[i]), request.folder
    name = f"equilibrium-{i + 1:0{len(str(len(found.points)))}d}"
    drawn = not request.options.no_pictures and i < MOST_DRAWN and not request.interrupted()
    dimension = request.prepared.scene.dimension
    with (
        results.ResultFolder(COMM, folder.work / name) as own,
        picture_process(own, dimension, telling.LOG.info, wanted=drawn) as pictures,
    ):
        given, timer = target.given(request.options), request.prepared.timer
        write_whole(own, solution, timer, given, telling.LOG.info, pictures)
        own.commit(request.prepared.scene)
    return files.row(i + 1, bodies, found.points[i], solution, name)


def _lines(prepared: Preparation, found: Found, rows: list[files.Row]) -> Iterator[str]:
    unit = "J/m" if prepared.problem.scales.dimension == 2 else "J"
    for row in rows[:MOST_TOLD]:
        uncertified = "" if row.certified else "  NOT CERTIFIED"
        yield f"{row.index:4d}  {row.energy:.10g} {unit}  {row.kind}  {row.broken} broken{uncertified}"
    if len(rows) > MOST_TOLD:
        yield f"      and {len(rows) - MOST_TOLD} more in {files.TABLE}"
    for one in files.barriers(found, rows)[:MOST_TOLD]:
        ends = (f"{height:.3g} {unit} above {i}" for i, height in zip(one["between"], one["heights"], strict=True))
        yield f"barrier at {one['saddle']}: {' and '.join(ends)}"
    if found.gap is not None and found.lower_bound is not None:
        bound = found.lower_bound * prepared.problem.scales.energy
        yield f"no displacement has an energy below {bound:.10g} {unit} (relative gap {found.gap:.1e})"
