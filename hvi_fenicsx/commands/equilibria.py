"""``hvi equilibria``: all equilibria of a scene, or the lowest with a proof, each in a result folder of its own."""

from __future__ import annotations

import argparse
import functools
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import console, results
from ..certify.contact_state import ContactState
from ..equilibrium_search.bodies import Equilibria
from ..equilibrium_search.found import Found, Saved, certified_in_words, counted
from ..equilibrium_search.search import falls_passed
from ..equilibrium_search.stationarity import StationaryPoint
from ..errors import ExitCode, NotWrittenError
from ..model import dump_scene
from ..report import page
from ..report.pictures.draw import draw as draw_pictures
from ..results import ResultFolder, plain, tables
from ..results.summary import common
from ..results.whole import made, write_record, write_whole
from ..runtime import writing
from ..runtime.cost import Timer
from ..runtime.mpi import largest, on_root, time_over
from ..typing import Array
from ..workflow import Preparation, Solution, prepare
from . import session
from .session import COMM, LOG, Command, Session, say, tell_moving

TABLE = "equilibria.csv"
COLUMNS = ("index", "energy", "kind", "max_slip", "max_opening", "broken", "folder")
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
    timer, scene = Timer(), session.scene_of(options)
    command = Command(suffix="-equilibria", again="the search is made again", done=_proven)
    return session.execute(options, scene, command, timer, _run)


def _proven(record: dict[str, Any]) -> bool:
    """Whether a summary is of a search that came to its end."""
    return bool(record.get("equilibria", {}).get("proven"))


def _run(call: Session) -> int:
    """Search, write and tell; the exit code. Collective."""
    options, folder, kept = call.options, call.folder, _StateFile(call)
    saved = on_root(COMM, kept.saved)
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    bodies, late = Equilibria(prepared, interrupted=call.interrupted), time_over(COMM, options.limit)
    found = bodies.find(
        lowest=options.lowest,
        gap=options.gap,
        stop=lambda: call.interrupted() or late(),
        report=functools.partial(tell_moving, "%s"),
        saved=saved,
        keep=kept.keep,
    )
    on_root(COMM, lambda: kept.write_left(found.left))
    code = _exit_code(prepared, found, interrupted=call.interrupted())
    say([f"result: {found.reason}; {counted(found.nodes, 'box', 'boxes')}"])
    rows = list(_all_written(call, bodies, found))
    _write(folder, prepared, found, rows, code, options.given)
    if rows:
        draw = not options.no_pictures and not call.interrupted()
        on_root(COMM, lambda: _picture_and_page(folder.work, draw=draw))
    say(_lines(prepared, found, rows))
    return int(code)


class _StateFile:
    """Keeps what is left of a search in the folder of the result: a kill loses little."""

    def __init__(self, call: Session) -> None:
        self._call, self._identity = call, on_root(COMM, lambda: call.identity)
        self._next, self._broken = time.monotonic() + KEPT_EVERY, False

    def saved(self) -> Saved | None:
        """What an earlier search has left, if this one shall go on from it. Rank 0 only."""
        if not self._call.options.resume:
            return None
        return next(iter(writing.read_journal(self._call.folder.target / JOURNAL, self._identity)), None)

    def keep(self, state: Callable[[], Saved]) -> None:
        """Write what is left, if it is time.

        Args:
            state: makes it.
        """
        began = time.monotonic()
        if COMM.rank or self._broken or began < self._next:
            return
        try:
            writing.write_journal(self._call.folder.announce(JOURNAL), self._identity, [state()])
        except NotWrittenError as error:
            self._broken = True
            LOG.info("%s; a kill would lose the search", error)
        now = time.monotonic()
        self._next = now + KEPT_EVERY * max(1.0, now - began)

    def write_left(self, state: Saved) -> None:
        """Write what a search that was stopped has left, as a file of the result. Rank 0 only.

        Args:
            state: what is left; nothing is written where it is empty.
        """
        if state:
            writing.write_journal(self._call.folder.work / JOURNAL, self._identity, [state])


def _picture_and_page(folder: Path, *, draw: bool) -> None:
    """From the other files; that one cannot be made costs a line. Rank 0 only."""
    if draw:
        made("picture", LOG.info, lambda: draw_pictures(folder))
    made("report", LOG.info, lambda: page.write_equilibria(folder))


def _exit_code(prepared: Preparation, found: Found, *, interrupted: bool) -> ExitCode:
    if prepared.solvability.state == "escapes":
        return ExitCode.NO_SOLUTION
    if found.proven:
        return ExitCode.CERTIFIED
    return ExitCode.INTERRUPTED if interrupted else ExitCode.NOT_CONVERGED


def _all_written(call: Session, bodies: Equilibria, found: Found) -> Iterator[EquilibriumRow]:
    """Write all equilibria, and tell how many are written; their rows. Collective."""
    count = len(found.points)
    for i in range(count):
        yield _written(call, bodies, found, i)
        tell_moving("%s", certified_in_words(i + 1, count))


