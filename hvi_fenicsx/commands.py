"""What the commands do: scene to result folder (``run``), scene to report (``check``). Collective under mpirun."""

from __future__ import annotations

import argparse
import json
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI

from . import pictures, report, results
from .errors import HviError
from .interrupt import Interrupt
from .journal import Journal
from .parallel import on_root
from .results.write import write_record
from .scene import Scene, dump_scene, read_scene
from .solution import NO_SOLUTION, Prepared, Solution, finish, prepare
from .solvers import options as petsc_options
from .timing import Timer

COMM = MPI.COMM_WORLD


@contextmanager
def ended_together() -> Iterator[None]:
    """An error that was not foreseen on one rank ends all of them: the others would wait for it for ever."""
    try:
        yield
    except (HviError, KeyboardInterrupt):
        raise  # all ranks alike
    except Exception:
        if COMM.size > 1:
            traceback.print_exc()
            sys.stderr.flush()
            COMM.Abort(1)
        raise


def run(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    target = options.out or Path("results") / options.scene.stem
    if options.resume and (code := on_root(COMM, lambda: _finished(target, scene))) is not None:
        return code
    folder = results.ResultFolder(COMM, target, "replace" if options.force or options.resume else "refuse")
    try:
        with Journal(COMM.rank == 0) as journal:
            return _run(scene, folder, journal, timer, draw=not options.no_pictures)
    except BaseException:
        folder.discard()
        raise


def _run(scene: Scene, folder: results.ResultFolder, journal: Journal, timer: Timer, *, draw: bool) -> int:
    interrupt = Interrupt(COMM)
    interrupt.watch()
    prepared = prepare(scene, COMM, timer)
    for line in report.heading(prepared, COMM.size):
        journal.say(line)
    solution = finish(prepared, journal.progress, interrupt.requested)
    for line in report.outcome(solution):
        journal.say(line)
    with timer("output"):
        record = results.write(folder.work, solution)
        if draw:
            on_root(COMM, lambda: _draw(folder.work, record, journal))
    record["time"] = timer.report()
    on_root(COMM, lambda: write_record(folder.work, record, journal))
    folder.commit()
    journal.say(f"{folder.target}: {timer.total:.1f} s in all")
    return solution.exit_code


def _draw(folder: Path, record: dict[str, Any], journal: Journal) -> None:
    """Pictures are drawn from the files; a picture that fails costs a line in the log, not the run."""
    write_record(folder, record, journal)
    try:
        pictures.draw(folder)
    except HviError as error:
        journal.say(f"pictures: {error}")


def _finished(target: Path, scene: Scene) -> int | None:
    """The exit code of a finished result of the same scene; None where there is none. Rank 0 only."""
    try:
        same = (target / "scene.toml").read_text(encoding="utf-8") == dump_scene(scene)
        record = json.loads((target / results.folder.MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not same or record["exit_code"] not in (0, NO_SOLUTION):
        return None
    print(f"{target}: finished already ({record['reason']})")
    return int(record["exit_code"])


def check(options: argparse.Namespace) -> int:
    """Validate a scene, tell its effects, kernel and existence; 3 when no solution exists.

    Raises:
        InputError: on all ranks alike.
    """
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    prepared = prepare(scene, COMM)
    if COMM.rank == 0:
        _print_check(prepared, as_json=options.json)
    return NO_SOLUTION if prepared.solvability.state == "escapes" else 0


def _print_check(prepared: Prepared, *, as_json: bool) -> None:
    if as_json:
        json.dump(report.as_data(prepared), sys.stdout, indent=2, ensure_ascii=False)
        print()
    else:
        print("\n".join([*report.heading(prepared, COMM.size), *report.effects(prepared)]))


__all__ = ["Solution", "check", "run"]
