"""``python3 -m hvi_fenicsx.studies.point SCENE.toml RESULT``: one point of a study, in a process (or ranks) of its own.

Solved once to fill caches and to read the peak memory off, then again until the median of its cost is steady. Writes
RESULT.npz (the solution), then RESULT.json (what it cost), each whole or not at all; with ``--stiffness`` also
RESULT.stiffness.npz. Exit code 0 whatever the outcome of the solve; 2 for a scene that does not fit its mesh; that of
:class:`.errors.NotStoredError` where its files cannot be written.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI
from scipy import sparse

from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.control import solve_to_goal
from ..accuracy.goal import Goal
from ..errors import HviError, InputError
from ..report.solution_arrays import SolutionArrays, save
from ..results.gathering import solution_arrays
from ..results.summary import summary
from ..runtime.mpi import ended_together, on_root
from ..runtime.timing import Timer
from ..scene import Scene, read_scene
from ..solution import Solution
from ..workflow import finish, prepare
from . import cost
from .errors import NotStoredError
from .runner import COMPLAINT
from .solution_fields import width
from .stiffness import stiffness
from .store import write_json

COMM = MPI.COMM_WORLD


def main() -> int:
    """The command; its exit code. Collective under mpirun."""
    parser = argparse.ArgumentParser(prog="python3 -m hvi_fenicsx.studies.point")
    parser.add_argument("scene", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--repeat", type=int, default=1, help="repetitions at most")
    parser.add_argument("--stiffness", action="store_true", help="write the stiffness too: it will be a reference")
    parser.add_argument("--accuracy", type=float, help="of an adaptive mesh, in the energy norm")
    options = parser.parse_args()
    try:
        with ended_together(COMM):
            _point(options)
    except HviError as error:
        if COMM.rank == 0:
            print(f"{COMPLAINT}{error}", file=sys.stderr)
        return error.exit_code
    return 0


def _point(options: argparse.Namespace) -> None:
    scene = on_root(COMM, lambda: read_scene(options.scene))
    first = _solved(scene, options, Timer())
    record = summary(first)
    if first.solve_result is not None:
        _keep(options, first, record)
    times = [record["time"]]
    converged = first.converged
    del first
    if converged:
        times = _repeated(scene, options, times)
    record["cost"] = cost.cost_record(times)
    _store(lambda: write_json(options.result.with_suffix(".json"), record))


def _solved(scene: Scene, options: argparse.Namespace, timer: Timer) -> Solution:
    """The scene on its mesh, or on one made for an accuracy. Collective."""
    if options.accuracy is not None:
        found = solve_to_goal(
            scene, COMM, Goal(options.accuracy), AdaptiveSolver(timer=timer), lambda line: None
        ).solution
        timer.seconds["solve"] += timer.seconds["estimate"]  # which steers the refinement: part of what it costs
        return found
    return finish(prepare(scene, COMM, timer))


def _keep(options: argparse.Namespace, solution: Solution, record: dict[str, Any]) -> None:
    """The solution, its mesh width and, of a reference, its stiffness. Collective."""
    found = solution_arrays(solution)
    matrix = stiffness(solution) if options.stiffness else None
    if found is not None:
        record["h"] = width(found.points, found.cells)
    _store(lambda: _save(options.result, found, matrix))


def _save(result: Path, found: SolutionArrays | None, matrix: sparse.csr_array | None) -> None:
    """Rank 0 only."""
    if found is not None:
        save(result.with_suffix(".npz"), found)
    if matrix is not None:
        sparse.save_npz(result.with_suffix(".stiffness.npz"), matrix, compressed=False)


def _store(write: Callable[[], None]) -> None:
    """Write files on rank 0. Collective.

    Raises:
        NotStoredError: they cannot be written, on all ranks alike.
    """
    try:
        on_root(COMM, write)
    except InputError as error:
        raise NotStoredError(str(error)) from None


def _repeated(scene: Scene, options: argparse.Namespace, times: list[dict[str, float]]) -> list[dict[str, float]]:
    """Times of further runs until their median is steady; the first, which filled the caches, only where it is alone.

    Collective: rank 0 decides.
    """
    found: list[dict[str, float]] = []
    while COMM.bcast(cost.wanted(found, times[0], options.repeat), root=0):
        gc.collect()
        timer = Timer()
        _solved(scene, options, timer)
        found.append(_slowest(timer.report()))
    return found or times


def _slowest(times: dict[str, float]) -> dict[str, float]:
    """By phase, the slowest rank's. Collective."""
    return {name: COMM.allreduce(value, op=MPI.MAX) for name, value in times.items()}


if __name__ == "__main__":
    raise SystemExit(main())
