"""The lowest energy with a proof, on scenes that were written down before the first run; one line each, and a table.

    ./hvi exec python3 benchmarks/lowest_energies.py [--limit SECONDS] [--largest CELLS] [--out FILE.csv]

Families: the model problem with strong laws (drops), four teeth, softening, lift-off, a free block; sizes 4 to 192
cells along the floor; the demo `jureczka_ochal` and the composite of Mäkelä and others at its eight loads.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import hvi_fenicsx as hvi

Table = dict[str, Any]
SIZES = (4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192)
DEMO = Path(__file__).resolve().parent.parent / "demos" / "jureczka_ochal.toml"
COLUMNS = ("scene", "vertices", "proven", "gap", "energy", "boxes", "seconds", "reason")


def graph(*points: tuple[float, float]) -> Table:
    return {"law": "graph", "points": [list(p) for p in points]}


DROP = graph((0, 0), (9e-6, 3e6), (9e-6, 1.5e6))
WEAK = graph((0, 0), (9e-6, 1e6), (9e-6, 5e5))
TEETH = graph(
    (0, 0), (4e-6, 2e6), (4e-6, 8e5), (9e-6, 2e6), (9e-6, 8e5), (1.4e-5, 2e6), (1.4e-5, 8e5), (2e-5, 2e6), (2e-5, 5e5)
)
SOFT = graph((0, 0), (2e-6, 3e6), (1.6e-5, 0))
FAMILIES = {
    "drop": (6e6, -1e6, DROP, True),
    "weak": (3e6, -1e6, WEAK, True),
    "teeth": (5e6, -1e6, TEETH, True),
    "softening": (4e6, -1e6, SOFT, True),
    "lift-off": (6e6, "-1e6*(1 - 1.8*x)", DROP, True),
    "block": (1.2e6, -1e6, DROP, False),
}


def square(cells: int, pull: float, press: float | str, friction: Table, wall: bool) -> Table:
    """A steel square on a floor with a law, pulled at its right side."""
    boundary: Table = {
        "pull": {"on": "right", "traction": [pull, 0.0]},
        "press": {"on": "top", "traction": [0.0, press]},
        "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": friction},
    }
    if wall:
        boundary["wall"] = {"on": "left", "displacement": [0.0, "free"]}
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
        "boundary": boundary,
    }


def composite(pull: float) -> Table:
    """The layer of Mäkelä, Miettinen, Lukšan and Vlček: clamped at the left, glued below, pulled at the top."""
    law = graph((0, 0), (5e-4, 3e7), (5e-4, 2e7), (1e-3, 3e7), (1e-3, 1.5e7), (2e-3, 2.5e7), (2e-3, 0))
    return {
        "domain": {"shape": "rectangle", "size": [0.08, 0.01], "cells": [32, 4]},
        "material": {"model": "plane_strain", "youngs_modulus": 1.378e11, "poisson_ratio": 0.3},
        "boundary": {
            "clamp": {"on": "left", "displacement": [0.0, 0.0]},
            "top": {"on": "top", "traction": [0.0, pull]},
            "glue": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": {**law, "one_sided": True}},
        },
    }


def scenes(largest: int) -> Iterator[tuple[str, int, hvi.Scene]]:
    """Name, vertices of Γc and scene."""
    for cells in (n for n in SIZES if n <= largest):
        for name, family in FAMILIES.items():
            yield f"{name} {cells}", cells + 1, hvi.Scene.model_validate(square(cells, *family))
    for cells in (n for n in (16, 32, 64) if n <= largest):
        yield f"jureczka_ochal {cells}", cells + 1, hvi.read_scene(DEMO, [f"domain.cells=[{cells},{cells // 2}]"])
    for pull in (20, 21, 22, 23, 25, 26, 26.2, 27):
        yield f"composite {pull}", 33, hvi.Scene.model_validate(composite(1e6 * pull))


def measured(name: str, vertices: int, scene: hvi.Scene, limit: float) -> Table:
    """One search."""
    start = time.perf_counter()
    found = hvi.equilibria(scene, lowest=True, limit=limit)
    energy = found.solutions[0].energy if found.solutions else None
    seconds = round(time.perf_counter() - start, 2)
    row = (name, vertices, found.proven, found.gap, energy, found.nodes, seconds, found.reason)
    return dict(zip(COLUMNS, row, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for each scene")
    parser.add_argument("--largest", type=int, default=192, help="cells along the floor")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows: list[Table] = []
    for name, vertices, scene in scenes(options.largest):
        rows.append(measured(name, vertices, scene, options.limit))
        print(*rows[-1].values(), sep="\t", flush=True)
    if options.out:
        with options.out.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, COLUMNS)
            table.writeheader()
            table.writerows(rows)
    print(f"{sum(r['proven'] for r in rows)} of {len(rows)} proven", file=sys.stderr)


if __name__ == "__main__":
    main()
