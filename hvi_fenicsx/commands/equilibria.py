"""``hvi equilibria``: all equilibria of a scene, or the lowest with a proof, each in a result folder of its own."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .. import console, results
from ..equilibrium_search.search import OTHER, Found, Saved, counted, falls_passed
from ..equilibrium_search.stationarity import StationaryPoint
from ..errors import ExitCode, InputError, NotWrittenError
from ..model import dump_scene
from ..report import page
from ..report.page import draw as draw_pictures
from ..results import plain, whole
from ..results.summary import common
from ..results.whole import made, write_record, write_whole
from ..runtime import writing
from ..runtime.mpi import largest, on_root, time_over
from ..workflow import Preparation, Solution, prepare
from ..workflow.equilibria import Equilibria
from . import session
from .session import COMM, LOG, Record, Session, say, tell_moving

TABLE = "equilibria.csv"
COLUMNS = ("index", "energy", "kind", "max_slip", "max_opening", "broken", "folder")
Row = dict[str, Any]
"""What is said of one equilibrium: its cells, ``isolated`` (else it stands for a continuum) and ``certified``."""
KEPT_EVERY = 10
"""Seconds between two times at which a search keeps what it has; where that takes longer, so many times as long."""
MOST_TOLD = 20
"""Equilibria that are told on the terminal."""
MOST_DRAWN = 10
"""Equilibria whose result folders get pictures."""
JOURNAL = "search.journal"
"""The file in which what is left of a search is kept while it goes on."""


def execute(options: argparse.Namespace) -> int:
    """Search a scene's equilibria and write them; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """

    def done(record: Record) -> bool:
        known = record["equilibria"]
        if known["proven"] and not (known["complete"] or options.lowest):
            raise InputError(OTHER)
        return bool(known["proven"])

    return session.execute(options, _run, kind="search", done=done)


def _run(call: Session) -> int:
    """Search, write and tell; the exit code. Collective."""
    options, kept = call.options, _StateFile(call)
    known = call.begin_journal(JOURNAL)
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    bodies, late = Equilibria(prepared, interrupted=call.interrupted), time_over(COMM, options.limit)
    with call.going_on(JOURNAL, known):
        found = bodies.find(
            lowest=options.lowest,
            gap=options.gap,
            stop=lambda: call.interrupted() or late(),
            report=tell_moving,
            saved=next(iter(known), None),
            keep=kept.keep,
        )
    if found.left:
        call.folder.unfinished = True
        on_root(COMM, lambda: call.folder.journal.replace(found.left))
    interrupted, code = call.interrupted(), ExitCode.NOT_CONVERGED
    if prepared.solvability.state == "escapes":
        code = ExitCode.NO_SOLUTION
    elif found.proven or interrupted:
        code = ExitCode.CERTIFIED if found.proven else ExitCode.INTERRUPTED
    say([f"result: {found.reason}; {counted(found.nodes, 'box', 'boxes')}"])
    rows = list(_all_written(call, bodies, found))
    entry = _entry(found, rows, prepared.problem.scales.energy)
    more = plain({"reason": found.reason, "exit_code": int(code), "equilibria": entry, "command": options.given})
    record, draw = common(prepared, prepared.system.dofs) | more, not options.no_pictures and not call.interrupted()
    on_root(COMM, lambda: _write(call, rows, record, draw=draw))
    say(_lines(prepared, found, rows))
    return int(code)


class _StateFile:
    """Keeps what is left of a search in the folder of the result: a kill loses little."""

    def __init__(self, call: Session) -> None:
        self._folder, self._next = call.folder, time.monotonic() + KEPT_EVERY

    def keep(self, state: Callable[[], Saved]) -> None:
        """Write what is left, if it is time.

        Args:
            state: makes it.
        """
        began = time.monotonic()
        if COMM.rank or began < self._next:
            return
        try:
            self._folder.journal.replace(state())
            self._next = time.monotonic() + KEPT_EVERY * max(1.0, time.monotonic() - began)
        except NotWrittenError as error:
            self._next = np.inf
            LOG.info("%s; a kill would lose the search", error)


