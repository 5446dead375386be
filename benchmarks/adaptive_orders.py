"""Orders of uniform and adaptive refinement at corners, and what tying the solver's tolerance to the estimate saves.

    ./hvi exec python3 benchmarks/adaptive_orders.py [--most UNKNOWNS] [--write]

CPU times are of one rank. ``--write`` puts the tables and the picture into docs/accuracy.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import common
import numpy as np
from accuracy import PAGE, solver
from mpi4py import MPI

from hvi_fenicsx import Scene, read_scene
from hvi_fenicsx.accuracy import adaptive, control
from hvi_fenicsx.accuracy.goal import Goal
from hvi_fenicsx.accuracy.thresholds import CONTROL

ROOT = Path(__file__).parents[1]
CORNERS = {
    "L-shape": {
        "domain": {"shape": "l_shape", "size": [1.0, 1.0], "cut": [0.5, 0.5], "mesh_size": 0.15},
        "hold": {"on": "bottom", "displacement": [0.0, 0.0]},
        "pull": {"on": "top", "traction": [1e6, 0.0]},
    },
    "notch": {
        "domain": {"shape": "notched_strip", "size": [1.0, 0.5], "notch": [0.05, 0.25], "mesh_size": 0.12},
        "hold": {"on": "left", "displacement": [0.0, 0.0]},
        "pull": {"on": "right", "traction": [1e6, 0.0]},
    },
}


def corner(name: str) -> Scene:
    table = CORNERS[name]
    return Scene.model_validate(
        {
            "domain": table["domain"],
            "material": {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
            "boundary": {part: table[part] for part in ("hold", "pull")},
        }
    )


def refined_to(scene: Scene, bulk: float, most: int) -> tuple[list[int], list[float]]:
    """Unknowns and estimated errors of a mesh hierarchy up to so many unknowns."""
    go = solver()
    level = go.begin(scene, MPI.COMM_WORLD)
    sizes, errors = [], []
    while True:
        sizes.append(level.dofs)
        errors.append(level.solution.estimate.relative)  # type: ignore[union-attr]
        if level.dofs > most:
            return sizes, errors
        level = go.refine(level, adaptive.refined(level, bulk), scene)


def order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log error over log unknowns, over the last factor of about 30 in unknowns."""
    kept = [i for i, n in enumerate(sizes) if n >= sizes[-1] / 30]
    return float(np.polyfit(np.log(np.array(sizes)[kept]), np.log(np.array(errors)[kept]), 1)[0])


def orders(path: Path | None, most: int) -> Iterator[str]:
    """Observed orders in unknowns, as a table, and a picture."""
    yield "| body | uniform | adaptive | of P1 at best |\n|---|---|---|---|"
    curves = {name: (refined_to(corner(name), 1.0, most), refined_to(corner(name), 0.75, most)) for name in CORNERS}
    for name, (uniform, adapted) in curves.items():
        yield f"| {name} | {order(*uniform):.2f} | {order(*adapted):.2f} | -0.50 |"
    if path is not None:
        draw_orders(path, curves)


def draw_orders(path: Path, curves: dict[str, Any]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(curves), figsize=(9, 3.6), sharey=True)
    for ax, (name, (uniform, adapted)) in zip(axes, curves.items(), strict=True):
        for label, marker, (sizes, errors) in (("uniform", "s", uniform), ("adaptive", "o", adapted)):
            ax.loglog(sizes, errors, marker=marker, markersize=4, label=f"{label}: order {order(sizes, errors):.2f}")
        sizes = np.array([adapted[0][0], adapted[0][-1]], dtype=float)
        ax.loglog(sizes, 0.7 * adapted[1][-1] * (sizes / sizes[-1]) ** -0.5, "k--", linewidth=1, label="order -0.50")
        ax.set(title=name, xlabel="unknowns")
        ax.grid(True, which="major", alpha=0.3)
        ax.legend(frameon=False)
    axes[0].set_ylabel("estimated error, energy norm, relative")
    figure.tight_layout()
    figure.savefig(path, dpi=130)


def tolerance_savings() -> Iterator[str]:
    """CPU time of one request with the tied tolerance, and with 1e-10 on every mesh."""
    yield "| scene | requested | tied / s | 1e-10 / s | ratio | linear iterations |\n|---|---|---|---|---|---|"
    for name, requested in (("strong_law", 1e-3), ("lift_off", 2e-3), ("hertz", 1e-2)):
        scene = read_scene(ROOT / "demos" / f"{name}.toml")
        spent = []
        for coarsest in (CONTROL.coarsest_tolerance, CONTROL.finest_tolerance):
            limits = replace(CONTROL, coarsest_tolerance=coarsest)
            start = time.process_time()
            reached = control.solve_to_goal(scene, MPI.COMM_WORLD, Goal(requested), solver(), lambda line: None, limits)
            spent.append((time.process_time() - start, reached.solution.solve_result.counts.linear))  # type: ignore[union-attr]
        (tied, few), (tight, many) = spent
        yield f"| {name} | {requested:g} | {tied:.1f} | {tight:.1f} | {tight / tied:.2f} | {few}, {many} |"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--most", type=int, default=100_000, help="unknowns of a mesh hierarchy")
    options.add_argument("--write", action="store_true")
    given = options.parse_args()
    image = ROOT / "docs" / "images" / "adaptive_orders.png" if given.write else None
    for name, lines in (("orders", orders(image, given.most)), ("tolerances", tolerance_savings())):
        found = "\n".join(lines)
        print(found, flush=True)
        if given.write:
            common.insert(PAGE, name, found)


if __name__ == "__main__":
    main()
