"""What contact and friction cost over one linear solve of the same mesh, side by side in one run.

    ./hvi exec python3 benchmarks/contact_over_linear.py [--cells 512] [--repeats 3] [SCENE.toml ...]
    ./hvi exec mpirun -n 2 python3 -m mpi4py benchmarks/contact_over_linear.py

The linear solve has contact closed and the laws at rest (no inequality left): same mesh, assembly and tolerance, CG
with GAMG and the rigid motions as near-null space. Medians of the repeats, after one that warms the JIT cache.
Certified runs only; one that is not is reported and ends with 1.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

from mpi4py import MPI

from hvi_fenicsx import read_scene
from hvi_fenicsx.scene import Scene
from hvi_fenicsx.solution import Prepared, finish, prepare
from hvi_fenicsx.solvers.activeset import ActiveSetSolver
from hvi_fenicsx.solvers.base import resting_start
from hvi_fenicsx.solvers.linear import LinearSettings
from hvi_fenicsx.timing import Timer

COMM = MPI.COMM_WORLD
DEMOS = Path(__file__).parents[1] / "demos"


def linear(prepared: Prepared) -> float:
    """Seconds of setup and solve of one linear system with contact closed."""
    system = prepared.system
    solver = ActiveSetSolver(system, LinearSettings.choose(system, "gamg"), Timer())
    laws = [term.law for term in system.terms]
    system.set_rates([0.0 * k for k in system.rates])
    COMM.barrier()
    start = time.perf_counter()
    resting_start(solver, laws, prepared.scene.solver.tolerance)
    elapsed = time.perf_counter() - start
    solver.destroy()
    return elapsed


def once(scene: Scene) -> dict[str, float]:
    """Seconds by phase of one whole run, and of the linear solve on the same assembled system."""
    COMM.barrier()
    start = time.perf_counter()
    prepared = prepare(scene, COMM, Timer())
    ready = time.perf_counter() - start
    lone = linear(prepared)
    start = time.perf_counter()
    solution = finish(prepared)
    solved = time.perf_counter() - start
    if not solution.converged:
        raise SystemExit(f"{scene.title}: {solution.reason}")
    counts = solution.solved.counts
    return {
        "to_solution": ready + solved,
        "to_linear": ready + lone,
        "solve": solved,
        "linear": lone,
        "certificate": solution.timer.seconds["certificate"],
        "newton": counts.newton,
        "branch": counts.branch,
        "dofs": solution.dofs,
    }


def main() -> None:
    """Print a markdown table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, default=[DEMOS / "wall_left.toml", DEMOS / "strong_law.toml"])
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    size = f"domain.cells=[{options.cells}, {options.cells}]"
    if COMM.rank == 0:
        print("| scene | dofs | scene to solution / s | to linear / s | ratio | solve / s | linear / s | ratio |")
        print("|---|---|---|---|---|---|---|---|", flush=True)
    for path in options.scenes:
        scene = read_scene(path, [size])
        once(scene)
        runs = [once(scene) for _ in range(options.repeats)]
        m = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        if COMM.rank == 0:
            print(
                f"| {path.stem} ({m['branch']:.0f} branch, {m['newton']:.0f} Newton steps) | {m['dofs']:.0f} "
                f"| {m['to_solution']:.2f} | {m['to_linear']:.2f} | **{m['to_solution'] / m['to_linear']:.2f}** "
                f"| {m['solve']:.2f} (certificate {m['certificate']:.2f}) | {m['linear']:.2f} "
                f"| **{m['solve'] / m['linear']:.2f}** |",
                flush=True,
            )


if __name__ == "__main__":
    main()
