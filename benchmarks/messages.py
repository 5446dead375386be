"""Messages and reductions of a linear solve by conjugate gradients with multigrid, as PETSc counts them, by iteration.

    ./hvi exec mpirun -n 4 python3 -m mpi4py benchmarks/messages.py [SCENE] [CELLS ...]

Nothing is timed, so ranks may share cores. The model is that of docs/scaling.md.
"""

from __future__ import annotations

import sys
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
from hvi_fenicsx.system.held_solver import LinearSettings
from hvi_fenicsx.system.system import System

COMM = MPI.COMM_WORLD


def pairs(system: System) -> int:
    """Pairs of ranks, in both directions, that send values to each other for a product with the matrix."""
    known = np.zeros((COMM.size, COMM.size), dtype=np.int64)
    known[COMM.rank, np.unique(system.problem.space.dofmap.index_map.owners)] = 1
    known = COMM.allreduce(known)
    return int(np.count_nonzero(known + known.T))


def shared(system: System) -> int:
    """Numbers that such an exchange sends: the vertices on cuts one way, those next to them the other way."""
    dofs = system.problem.space.dofmap
    return int(2 * dofs.index_map_bs * COMM.allreduce(dofs.index_map.num_ghosts))


def modelled(systems: list[System]) -> tuple[float, float]:
    """Messages and numbers of an iteration: one product, and on each level a residual, two transfers and a sweep."""
    above, ranks = systems[:-1], COMM.size
    messages = pairs(above[0]) + sum(4 * pairs(one) for one in above) + ranks * (ranks - 1)
    numbers = shared(above[0]) + sum(2 * shared(fine) + 2 * shared(coarse) for fine, coarse in pairwise(systems))
    return messages, numbers + (ranks - 1) * systems[-1].dofs


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
    systems = [system, *(level.system for level in levels)]
    messages, numbers, reductions = (second - first) / (many - few)
    model = modelled(systems)
    if COMM.rank == 0:
        row = [scene_name, "x".join(cells), COMM.size, len(systems), many, f"{messages:.0f}", f"{model[0]:.0f}"]
        row += [f"{messages / model[0]:.2f}", f"{numbers:.0f}", f"{model[1]:.0f}", f"{numbers / model[1]:.2f}"]
        print("| " + " | ".join(map(str, [*row, f"{reductions:.0f}"])) + " |", flush=True)


if __name__ == "__main__":
    main()
