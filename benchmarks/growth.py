"""How time and memory grow with the mesh, as fitted exponents, and the iterations on each.

./hvi exec python3 benchmarks/growth.py [--cells 128 256 512 1024 1448]
"""

from __future__ import annotations

import matplotlib.pyplot as plt
from common import (
    Figures,
    certified,
    document,
    exponent,
    median,
    parser,
    picture,
    repeated,
    spread,
    square,
    table,
    work,
)

HEAD = ("scene", "dofs", "time / s", "memory / MB", "levels", "branch", "Newton", "linear (all levels)", "certified")


def main() -> None:
    made = parser(__doc__)
    made.add_argument("--cells", type=int, nargs="*", default=[128, 256, 512, 1024], help="a side; 1408 is 4M dofs")
    made.add_argument("--scenes", nargs="*", default=["paper", "strong law"])
    options = made.parse_args()
    rows: list[list[object]] = []
    fits: list[list[object]] = []
    figure, axes = plt.subplots(1, 2, figsize=(9, 4))
    for scene in options.scenes:
        runs = [repeated({str(n): (scene, "contact", square(n))}, options)[str(n)] for n in options.cells]
        runs = [r for r in runs if r]
        rows += [row(scene, r) for r in runs]
        dofs = [r[0]["dofs"] for r in runs]
        times, memory = ([median(r, m) for r in runs] for m in (work, lambda r: r["net_mb"]))
        fits.append([scene, f"**{exponent(dofs, times):.3f}**", f"**{exponent(dofs, memory):.3f}**"])
        for ax, values in zip(axes, (times, memory), strict=True):
            ax.loglog(dofs, values, "o-", label=f"{scene}: exponent {exponent(dofs, values):.2f}")
    for ax, label in zip(axes, ("assembly, setup and solve / s", "memory above that of the program / MB"), strict=True):
        ax.set_xlabel("unknowns")
        ax.set_ylabel(label)
        ax.legend(frameon=False)
        ax.grid(alpha=0.3)
    picture("growth", figure)
    text = (
        "Memory is the peak memory minus what the program takes before the mesh. Each size runs in a process of "
        "its own."
    )
    fitted = table(("scene", "exponent of time", "exponent of memory"), fits)
    document("growth", "Growth with the mesh", [text, fitted, table(HEAD, rows)], options)


def row(scene: str, runs: list[Figures]) -> list[object]:
    first = runs[0]
    numbers = [first[k] for k in ("levels", "branch", "newton", "linear")]
    memory = f"{median(runs, lambda r: r['net_mb']):.0f} ({median(runs, lambda r: r['peak_mb']):.0f} in all)"
    return [scene, first["dofs"], spread(runs), memory, *numbers, certified(runs)]


if __name__ == "__main__":
    main()
