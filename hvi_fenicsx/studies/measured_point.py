"""One point of a study: solved, kept in files, and timed."""

from __future__ import annotations

import gc
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI
from scipy import sparse

from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.control import solve_to_goal
from ..accuracy.goal import Goal
from ..report.solution_arrays import SolutionArrays, save
from ..results.gathering import solution_arrays
from ..results.summary import summary
from ..runtime import writing
from ..runtime.mpi import largest, on_root
from ..runtime.timing import Timer
from ..scene import Scene
from ..workflow import Solution, solve
from . import cost
from .solution_fields import fields, width
from .stiffness import stiffness
from .store import write_json


@dataclass(frozen=True, kw_only=True)
class MeasuredPoint:
    """A point of a study.

    Attributes:
        scene: what it solves.
        comm: the ranks that solve it.
        accuracy: of an adaptive mesh, in the energy norm; None: the scene's own mesh.
        stiffness: whether the stiffness is kept too, since it will be a reference.
    """

    scene: Scene
    comm: MPI.Comm
    accuracy: float | None = None
    stiffness: bool = False

    def measure(self, result: Path, repeat: int) -> None:
        """Solve it once to fill caches and to read the peak memory off, then until the median of its cost is steady.

        Collective. Writes RESULT.npz, RESULT.stiffness.npz and, last, RESULT.json.

        Args:
            result: the files, without their endings.
            repeat: repetitions at most.

        Raises:
            NotWrittenError: they cannot be written, on all ranks alike.
        """
        first = self._solved(Timer())
        record = summary(first)
        if first.solve_result is not None:
            self._keep(result, first, record)
        times = [record["time"]]
        converged = first.converged
        del first
        if converged:
            times = self._repeated(repeat, times)
        record["cost"] = cost.cost_record(times)
        on_root(self.comm, lambda: write_json(result.with_suffix(".json"), record))

    def _solved(self, timer: Timer) -> Solution:
        """The scene on its mesh, or on one made for an accuracy. Collective."""
        if self.accuracy is None:
            return solve(self.scene, self.comm, timer=timer)
        solver = AdaptiveSolver(timer=timer)
        found = solve_to_goal(self.scene, self.comm, Goal(self.accuracy), solver, lambda line: None).solution
        timer.seconds["solve"] += timer.seconds["estimate"]  # which steers the refinement: part of what it costs
        return found

    def _keep(self, result: Path, solution: Solution, record: dict[str, Any]) -> None:
        """The solution, its mesh width and, of a reference, its stiffness. Collective."""
        found = solution_arrays(solution)
        matrix = stiffness(solution) if self.stiffness else None
        if found is not None:
            record["h"] = width(found.points, fields(found).corners)
        on_root(self.comm, lambda: _save(result, found, matrix))

    def _repeated(self, repeat: int, times: list[dict[str, float]]) -> list[dict[str, float]]:
        """Times of further runs until their median is steady; the first, which filled the caches, only if it is alone.

        Collective: rank 0 decides.
        """
        found: list[dict[str, float]] = []
        while self.comm.bcast(cost.wanted(found, times[0], repeat), root=0):
            gc.collect()
            timer = Timer()
            self._solved(timer)
            found.append({phase: largest(self.comm, seconds) for phase, seconds in timer.report().items()})
        return found or times


def _save(result: Path, found: SolutionArrays | None, matrix: sparse.csr_array | None) -> None:
    """Rank 0 only."""
    if found is not None:
        save(result.with_suffix(".npz"), found)
    if matrix is not None:
        with writing.whole(result.with_suffix(".stiffness.npz")) as aside, aside.open("wb") as file:
            sparse.save_npz(file, matrix, compressed=False)
