"""The solver's time in products with the finest matrix, to 1e-8 and to discretisation accuracy.

    ./hvi exec python3 benchmarks/work_units.py [--cells 512]

Discretisation accuracy: the algebraic error is a tenth of the discretisation error, both in the energy norm. The
first is read off energies on the same mesh, the second off those of two meshes (Richardson, first order in h).
"""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
from common import Figures, document, median, parser, picture, repeated, run, square, table

TOLERANCES = ("1e-2", "1e-3", "1e-4", "1e-5", "1e-6", "1e-8")
HEAD = ("scene", "dofs", "tolerance", "algebraic over discretisation error", "work units", "linear (all levels)")


def units(figures: Figures) -> float:
    """Setup and solve on all levels over one product with the finest matrix."""
    return float((figures["setup"] + figures["solve"]) / figures["spmv"])


def main() -> None:
    made = parser(__doc__)
    made.add_argument("--cells", type=int, default=512)
    made.add_argument("--scenes", nargs="*", default=["paper", "strong law"])
    options = made.parse_args()
    rows: list[list[object]] = []
    figure, axes = plt.subplots(figsize=(6, 4))
    for scene in options.scenes:
        exact, finer = (run(scene, "contact", [*square(n), "solver.tolerance=1e-11"], options) for n in sizes(options))
        if exact is None or finer is None:
            raise SystemExit(f"{scene}: a reference solution failed")
        defect = 4 / 3 * (exact["energy"] - finer["energy"])  # ½‖u - u_h‖², a quarter of it on half the mesh size
        found = repeated({t: (scene, "contact", [*square(options.cells), f"solver.tolerance={t}"]) for t in TOLERANCES},
                         options, spmv=True)  # fmt: skip
        for tolerance in TOLERANCES:
            runs = found[tolerance]
            error = math.sqrt(max(runs[0]["energy"] - exact["energy"], 0.0) / defect)
            wanted = f"**{median(runs, units):.0f}**"
            rows.append([scene, runs[0]["dofs"], tolerance, f"{error:.1e}", wanted, runs[0]["linear"]])
        axes.semilogx([float(t) for t in TOLERANCES], [median(found[t], units) for t in TOLERANCES], "o-", label=scene)
    axes.set_xlabel("tolerance")
    axes.set_ylabel("work units (products with the finest matrix)")
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    picture("work_units", figure)
    text = "Discretisation accuracy is the first row of a scene, from above, with at most 0.1 in the fourth column."
    command = f"./hvi exec python3 benchmarks/work_units.py --cells {options.cells}"
    document("work_units", "Work units", command, [text, table(HEAD, rows)], options)


def sizes(options: object) -> tuple[int, int]:
    cells: int = options.cells  # type: ignore[attr-defined]
    return cells, 2 * cells


if __name__ == "__main__":
    main()
