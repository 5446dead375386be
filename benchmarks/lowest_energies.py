"""The lowest energy with a proof, on scenes that were written down before the first run; one line each, and a table.

    ./hvi exec python3 benchmarks/lowest_energies.py [--limit SECONDS] [--limit-large SECONDS]
                                                       [--smallest VERTICES] [--largest VERTICES]

Families in the plane: the model problem with strong laws (drops), four teeth, softening, lift-off, a free block; sizes
4 to 192 cells along the floor; the demo `jureczka_ochal` and the composite of Mäkelä and others at its eight loads; two
glued plates with one law of opening and slip. Families in space: cubes on a floor with laws of |u_t|, a glued anchor
with adhesion and friction, two glued plates. Limits and times are of processor time.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mpi4py import MPI

import hvi_fenicsx as hvi
from hvi_fenicsx import workflow
from hvi_fenicsx.workflow.equilibria import Equilibria

Table = dict[str, Any]
SPACE_SIZES = (2, 3, 4, 5, 6, 7, 9, 11, 13, 15)
GLUE_SIZES = (4, 8, 16, 32, 63, 127)
SIZES = (4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192)
DEMO = Path(__file__).resolve().parent.parent / "demos" / "jureczka_ochal.toml"
COLUMNS = ("scene", "vertices", "proven", "gap", "energy", "boxes", "seconds", "reason")
LARGE = 65
"""More contact vertices than this have the second limit."""


def graph(*points: tuple[float, float]) -> Table:
    return {"law": "graph", "points": [list(p) for p in points]}


DROP = graph((0, 0), (9e-6, 3e6), (9e-6, 1.5e6))
WEAK = graph((0, 0), (9e-6, 1e6), (9e-6, 5e5))
TEETH = graph(
    (0, 0), (4e-6, 2e6), (4e-6, 8e5), (9e-6, 2e6), (9e-6, 8e5), (1.4e-5, 2e6), (1.4e-5, 8e5), (2e-5, 2e6), (2e-5, 5e5)
)
SOFT = graph((0, 0), (2e-6, 3e6), (1.6e-5, 0))
SOFT_WITH_REST = graph((0, 0), (2e-6, 3e6), (1.6e-5, 1e6))
FAMILIES = {
    "drop": (6e6, -1e6, DROP, True),
    "weak": (3e6, -1e6, WEAK, True),
    "teeth": (5e6, -1e6, TEETH, True),
    "softening": (4e6, -1e6, SOFT, True),
    "lift-off": (6e6, "-1e6*(1 - 1.8*x)", DROP, True),
    "block": (1.2e6, -1e6, DROP, False),
}

SPACE_FAMILIES = {
    "space drop": ([6e6, 5e5, 0.0], DROP),
    "space weak": ([3e6, 1e5, 0.0], WEAK),
    "space teeth": ([5e6, 5e5, 0.0], TEETH),
    "space softening": ([4e6, 5e5, 0.0], SOFT_WITH_REST),
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


def cube(cells: int, pull: list[float], friction: Table) -> Table:
    """A steel cube on a floor with a law of |u_t|, at a wall, pulled obliquely at its right side."""
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [cells] * 3},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "pull": {"on": "right", "traction": pull},
            "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": friction},
        },
    }


def anchor(cells: int) -> Table:
    """A soft plate that is glued to its base and pulled off it, beyond what the glue bears at one end."""
    glue = graph((0, 0), (20e-6, 1e6), (20e-6, 7e5))
    return {
        "domain": {"shape": "box", "size": [0.2, 0.2, 0.02], "cells": [cells, cells, 1]},
        "material": {"model": "three_dimensional", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
        "boundary": {
            "pull": {"on": "top", "traction": [1e5, 0.0, "1e6*(x/0.2)"]},
            "base": {
                "on": "bottom",
                "contact": {"gap": 0.0},
                "adhesion": {**glue, "one_sided": True},
                "friction": glue,
            },
        },
    }


def glued(size: list[float], cells: list[int], model: str) -> Table:
    """Two plates, glued with a law of opening and slip together; the upper one is pulled, bent and held at its left."""
    flat = len(size) == 2
    plate = {"shape": "rectangle" if flat else "box", "size": size, "cells": cells}
    pull = [8.0e6, "1.6e7*(x - 0.5)"] if flat else [8.0e6, 5e5, "1.6e7*(x - 0.5)"]
    faces = ("bottom", "top", "left")
    law = graph((0, 0), (2e-5, 1e7), (6e-5, 6e6))
    return {
        "domain": {"lower": plate, "upper": {**plate, "origin": [0.0, 0.5] if flat else [0.0, 0.0, 0.5]}},
        "material": {"model": model, "youngs_modulus": 7.0e10, "poisson_ratio": 0.33},
        "boundary": {
            "grip": {"on": f"lower.{faces[0]}", "displacement": [0.0] * len(size)},
            "pull": {"on": f"upper.{faces[1]}", "traction": pull},
            "hold": {"on": f"upper.{faces[2]}", "displacement": [0.0, *["free"] * (len(size) - 1)]},
        },
        "interface": {
            "glue": {
                "between": ["upper.bottom", "lower.top"],
                "contact": {"gap": 0.0},
                "cohesion": {**law, "beta": 0.7},
            }
        },
    }


def with_lengths(largest: int) -> Iterator[tuple[str, int, Table]]:
    """Name, vertices of Γc and scene, where laws act on lengths."""
    for cells in (n for n in SPACE_SIZES if (n + 1) ** 2 <= largest):
        for name, (pull, friction) in SPACE_FAMILIES.items():
            yield f"{name} {cells}", (cells + 1) ** 2, cube(cells, pull, friction)
        yield f"anchor {cells}", (cells + 1) ** 2, anchor(cells)
        yield f"glued plates {cells}", (cells + 1) ** 2, glued([1.0, 1.0, 0.5], [cells] * 3, "three_dimensional")
    for cells in (n for n in GLUE_SIZES if n < largest):
        yield f"glued {cells}", cells + 1, glued([1.0, 0.5], [cells, max(cells // 2, 1)], "plane_strain")


def scenes(largest: int) -> Iterator[tuple[str, int, hvi.Model]]:
    """Name, vertices of Γc and scene."""
    for cells in (n for n in SIZES if n < largest):
        for name, family in FAMILIES.items():
            yield f"{name} {cells}", cells + 1, hvi.read_tables(square(cells, *family))
    for cells in (n for n in (16, 32, 64) if n < largest):
        yield f"jureczka_ochal {cells}", cells + 1, hvi.read_scene(DEMO, [f"domain.cells=[{cells},{cells // 2}]"])
    for pull in (20, 21, 22, 23, 25, 26, 26.2, 27):
        yield f"composite {pull}", 33, hvi.read_tables(composite(1e6 * pull))
    for name, vertices, table in with_lengths(largest):
        yield name, vertices, hvi.read_tables(table)


def measured(name: str, vertices: int, scene: hvi.Model, limit: float) -> Table:
    """One search."""
    start = time.process_time()
    prepared = workflow.prepare(scene, MPI.COMM_SELF)
    found = Equilibria(prepared).find(
        lowest=True, gap=1e-8, stop=lambda: time.process_time() - start > limit, report=lambda _: None
    )
    energy = found.points[0].energy * prepared.problem.scales.energy if found.points else None
    seconds = round(time.process_time() - start, 2)
    row = (name, vertices, found.proven, found.gap, energy, found.nodes, seconds, found.reason)
    return dict(zip(COLUMNS, row, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for each scene")
    parser.add_argument(
        "--limit-large", type=float, default=600.0, help=f"seconds for those of more than {LARGE} vertices"
    )
    parser.add_argument("--smallest", type=int, default=0, help="contact vertices")
    parser.add_argument("--largest", type=int, default=256, help="contact vertices")
    parser.add_argument("--only", default="", help="only scenes whose name begins like this")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows: list[Table] = []
    for name, vertices, scene in scenes(options.largest):
        if vertices < options.smallest or not name.startswith(options.only):
            continue
        rows.append(measured(name, vertices, scene, options.limit_large if vertices > LARGE else options.limit))
        print(*rows[-1].values(), sep="\t", flush=True)
    if options.out:
        with options.out.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, COLUMNS)
            table.writeheader()
            table.writerows(rows)
    print(f"{sum(r['proven'] for r in rows)} of {len(rows)} proven", file=sys.stderr)


if __name__ == "__main__":
    main()
