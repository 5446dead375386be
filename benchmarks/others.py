"""The paper's procedure and PETSc's own methods beside ``auto``, on growing meshes, up to where each gives up.

    ./hvi exec python3 benchmarks/others.py [--cells 16 32 64 128 256 512] [--limit 120]

``condensed`` is the paper's procedure, ``plain`` PETSc's ``vinewtonrsls`` as it is usually written, ``ssls`` its
``vinewtonssls``, ``tao`` its bounded Newton. A method that failed, or took longer than the limit, is not asked again.
``ssls`` and ``tao`` differentiate the law, so they refuse the paper's smoothing, which keeps a kink at zero slip.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
from common import document, parser, picture, run, say, square, table, work

METHODS = ("auto", "condensed", "plain", "ssls", "tao")
SMOOTHED = ['solver={smoothing="quadratic", epsilon=0.1}']


def main() -> None:
    made = parser(__doc__)
    made.set_defaults(limit=120.0)
    made.add_argument("--cells", type=int, nargs="*", default=[16, 32, 64, 128, 256, 512])
    options = made.parse_args()
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
    parts = [
        f"The table has the seconds of assembly, setup and solve: one run each, stopped after {options.limit:.0f} s. A "
        "method that failed is not run on larger meshes. `ssls` and `tao` refuse the paper's smoothing, which keeps "
        "a kink at zero slip."
    ]
    for ax, (scene, smoothing) in zip(axes, (("paper", []), ("strong law", SMOOTHED)), strict=True):
        times: dict[str, dict[int, float]] = {m: {} for m in METHODS}
        cells = {(n, m): cell(scene, smoothing, n, m, times, options) for n in options.cells for m in METHODS}
        rows = [[f"{n} x {n}", *(cells[n, m] for m in METHODS)] for n in options.cells]
        parts.append(table((scene, *METHODS), rows))
        for number, method in enumerate(METHODS):
            if times[method]:
                ax.loglog(list(times[method]), list(times[method].values()), "o-", color=f"C{number}", label=method)
        ax.legend(frameon=False)
        ax.set_title(scene)
        ax.set_xlabel("cells a side")
        ax.set_xticks(options.cells, [str(n) for n in options.cells])
        ax.minorticks_off()
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("assembly, setup and solve / s")
    picture("others", figure)
    document("others", "Beside the paper's procedure and PETSc's methods", parts, options)


def cell(
    scene: str, smoothing: list[str], n: int, method: str, times: dict[str, dict[int, float]], options: object
) -> str:
    """One run as a table cell; certified times are entered."""
    if any(m not in times[method] for m in options.cells if m < n):  # type: ignore[attr-defined]
        return ""
    chosen = [] if method == "plain" else [f'solver.method="{method}"']
    overrides = [*smoothing, *square(n), *chosen]
    figures = run(scene, "plain" if method == "plain" else "contact", overrides, options)  # type: ignore[arg-type]
    say(f"{scene} {n} {method}: {figures and round(work(figures), 2)}")
    if figures is None:
        return "failed, or over the limit"
    if not figures["certified"]:
        return f"{work(figures):.2f}, not a solution"
    times[method][n] = work(figures)
    return f"{work(figures):.2f}"


if __name__ == "__main__":
    main()
