"""The paper's Figures 3, 4 and 5, computed again, with the law itself beside its smoothing.

Ovcharova and Gwinner solve their model problem (section 5.1) with a wall on the left and on the right, on four meshes,
with the nonmonotone law smoothed by ε = 0.1. Their figures show the deformed square, u1 on Γc and -σ_t on Γc. This
script draws the same, and next to it what the law gives when nothing is smoothed: the limit ε → 0, which the branch
iteration solves exactly. The captions say what ε = 0.1 does, in numbers taken from the two runs.

    ./hvi exec python3 demos/paper_figures.py [--out DIR]
    ./hvi exec mpirun -n 2 python3 -m mpi4py demos/paper_figures.py
"""

from __future__ import annotations

import argparse
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from hvi_fenicsx import read_scene, solve
from hvi_fenicsx.laws import QuadraticLinear, create, smoothing
from hvi_fenicsx.results.gathering import solution_arrays

Array = npt.NDArray[np.float64]
COMM = MPI.COMM_WORLD
DEMOS = Path(__file__).parent

# ## What is computed
#
# Both walls, the paper's four meshes, and two solvers: the scene files smooth as the paper does (its S, ε = 0.1 N/m);
# an empty solver table asks for the law itself.

WALLS, PARTS = {"left": "4", "right": "5"}, {"left": "a", "right": "b"}
CELLS = (4, 8, 16, 32)
SOLVERS: dict[str, list[str]] = {"paper": [], "limit": ["solver={}"]}


@dataclass(frozen=True)
class Run:
    """Fields on the boundary.

    Along Γc, by vertex: x1, u1, -σ_t, σ_n. Once around the whole boundary Γ: points and displacements, (k, 2).
    """

    x: Array
    u1: Array
    friction: Array
    normal: Array
    around: Array
    displacement: Array


def compute(wall: str, cells: int, overrides: list[str]) -> Run | None:
    """One run, gathered on rank 0 (None elsewhere). Collective."""
    scene = read_scene(DEMOS / f"wall_{wall}.toml", [f"domain.cells=[{cells}, {cells}]", *overrides])
    solution = solve(scene, COMM)
    if not solution.converged:
        raise SystemExit(f"wall {wall}, h = 1/{cells}: {solution.reason}")
    arrays = solution_arrays(solution)
    if arrays is None or arrays.displacement is None:
        return None
    columns = arrays.parts["floor"].columns
    around = boundary(arrays.points, arrays.displacement)
    return Run(columns["x"], columns["u_t1"], columns["friction_t1"], columns["sigma_n"], *around)


# The displacement of the vertices on the square's sides, sorted by their angle about its middle.


def boundary(points: Array, u: Array) -> tuple[Array, Array]:
    """Points and displacements on Γ, of those of the whole body (n, 2)."""
    on = np.isclose(np.abs(points - 0.5).max(axis=1), 0.5)
    order = np.argsort(np.arctan2(points[on, 1] - 0.5, points[on, 0] - 0.5))
    return points[on][order], u[on][order]


# ## What ε = 0.1 does
#
# The smoothing acts where the two pieces of j, γ1/(2δ) x² and γ2 |x|, differ by less than ε/2. With the paper's data
# they never differ by more than a fraction of that, so that it acts everywhere.


def law_of(wall: str) -> tuple[QuadraticLinear, float]:
    """The law of the scene, unsmoothed, and the paper's ε in N/m."""
    scene = read_scene(DEMOS / f"wall_{wall}.toml")
    table = scene.tables()["boundary"]["floor"]["friction"]
    law = create(table.pop("law"), table)
    epsilon = scene.solver.epsilon_absolute
    assert isinstance(law, QuadraticLinear)
    assert epsilon is not None
    return law, epsilon


def effect(paper: Run, limit: Run, law: QuadraticLinear, epsilon: float) -> dict[str, float]:
    """What the smoothing changes on the finest mesh, in the units of the captions."""
    slip = np.abs(paper.u1)
    pieces = np.abs(law.gamma2 * slip - law.gamma1 / (2 * law.delta) * slip**2)
    away = np.abs(paper.friction - limit.friction)
    worst, end = int(np.argmax(away)), int(np.argmax(slip))
    moved = np.linalg.norm(paper.displacement - limit.displacement, axis=1)
    return {
        "epsilon": epsilon,
        "pieces": float(pieces.max()),
        "false_kink": float(smoothing.create("paper", law, epsilon_absolute=epsilon).interval(np.zeros(1))[1][0]),
        "s": float(limit.x[worst]),
        "there": float(paper.friction[worst]),
        "truly": float(limit.friction[worst]),
        "share": float(np.max(np.abs(paper.friction / paper.normal))) * 100,
        "end": float(paper.friction[end]),
        "end_truly": float(limit.friction[end]),
        "moved_nm": float(moved.max()) * 1e9,
        "moved_percent": float(moved.max() / np.abs(limit.displacement).max()) * 100,
        "largest_um": float(slip.max()) * 1e6,
        "delta_um": law.delta * 1e6,
    }