def _written(call: Session, bodies: Equilibria, found: Found, i: int) -> EquilibriumRow:
    """Write one equilibrium into a result folder of its own; its row. After a signal nothing is drawn. Collective."""
    solution = bodies.solution(found.points[i])
    name = f"equilibrium-{i + 1:0{len(str(len(found.points)))}d}"
    drawn = not call.options.no_pictures and i < MOST_DRAWN and not call.interrupted()
    with results.ResultFolder(COMM, call.folder.work / name) as own:
        write_whole(own, solution, call.given, call.timer, LOG.info, pictures=drawn)
        own.commit(call.scene)
    return _row(i + 1, bodies, found.points[i], solution, name)


def _lines(prepared: Preparation, found: Found, rows: list[EquilibriumRow]) -> Iterator[str]:
    unit = "J/m" if prepared.problem.scales.dimension == 2 else "J"
    for row in rows[:MOST_TOLD]:
        uncertified = "" if row.certified else "  NOT CERTIFIED"
        yield f"{row.index:4d}  {row.energy:.10g} {unit}  {row.kind}  {row.broken} broken{uncertified}"
    if len(rows) > MOST_TOLD:
        yield f"      and {len(rows) - MOST_TOLD} more in {TABLE}"
    if found.gap is not None and found.lower_bound is not None:
        bound = found.lower_bound * prepared.problem.scales.energy
        yield f"no displacement has an energy below {bound:.10g} {unit} (relative gap {found.gap:.1e})"


@dataclass(frozen=True, kw_only=True)
class EquilibriumRow:
    """One equilibrium in ``equilibria.csv``.

    Attributes:
        index: from 1, by energy.
        energy: J/m or J.
        kind: minimiser, saddle or undecided.
        max_slip: largest |u_t| on Γc, m.
        max_opening: largest displacement off the obstacle, m.
        broken: unknowns of Γc beyond a drop of their law, or on or beyond a falling part.
        folder: of its result.
        isolated: False where it stands for a continuum.
        certified: whether its certificate passed.
    """

    index: int
    energy: float
    kind: str
    max_slip: float
    max_opening: float
    broken: int
    folder: str
    isolated: bool
    certified: bool


def _row(index: int, bodies: Equilibria, point: StationaryPoint, solution: Solution, folder: str) -> EquilibriumRow:
    """The row of an equilibrium. Collective.

    Args:
        index: from 1, by energy.
        bodies: that were searched.
        point: the equilibrium.
        solution: the same of the whole bodies.
        folder: of its result.
    """
    problem, examination = solution.problem, solution.examination
    assert bodies.problem is not None
    assert examination is not None
    comm, unit = problem.domain.mesh.comm, problem.scales.displacement
    slip = max((_largest(np.linalg.norm(s.slip, axis=1)) for s in examination.states), default=0.0)
    opening = max((_largest(_opening(s)) for s in examination.states), default=0.0)
    return EquilibriumRow(
        index=index,
        energy=examination.energy * problem.scales.energy,
        kind=point.kind,
        max_slip=largest(comm, slip) * unit,
        max_opening=largest(comm, opening) * unit,
        broken=falls_passed(bodies.problem, point.x) if point.x.size else 0,
        folder=folder,
        isolated=point.isolated,
        certified=solution.converged,
    )


def _opening(state: ContactState) -> Array:
    return np.where(np.isfinite(state.gap), state.gap, -state.normal)


def _largest(values: Array) -> float:
    return float(np.max(values, initial=0.0))


def _write(
    folder: ResultFolder, prepared: Preparation, found: Found, rows: list[EquilibriumRow], code: ExitCode, command: str
) -> None:
    """Write table, summary and scene. Collective.

    Args:
        folder: being written.
        prepared: the scene.
        found: by the search.
        rows: of its equilibria.
        code: what the command ends with.
        command: the command line.
    """
    entry = _entry(found, rows, prepared.problem.scales.energy)
    record = common(prepared) | plain(
        {"reason": found.reason, "exit_code": int(code), "equilibria": entry, "command": command}
    )

    def act() -> None:
        tables.write(folder.work / TABLE, COLUMNS, ([getattr(r, name) for name in COLUMNS] for r in rows))
        writing.text(folder.work / "scene.toml", dump_scene(prepared.scene, folder.target))
        write_record(folder.work, record)

    on_root(folder.comm, act)


def _entry(found: Found, rows: list[EquilibriumRow], unit: float) -> dict[str, Any]:
    """The entry ``equilibria`` of the summary."""
    return {
        "count": len(rows),
        "complete": found.complete,
        "lowest_energy": rows[0].energy if rows else None,
        "lower_bound": math.nan if found.lower_bound is None else found.lower_bound * unit,
        "gap": found.gap,
        "proven": found.proven,
        "nodes": found.nodes,
        "continua": [r.index for r in rows if not r.isolated],
        "uncertified": [r.index for r in rows if not r.certified],
    }
