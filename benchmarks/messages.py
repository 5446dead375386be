"""Messages and reductions of a linear solve by conjugate gradients with multigrid, as PETSc counts them, by iteration.

    ./hvi exec mpirun -n 4 python3 -m mpi4py benchmarks/messages.py [SCENE] [CELLS ...]

Nothing is timed, so ranks may share cores. The model is that of docs/scaling.md.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from common import DEMOS, SCENES
from mpi4py import MPI
from one_run import assembled
from petsc4py import PETSc

from hvi_fenicsx import read_scene
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.scene_model import model_of, options_of
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.closed_start import resting_start
from hvi_fenicsx.solvers.context import RunControl
from hvi_fenicsx.system.fewer_ranks import joined_ranks
from hvi_fenicsx.system.levels import Levels
from hvi_fenicsx.system.linear_settings import LinearSettings
from hvi_fenicsx.system.system import System

COMM = MPI.COMM_WORLD


@dataclass(frozen=True)
class Ghosts:
    """Of a level, by rank: how many numbers it owns; the vertices of others next to its own, and who owns these.

    Attributes:
        owned: numbers by rank.
        known: by rank, of each vertex of another one: its number and its owner.
        width: numbers by vertex.
        joined: how many neighbouring ranks have given their rows to the first of them.
    """

    owned: list[int]
    known: list[list[tuple[int, int]]]
    width: int
    joined: int

    def place(self, rank: int) -> int:
        """The rank that has the rows of this one."""
        return rank // self.joined * self.joined


def ghosts(system: System, joined: int) -> Ghosts:
    """Those of a level. Collective."""
    dofs = system.problem.space.dofmap
    own = list(zip(dofs.index_map.ghosts.tolist(), dofs.index_map.owners.tolist(), strict=True))
    owned = COMM.allgather(dofs.index_map.size_local * dofs.index_map_bs)
    return Ghosts(owned, COMM.allgather(own), dofs.index_map_bs, joined)


def exchange(rows: Ghosts, columns: Ghosts) -> tuple[int, int]:
    """Messages and numbers of a product: vertices on cuts go one way, those next to them the other way.

    Where the rows and the columns of a rank are in different places, all that it owns is sent too.
    """
    pairs: set[tuple[int, int]] = set()
    wanted: set[tuple[int, int]] = set()
    numbers = 0
    for rank, known in enumerate(columns.known):
        here, there = rows.place(rank), columns.place(rank)
        if here != there:
            pairs.add((here, there))
            numbers += columns.owned[rank]
        for vertex, owner in known:
            for one, other in ((here, columns.place(owner)), (rows.place(owner), there)):
                if one != other:
                    pairs.add((one, other))
            if here != rows.place(owner):
                wanted.add((here, vertex))
    return len(pairs), numbers + 2 * columns.width * len(wanted)


def placed(system: System, levels: Levels) -> list[Ghosts]:
    """The levels, finest first, as they are on their ranks. Collective."""
    least = system.thresholds.rank_unknowns
    joined = [joined_ranks(level.system.dofs, COMM.size, least) for level in levels[:-1]]
    systems = [system, *(level.system for level in levels)]
    return [ghosts(one, n) for one, n in zip(systems, [1, *joined, COMM.size], strict=True)]


def modelled(levels: list[Ghosts]) -> tuple[float, float]:
    """Messages and numbers of an iteration: one product, and on each level a residual, two transfers and a sweep."""
    parts = [exchange(levels[0], levels[0])]
    for fine, coarse in pairwise(levels):
        parts += 2 * [exchange(fine, fine)] + 2 * [exchange(fine, coarse)]
    return sum(part[0] for part in parts), sum(part[1] for part in parts)


def counted() -> tuple[float, float, float]:
    """Messages sent by all ranks, numbers in them, and reductions of this rank, within linear solves so far.

    PETSc counts a message where it is sent and where it arrives.
    """
    found = PETSc.Log.Event("KSPSolve").getPerfInfo()
    sent, length = (COMM.allreduce(found[key]) / 2 for key in ("numMessages", "messageLength"))
    return sent, length / 8, found["numReductions"]


def main() -> None:
    """Print one line of the table."""
    scene_name, *cells = sys.argv[1:] or ["strong law", "64", "64"]
    name, own = SCENES[scene_name]
    scene = read_scene(DEMOS / f"{name}.toml", [*own, f"domain.cells=[{', '.join(cells)}]"])
    PETSc.Log.begin()
    timer = Timer()
    system, options = assembled(scene, timer), options_of(scene.solver)
    levels = nested_iteration.coarser_levels(model_of(scene), system, options, RunControl(timer=timer))
    solver = ActiveSetSolver(system, levels, LinearSettings("mg"), timer)
    results = []
    for tolerance in (1e-2, 1e-10):
        before = counted()
        iterations = resting_start(solver, [term.law for term in system.terms], tolerance)[1]
        results.append((iterations, np.subtract(counted(), before)))
    (few, first), (many, second) = results
    systems = placed(system, levels)
    messages, numbers, reductions = (second - first) / (many - few)
    model = modelled(systems)
    if COMM.rank == 0:
        row = [scene_name, "x".join(cells), COMM.size, len(systems), many, f"{messages:.0f}", f"{model[0]:.0f}"]
        row += [f"{messages / model[0]:.2f}", f"{numbers:.0f}", f"{model[1]:.0f}", f"{numbers / model[1]:.2f}"]
        print("| " + " | ".join(map(str, [*row, f"{reductions:.0f}"])) + " |", flush=True)


if __name__ == "__main__":
    main()
