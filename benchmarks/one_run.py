"""One timed solve in a process of its own, for the benchmarks: its figures as JSON on the last line of stdout.

    ./hvi exec python3 benchmarks/one_run.py '{"scene": "demos/wall_left.toml", "overrides": [], "solver": "contact"}'

``solver``: ``contact`` is what a user gets; ``gamg``, ``hypre``, ``mumps`` and ``mg`` (multigrid on the mesh hierarchy)
are one linear solve of the same mesh, contact closed and laws at rest; ``plain`` is PETSc's SNES VI as it is usually
written. A small run before it loads the libraries and fills the JIT cache.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import petsc_methods  # noqa: F401  (tao and ssls are known then)
from mpi4py import MPI

from hvi_fenicsx import read_scene
from hvi_fenicsx.estimate.estimator import ratio
from hvi_fenicsx.model import Model
from hvi_fenicsx.runtime import cost
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.resting_start import resting_start
from hvi_fenicsx.system import petsc_options
from hvi_fenicsx.system.held_solver import LinearSettings
from hvi_fenicsx.system.system import System, assemble
from hvi_fenicsx.workflow import finish, prepare

COMM = MPI.COMM_WORLD
HYPRE = (
    "-hvi_pc_type hypre -hvi_pc_hypre_type boomeramg -hvi_pc_hypre_boomeramg_nodal_coarsen 6 "
    "-hvi_pc_hypre_boomeramg_vec_interp_variant 3"
)
KINDS = {"gamg": "gamg", "hypre": "gamg", "mumps": "lu", "mg": "mg"}
Figures = dict[str, Any]


def contact(scene: Model) -> Figures:
    """From the scene to a certified solution."""
    timer = Timer()
    solution = finish(prepare(scene, COMM, timer))
    counts, errors = solution.solve_result.counts, solution.estimate
    return {
        **timer.report(),
        "certified": solution.converged,
        "reason": solution.reason,
        "energy": solution.examination.energy,
        "newton": counts.newton,
        "linear": counts.linear,
        "branch": counts.branch,
        "levels": solution.solve_result.levels,
        "unsolved": ratio(errors.algebraic, errors.discretisation) if errors else float("nan"),
        "dofs": solution.dofs,
    }


def linear(scene: Model, kind: str) -> Figures:
    """The linear solve, to the scene's tolerance of the residual."""
    if kind == "hypre":
        petsc_options.insert(HYPRE)
    timer = Timer()
    prepared = prepare(scene, timer=timer)
    system, levels = prepared.system, ()
    if kind == "mg":
        levels = nested_iteration.coarser_levels(prepared.task(), system)
    solver = ActiveSetSolver(system, levels, LinearSettings(KINDS[kind]), timer)
    _, iterations = resting_start(solver, [t.law for t in system.terms], scene.solver.tolerance)
    return {**timer.report(), "linear": iterations, "dofs": system.dofs, "certified": True}


def assembled(scene: Model, timer: Timer) -> System:
    """The scene's system, on its mesh with its mesh hierarchy."""
    with timer("mesh"):
        domain = scene.domain.build_hierarchy(COMM, scene.dimension)
    return assemble(domain, scene.formulation(), timer)


def plain(scene: Model) -> Figures:
    """``vinewtonrsls`` with GAMG set on the SNES, from the start with contact closed, on the scene's laws."""
    from plain_snes import solve

    timer = Timer()
    system = assembled(scene, timer)
    with timer("solve"):
        figures = solve(system, scene.solver.tolerance)
    return {**timer.report(), **figures, "dofs": system.dofs}


def spmv(system: System) -> float:
    """Seconds of one product with the system's matrix, the least of 20."""
    x, y = system.jacobian.matrix.createVecs()
    x.set(1.0)
    seconds = []
    for _ in range(20):
        start = time.perf_counter()
        system.jacobian.matrix.mult(x, y)
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def warm(task: Figures) -> None:
    """The same on a small mesh; ``warm`` may give overrides for it, or be false."""
    if isinstance(task.get("warm"), list):
        contact(read_scene(Path(task["scene"]), [*task["overrides"], *task["warm"]]))
    elif task.get("warm", True):
        scene = read_scene(Path(task["scene"]), task["overrides"])
        cells = "[16, 16]" if scene.dimension == 2 else "[4, 4, 4]"
        if scene.domain.shape != "file":
            scene = read_scene(Path(task["scene"]), [*task["overrides"], f"domain.cells={cells}"])
        contact(scene)


def main() -> None:
    """Run what the argument says."""
    task = json.loads(sys.argv[1])
    if task.get("clock") == "cpu":
        cost.time.perf_counter = time.process_time  # type: ignore[attr-defined]
    warm(task)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    scene = read_scene(Path(task["scene"]), task["overrides"])
    kind = task["solver"]
    figures = contact(scene) if kind == "contact" else plain(scene) if kind == "plain" else linear(scene, kind)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    figures |= {"peak_mb": COMM.allreduce(peak), "net_mb": COMM.allreduce(peak - before)}
    if task.get("spmv"):
        figures["spmv"] = spmv(assembled(scene, Timer()))
    if COMM.rank == 0:
        print(json.dumps(figures), flush=True)


if __name__ == "__main__":
    main()