CAPTION = (
    "What ε = {epsilon:g} N/m does. On Γc the two pieces of j differ by at most {pieces:.2g} N/m, less than ε/2: the "
    "smoothing acts on every vertex. At zero slip, where the law gives 0, it allows anything within "
    "±{false_kink:.0f} N/m²; at x₁ = {s:.2f} m it makes −σₜ = {there:.0f} N/m², where the law itself (right) gives "
    "{truly:.0f}; at the free end {end:.0f} instead of {end_truly:.0f}. The displacement hardly changes: by "
    "at most {moved_nm:.1g} nm ({moved_percent:.1g} %), friction being at most {share:.1g} % of the pressure. And |u₁| "
    "ends at {largest_um:.1f} µm, below δ = {delta_um:g} µm: the law’s drop is never reached."
)


def caption(numbers: dict[str, float]) -> str:
    """What ε = 0.1 does, in words."""
    return CAPTION.format(**numbers).replace("-", "−")


# ## The pictures
#
# The colours are the paper's: red, green, dark blue and light blue for h = 1/4, 1/8, 1/16 and 1/32. The markers differ
# as well, since not every reader can distinguish red from green, and the curves overlap.

COLOURS = {4: "#E41A1C", 8: "#1B9E4B", 16: "#1F3A93", 32: "#56B4E9"}
STYLES: dict[int, dict[str, Any]] = {
    4: {"marker": "o", "ms": 13, "mfc": "none", "mew": 2, "lw": 1.2, "zorder": 5},
    8: {"marker": "s", "ms": 8, "mfc": "none", "mew": 1.8, "lw": 1.2, "zorder": 4},
    16: {"marker": "D", "ms": 3.5, "lw": 1.2, "zorder": 3},
    32: {"lw": 5, "zorder": 2},
}
COLUMNS = {"paper": "ε = {epsilon:g}, as in the paper", "limit": "ε → 0: the law itself"}
Runs = dict[tuple[str, int], Run]


def draw_curves(path: Path, wall: str, runs: Runs, numbers: dict[str, float]) -> None:
    """Figure 4 or 5: (a) u1 and (b) -σ_t on Γc, smoothed on the left, the law itself on the right."""
    from hvi_fenicsx.report.pictures.style import figure, save

    drawing = figure(8.35)
    drawing.set_layout_engine("none")
    panels = drawing.subplots(2, 2, sharex=True, sharey="row")
    drawing.subplots_adjust(left=0.11, right=0.97, top=0.86, bottom=0.285, hspace=0.26, wspace=0.08)
    for column, (solver, title) in enumerate(COLUMNS.items()):
        panels[0, column].set_title(title.format(**numbers), size=14, weight="bold", loc="left", pad=30)
        curves(panels[:, column], {n: runs[solver, n] for n in CELLS})
    for axes, label in zip(panels[:, 0], ("(a)  u₁ in µm", "(b)  −σₜ in N/m²"), strict=True):
        axes.text(0, 1.035, label, transform=axes.transAxes, size=13)
    panels[0, 1].legend(frameon=False, fontsize=12, loc="best", handlelength=2.4)
    add_texts(drawing, f"Wall {wall}: what happens on Γc (the paper’s Fig. {WALLS[wall]})", caption(numbers))
    save(drawing, path)


def curves(column: Any, runs: dict[int, Run]) -> None:
    """One column of a figure: u1 at the top, -σ_t under it, all meshes."""
    for cells, run in runs.items():
        style = {"color": COLOURS[cells], "label": f"h = 1/{cells}", **STYLES[cells]}
        column[0].plot(run.x, run.u1 * 1e6, **style)
        column[1].plot(run.x, run.friction, **style)
    for axes in column:
        axes.axhline(0.0, color="#6b6b6b", lw=0.8, zorder=1)
        axes.grid(axis="y", color="#e6e6e6", lw=0.8)
    column[1].set_xlabel("x₁ in m")