def _all_written(call: Session, bodies: Equilibria, found: Found) -> Iterator[Row]:
    """Write each equilibrium into a result folder; their rows. Nothing is drawn after a signal. Collective."""
    count = len(found.points)
    for number, point in enumerate(found.points, start=1):
        solution = bodies.solution(point)
        name = f"equilibrium-{number:0{len(str(count))}d}"
        drawn = not call.options.no_pictures and number <= MOST_DRAWN and not call.interrupted()
        with results.ResultFolder(COMM, call.folder.work / name) as own:
            write_whole(own, solution, call.given, call.timer, LOG.info, pictures=drawn)
            own.commit(call.scene)
        yield {"index": number, "folder": name, **_row(bodies, point, solution)}
        tell_moving(f"certified: {number} of {count} equilibria")


def _row(bodies: Equilibria, point: StationaryPoint, solution: Solution) -> Row:
    """What the row of an equilibrium says of it. Collective."""
    problem, examination = solution.problem, solution.examination
    assert bodies.problem is not None
    assert examination is not None
    comm, unit = problem.comm, problem.scales.displacement
    slips = [np.linalg.norm(s.slip, axis=1) for s in examination.states]
    openings = [np.where(np.isfinite(s.gap), s.gap, -s.normal) for s in examination.states]
    slip, opening = (largest(comm, np.max(np.hstack([0.0, *found]))) * unit for found in (slips, openings))
    return {
        "energy": examination.energy * problem.scales.energy,
        "kind": point.kind,
        "max_slip": slip,
        "max_opening": opening,
        "broken": falls_passed(bodies.problem, point.x) if point.x.size else 0,
        "isolated": point.isolated,
        "certified": solution.converged,
    }


def _lines(prepared: Preparation, found: Found, rows: list[Row]) -> Iterator[str]:
    unit = "J/m" if prepared.problem.dimension == 2 else "J"
    for row in rows[:MOST_TOLD]:
        uncertified = "" if row["certified"] else "  NOT CERTIFIED"
        yield f"{row['index']:4d}  {row['energy']:.10g} {unit}  {row['kind']}  {row['broken']} broken{uncertified}"
    if len(rows) > MOST_TOLD:
        yield f"      and {len(rows) - MOST_TOLD} more in {TABLE}"
    if found.gap is not None and found.lower_bound is not None:
        bound = found.lower_bound * prepared.problem.scales.energy
        yield f"no displacement has an energy below {bound:.10g} {unit} (relative gap {found.gap:.1e})"


def _entry(found: Found, rows: list[Row], unit: float) -> Row:
    """The entry ``equilibria`` of the summary."""
    return {
        "count": len(rows),
        "complete": found.complete,
        "lowest_energy": rows[0]["energy"] if rows else None,
        "lower_bound": None if found.lower_bound is None else found.lower_bound * unit,
        "gap": found.gap,
        "proven": found.proven,
        "nodes": found.nodes,
        "continua": [row["index"] for row in rows if not row["isolated"]],
        "uncertified": [row["index"] for row in rows if not row["certified"]],
    }


def _write(call: Session, rows: list[Row], record: Record, *, draw: bool) -> None:
    """Write table, summary and scene, then picture and page; that one cannot be made costs a line. Rank 0 only."""
    work = call.folder.work
    whole.write_table(work / TABLE, COLUMNS, ([row[name] for name in COLUMNS] for row in rows))
    writing.text(work / "scene.toml", dump_scene(call.scene, call.folder.target))
    write_record(work, record)
    if rows and draw:
        made("picture", LOG.info, lambda: draw_pictures(work))
    if rows:
        made("report", LOG.info, lambda: page.write_equilibria(work))
