"""What it takes to find all equilibria, with a proof: cells and processor time.

    ./hvi exec python3 benchmarks/all_equilibria.py [--only FAMILY ...] [--largest 16] [--limit 120]

`support` is demos/jureczka_ochal.toml, `floor` demos/strong_law.toml with P = 6e6 N/m² and other laws: bodies with n
cells along Γc. What is timed is the search alone, without mesh, certificates and files.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from typing import Any

import common

from hvi_fenicsx import Model, read_scene, read_tables
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.workflow import prepare

MODEL = {"law": "quadratic_linear", "gamma1": 3e6, "gamma2": 1.5e6, "delta": 9e-6}
TEETH = {"law": "graph", "points": [[0, 0], *([d, t] for d in (4e-6, 9e-6, 1.4e-5, 2e-5) for t in (2e6, 8e5))]}
SMOOTHED = {"smoothing": "quadratic", "epsilon": 0.05}
FAMILIES: dict[str, tuple[dict[str, Any] | None, dict[str, Any]]] = {
    "floor": (MODEL, {}),
    "floor, teeth": (TEETH, {}),
    "floor, smoothed": (MODEL, SMOOTHED),
    "support": (None, {}),
    "support, smoothed": (None, SMOOTHED),
}
"""The law of a floor, or None for the support; and how it is smoothed."""


def scene_of(family: str, cells: int) -> Model:
    """The scene of a family."""
    law, solver = FAMILIES[family]
    demo, size = ("jureczka_ochal.toml", [cells, cells // 2]) if law is None else ("strong_law.toml", [cells, cells])
    table = read_scene(common.DEMOS / demo, [f"domain.cells={size}"]).tables()
    if law is not None:
        table["boundary"]["pull"]["traction"] = [6e6, 0.0]
        table["boundary"]["floor"]["friction"] = law
    table["solver"] |= solver
    return read_tables(table)


def searched(scene: Model, limit: float) -> tuple[Enumeration, bool, float]:
    """The search, whether it came to its end with all cells decided, and its processor time, s."""
    problem = Condensation(prepare(scene).system).problem
    began = time.process_time()
    search = Enumeration(problem=scalar_problem(problem))
    search.start()
    ended = search.run(lambda: time.process_time() - began > limit, lambda _: None)
    return search, ended, time.process_time() - began


def main() -> None:
    """A table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--largest", type=int, default=16)
    parser.add_argument("--limit", type=float, default=120.0)
    options = parser.parse_args()
    rows = []
    for family in options.only:
        for cells in (n for n in (2, 4, 8, 16, 32) if n <= options.largest):
            search, all_known, seconds = searched(scene_of(family, cells), options.limit)
            kinds = Counter(str(p.kind) for p in search.points)
            found = f"{len(search.points)} ({kinds['minimiser']} minimisers)"
            ended = "all" if all_known else f"{len(search.waiting)} cells open"
            rows.append(
                [family, str(cells), str(search.problem.size), found, ended, str(search.cells), f"{seconds:.2g}"]
            )
            print("\t".join(rows[-1]), flush=True)
    print(common.table(["family", "cells along Γc", "unknowns", "found", "these are", "cells searched", "s"], rows))


if __name__ == "__main__":
    main()