BODIES = (
    "Dashed: the reference configuration; coloured: the deformed one for ε = {epsilon:g}; arrows: the displacement on "
    "all of Γ. Displacements × {factor}, lengths in cm. White dots: the limit ε → 0. On the finest mesh it differs by "
    "at most {moved_nm:.1g} nm ({moved_percent:.1g} %): what ε = {epsilon:g} does to −σₜ cannot be seen here."
)


def draw_bodies(path: Path, wall: str, runs: Runs, numbers: dict[str, float]) -> None:
    """Figure 3: reference and deformed configuration with the displacement on all of Γ, one panel for each mesh."""
    from hvi_fenicsx.report.pictures.style import figure, save
    from hvi_fenicsx.report.units import round_below, thousands

    factor = round_below(0.1 / max(float(np.abs(run.displacement).max()) for run in runs.values()))
    drawing = figure(8.95)
    drawing.set_layout_engine("none")
    panels = drawing.subplots(2, 2, sharex=True, sharey=True)
    drawing.subplots_adjust(left=0.095, right=0.98, top=0.9, bottom=0.205, hspace=0.16, wspace=0.06)
    for axes, cells in zip(panels.flat, CELLS, strict=True):
        body(axes, runs["paper", cells], runs["limit", cells], factor, COLOURS[cells])
        axes.set_title(f"h = 1/{cells}", loc="left", size=13, color=COLOURS[cells], weight="bold")
    for bottom, left in zip(panels[1], panels[:, 0], strict=True):
        bottom.set_xlabel("x₁ in cm")
        left.set_ylabel("x₂ in cm")
    text = BODIES.format(**numbers, factor=thousands(int(factor)))
    add_texts(drawing, f"Wall {wall}: the deformed square (the paper’s Fig. 3{PARTS[wall]})", text)
    save(drawing, path)


def body(axes: Any, paper: Run, limit: Run, factor: float, colour: str) -> None:
    """One panel, in cm."""
    points, ways, ends = (100 * a for a in (paper.around, factor * paper.displacement, factor * limit.displacement))
    axes.plot(*closed(points), color="#6b6b6b", ls=(0, (5, 4)), lw=1.2)
    axes.plot(*closed(points + ways), color=colour, lw=3.2, zorder=3)
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.0045, "zorder": 4}
    axes.quiver(*points.T, *ways.T, color="#444444", **style)
    axes.plot(*(points + ends).T, "o", mfc="white", mec="none", ms=2.2, zorder=5)
    axes.set_aspect("equal")


def closed(points: Array) -> Array:
    """Points around the boundary, back to the first, as two rows."""
    return np.concatenate([points, points[:1]]).T


def add_texts(drawing: Any, title: str, text: str) -> None:
    """Title at the top and caption at the bottom."""
    height = drawing.get_figheight()
    drawing.text(0.04, 1 - 0.18 / height, title, size=15.5, weight="bold", va="top")
    drawing.text(0.04, 0.2 / height, "\n".join(textwrap.wrap(text, 85)), size=12, va="bottom", linespacing=1.35)


# ## All together
#
# Every rank solves; rank 0 draws. The norm printed last is the same on any number of ranks.


def main() -> None:
    """Compute, draw, and print what ε = 0.1 does."""
    parser = argparse.ArgumentParser(description="Draw the paper's Figures 3, 4 and 5, with the limit beside them.")
    parser.add_argument("--out", type=Path, default=Path("results/paper_figures"), help="a folder for the pictures")
    out = parser.parse_args().out
    for wall, number in WALLS.items():
        found = {(s, n): compute(wall, n, overrides) for s, overrides in SOLVERS.items() for n in CELLS}
        runs = {key: run for key, run in found.items() if run is not None}
        if COMM.rank == 0:
            out.mkdir(parents=True, exist_ok=True)
            numbers = effect(runs["paper", 32], runs["limit", 32], *law_of(wall))
            draw_bodies(out / f"figure_3{PARTS[wall]}.png", wall, runs, numbers)
            draw_curves(out / f"figure_{number}.png", wall, runs, numbers)
            print(f"{out}/figure_3{PARTS[wall]}.png, {out}/figure_{number}.png\n{caption(numbers)}")
            print(f"norm of -σ_t on Γc, h = 1/32: {np.linalg.norm(runs['limit', 32].friction):.9g} N/m²")


if __name__ == "__main__":
    main()
