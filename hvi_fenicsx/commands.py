"""What the commands do: scene to result folder (``run``), scene to report (``check``). Collective under mpirun."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from . import console, results
from .accuracy import control, quantities
from .accuracy.adaptive import Climber
from .accuracy.control import Goal, Reached
from .errors import ExitCode, HviError, InputError
from .report.html import render
from .report.pictures import draw as pictures
from .results.write import write_record
from .runtime.log import Journal
from .runtime.mpi import on_root
from .runtime.signals import Interrupt
from .runtime.timing import Timer
from .scene import Scene, dump_scene, read_scene
from .system import petsc_options
from .workflow import Prepared, Solution, finish, prepare

COMM = MPI.COMM_WORLD
_CODES = {"escapes": ExitCode.NO_SOLUTION, "undecided": ExitCode.NOT_CONVERGED}
"""What ``hvi check`` ends with, by the state."""


def run(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    goal = _goal(options)
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    if goal is not None:
        quantities.find(goal.quantity)  # known only now: a plugin of the scene may define it
    target = options.out or Path("results") / options.scene.stem
    if options.resume and (code := on_root(COMM, lambda: _finished(target, scene, goal))) is not None:
        return code
    folder = results.ResultFolder(COMM, target, "replace" if options.force or options.resume else "refuse")
    try:
        with Journal(COMM.rank == 0) as journal:
            given = {"command": options.given, "petsc": options.petsc}
            return _run(scene, goal, folder, journal, timer, given, draw=not options.no_pictures)
    except BaseException:
        folder.discard()
        raise


def _goal(options: argparse.Namespace) -> Goal | None:
    """What accuracy is asked for, if one is."""
    if options.accuracy is None and options.time_budget is None:
        if options.quantity is not None:
            raise InputError("--quantity: says what --accuracy or --time-budget is of; give one of them too")
        return None
    return Goal(options.accuracy, options.quantity or "energy", options.time_budget)


def _run(
    scene: Scene,
    goal: Goal | None,
    folder: results.ResultFolder,
    journal: Journal,
    timer: Timer,
    given: dict[str, str],
    *,
    draw: bool,
) -> int:
    interrupt = Interrupt(COMM)
    interrupt.watch()
    reached: Reached | None = None
    said: tuple[str, ...] = ()
    if goal is not None:
        climber = Climber(timer, journal.progress, interrupt.requested)
        reached = control.reach(scene, COMM, goal, climber, journal.say)
        solution = reached.solution
    else:
        prepared = prepare(scene, COMM, timer)
        said = prepared.warnings
        for line in console.heading(prepared, COMM.size):
            journal.say(line)
        solution = finish(prepared, journal.progress, interrupt.requested)
    odd = console.odd(warning for warning in solution.warnings if warning not in said)
    for line in [*console.outcome(solution), *odd, *(console.bought(reached) if reached else [])]:
        journal.say(line)
    with timer("output"):
        record = {**results.write(folder.work, solution), **given, **(_bought(reached) if reached else {})}
        if draw:
            on_root(COMM, lambda: _from_files("pictures", pictures.draw, folder.work, record, journal))
    with timer("output"):
        record["time"] = timer.report()
        on_root(COMM, lambda: _from_files("report", render.write, folder.work, record, journal))
    record["time"] = timer.report()
    on_root(COMM, lambda: write_record(folder.work, record, journal))
    folder.commit()
    journal.say(f"{folder.target}: {timer.total:.1f} s in all; open report.html there")
    return int(record["exit_code"])


def _bought(reached: Reached) -> dict[str, Any]:
    """What of ``summary.json`` differs where an accuracy was asked for."""
    return {"accuracy": results.plain(reached.as_dict()), "exit_code": reached.exit_code}


def _from_files(
    what: str, make: Callable[[Path], object], folder: Path, record: dict[str, Any], journal: Journal
) -> None:
    """Pictures and report are made from the other files; one that fails costs a line in the log, not the run."""
    write_record(folder, record, journal)
    try:
        make(folder)
    except HviError as error:
        journal.say(f"{what}: {error}")


def _finished(target: Path, scene: Scene, goal: Goal | None) -> int | None:
    """The exit code of a finished result of the same scene and goal; None where there is none. Rank 0 only."""
    try:
        same = (target / "scene.toml").read_text(encoding="utf-8") == dump_scene(scene)
        record = json.loads((target / results.folder.MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    bought = record["accuracy"]
    same = (
        same
        and (bought is not None) == (goal is not None)
        and (goal is None or goal.as_dict().items() <= bought.items())
    )
    if not same or record["exit_code"] not in (ExitCode.CERTIFIED, ExitCode.NO_SOLUTION):
        return None
    print(f"{target}: finished already ({record['reason']})")
    return int(record["exit_code"])


def check(options: argparse.Namespace) -> int:
    """Validate a scene, tell its effects, kernel and existence; 3 when no solution exists, 4 when none can tell.

    Raises:
        InputError: on all ranks alike.
    """
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    prepared = prepare(scene, COMM)
    text = _report(prepared, options.loads, as_json=options.json)
    if COMM.rank == 0:
        print(text)
    return _CODES.get(prepared.solvability.state, ExitCode.CERTIFIED)


def _report(prepared: Prepared, loads: Sequence[str], *, as_json: bool) -> str:
    """What ``check`` prints. Collective."""
    factors = {name: prepared.load_factors(name) for name in loads}
    if as_json:
        return json.dumps(console.as_data(prepared, factors), indent=2, ensure_ascii=False)
    lines = [*console.heading(prepared, COMM.size), *console.load_factors(factors), *console.effects(prepared)]
    return "\n".join(lines)


__all__ = ["Solution", "check", "run"]
