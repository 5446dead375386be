"""The solver's time in products with the finest matrix, to 1e-8 and to discretisation accuracy.

    ./hvi exec python3 benchmarks/work_units.py [--cells 512]

Discretisation accuracy: the algebraic error is a tenth of the discretisation error, both in the energy norm, as the
program estimates them: the first is the dual norm of what the solver left, the second is that of docs/estimator.md.
(Energies of nearly solved systems differ by less than their rounding.)
"""

from __future__ import annotations

import matplotlib.pyplot as plt
from common import Figures, document, median, parser, picture, repeated, square, table

TOLERANCES = ("1e-1", "5e-2", "3e-2", "1e-2", "1e-3", "1e-4", "1e-5", "1e-6", "1e-8")
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
        found = repeated({t: (scene, "contact", [*square(options.cells), f"solver.tolerance={t}"]) for t in TOLERANCES},
                         options, spmv=True)  # fmt: skip
        for tolerance in TOLERANCES:
            runs = found[tolerance]
            wanted, left = f"**{median(runs, units):.0f}**", f"{runs[0]['unsolved']:.1e}"
            rows.append([scene, runs[0]["dofs"], tolerance, left, wanted, runs[0]["linear"]])
        axes.semilogx([float(t) for t in TOLERANCES], [median(found[t], units) for t in TOLERANCES], "o-", label=scene)
    axes.set_xlabel("tolerance")
    axes.set_ylabel("work units (products with the finest matrix)")
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    picture("work_units", figure)
    text = (
        "A work unit is the time of one product with the finest matrix. The first row of a scene, from above, with "
        "at most 0.1 in the fourth column has discretisation accuracy: the algebraic error is a tenth of the "
        "discretisation error."
    )
    document("work_units", "Work units", [text, table(HEAD, rows)], options)


if __name__ == "__main__":
    main()
