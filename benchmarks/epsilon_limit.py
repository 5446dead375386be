"""Smoothed solutions beside the exact one as ε tends to 0: the energy's error, and that of u_t and -σ_t.

    ./hvi exec python3 benchmarks/epsilon_limit.py [--cells 32] [--out docs/images/epsilon.png]

The smoothed law differs from j by at most κ ε for each of its two kinks ±δ, so in one valley of the energy the minima
differ by at most 2 κ ε |Γc|. All solutions are reached from the same start; wide smoothings may end in another valley.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

from hvi_fenicsx import Solution, read_scene, solve
from hvi_fenicsx.laws.smoothing import QUADRATIC, Chks, LogExp

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SCENE = Path(__file__).parents[1] / "demos" / "strong_law.toml"
WIDTHS = 10.0 ** np.arange(0, -6.5, -0.5)
PLUS_FUNCTIONS = {plus.name: plus for plus in (QUADRATIC, Chks(), LogExp())}
COLOURS = {"quadratic": "#0072B2", "chks": "#D55E00", "log_exp": "#009E73"}


@dataclass(frozen=True)
class Error:
    """Errors of a smoothed solution: energy (J/m) with its bound; u_t and -σ_t relative to their largest values."""

    energy: float
    bound: float
    slip: float
    friction: float


def energy(solution: Solution) -> float:
    """J/m of a certified solution."""
    if not solution.converged or solution.examination is None:
        raise SystemExit(f"{solution.scene.title}: {solution.reason}")
    return solution.examination.energy * solution.problem.scales.energy


def curves(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """u_t and -σ_t on the floor, nondimensional."""
    assert solution.examination is not None
    state = solution.examination.states[0]
    return state.slip[:, 0], state.friction[:, 0]


def errors(kind: str, cells: int) -> Iterator[Error]:
    """For each width."""
    size = f"domain.cells=[{cells}, {cells}]"
    exact = solve(read_scene(SCENE, [size]))
    slip, friction = curves(exact)
    scales, law = exact.problem.scales, exact.problem.terms[0].exact
    for width in WIDTHS:
        found = solve(read_scene(SCENE, [size, f'solver.smoothing="{kind}"', f"solver.epsilon={width}"]))
        u, f = curves(found)
        bound = 2 * PLUS_FUNCTIONS[kind].kappa * width * law.energy_scale * scales.energy
        yield Error(
            abs(energy(found) - energy(exact)),
            bound,
            float(np.max(np.abs(u - slip)) / np.max(np.abs(slip))),
            float(np.max(np.abs(f - friction)) / np.max(np.abs(friction))),
        )


def draw(table: dict[str, list[Error]], path: Path) -> None:
    """Three panels against ε."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
    for kind, found in table.items():
        for axis, name in zip(axes, ("energy", "slip", "friction"), strict=True):
            values = np.array([getattr(e, name) for e in found])
            axis.loglog(WIDTHS, np.maximum(values, 1e-16), "o-", color=COLOURS[kind], label=kind)
        axes[0].loglog(WIDTHS, [e.bound for e in found], "--", color=COLOURS[kind], alpha=0.6)
    for axis, title in zip(
        axes,
        (
            "energy error / (J/m), dashed: its bound",
            "largest error of u_t, relative",
            "largest error of -σ_t, relative",
        ),
        strict=True,
    ):
        axis.set(xlabel="ε, relative to the law's energy at its kink", title=title)
        axis.grid(alpha=0.3)
    axes[1].legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print a table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=32)
    parser.add_argument("--out", type=Path, default=Path("docs/images/epsilon.png"))
    options = parser.parse_args()
    table = {kind: list(errors(kind, options.cells)) for kind in PLUS_FUNCTIONS}
    print("| smoothing | ε | energy error / (J/m) | bound | u_t error | -σ_t error |\n|---|---|---|---|---|---|")
    for kind, found in table.items():
        for width, e in zip(WIDTHS, found, strict=True):
            print(f"| {kind} | {width:.1e} | {e.energy:.2e} | {e.bound:.2e} | {e.slip:.2e} | {e.friction:.2e} |")
    draw(table, options.out)


if __name__ == "__main__":
    main()
