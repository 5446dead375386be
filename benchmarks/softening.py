"""What softening costs: `auto` with the load path as a start and without it, beside the same scene on springs.

    ./hvi exec python3 benchmarks/softening.py [--limit 120] [--json FILE] [NAME ...]

Processor time of the solve, from the assembled system to the certificate, in one process; a small run before loads the
libraries. On springs each law is replaced by a linear spring of its first slope. Above a strength there is no answer on
springs to compare with: the answer just below it stands in that column. A solve that takes longer than the limit is
interrupted.
"""

from __future__ import annotations

import argparse
import copy
import json
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from hvi_fenicsx import Scene
from hvi_fenicsx.preparation import DEFAULT, prepare
from hvi_fenicsx.solvers.thresholds import PathThresholds
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.workflow import finish

Table = dict[str, Any]
DEMOS = Path(__file__).parent.parent / "demos"
SOFT_ANCHOR = [[0, 0], [5e-6, 1e6], [100e-6, 0]]
WITHOUT = replace(DEFAULT, solvers=SolverThresholds(path=PathThresholds(quick_steps=1_000_000, vertex_unknowns=-1)))


def demo(name: str, cells: list[int] | None = None) -> Table:
    """A demo, perhaps on another mesh."""
    table = tomllib.loads((DEMOS / f"{name}.toml").read_text())
    table.pop("path", None)
    if cells:
        table["domain"]["cells"] = cells
    return table


def peeling(cells: list[int]) -> Table:
    return demo("peeling", cells)


def bar(cells: list[int], strength: float, **solver: object) -> Table:
    """The glued bar under a part of its strength, 220.6 N/mm."""
    table = demo("glued_bar", cells)
    table["solver"] = solver
    table["boundary"]["pull"]["traction"] = [strength * 2.206e8, 0.0]
    return table


def lap(load: float) -> Table:
    """The single-lap joint under a multiple of its load."""
    table = demo("single_lap")
    table["boundary"]["pull"]["traction"] = [load * 3.0e7, 0.0]
    return table


def anchor(cells: list[int], load: float) -> Table:
    """The anchor whose adhesion softens, and without friction, so that its laws are piecewise linear."""
    table = demo("anchor_3d", cells)
    table["boundary"]["pull"]["traction"][2] = f"{load}*0.6e6*(1 + (x - 0.1)/0.3)"
    table["boundary"]["base"] = {
        "on": "bottom",
        "contact": {"gap": 0.0},
        "adhesion": {"law": "graph", "points": SOFT_ANCHOR, "one_sided": True},
        "friction": {"law": "linear_spring", "stiffness": 1e11},
    }
    return table


def sticking_anchor(cells: list[int], load: float) -> Table:
    """The anchor whose adhesion softens, with friction on the length of the slip."""
    table = anchor(cells, load)
    friction = {"law": "quadratic_linear", "gamma1": 1e6, "gamma2": 5e5, "delta": 2e-5}
    table["boundary"]["base"]["friction"] = friction
    return table


def plate(cells: list[int], lift: float) -> Table:
    """A plate in space, peeled from its base by lifting one side."""
    glue = {"law": "graph", "points": [[0, 0], [4e-6, 5e6], [20e-6, 0]], "one_sided": True}
    return {
        "domain": {"shape": "box", "size": [0.1, 0.04, 0.008], "cells": cells},
        "material": {"model": "three_dimensional", "youngs_modulus": 7.0e10, "poisson_ratio": 0.3},
        "boundary": {
            "lifted": {"on": "left", "displacement": ["free", "free", lift]},
            "far": {"on": "right", "displacement": [0.0, 0.0, 0.0]},
            "glue": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": glue},
        },
    }


SMOOTHED = {"smoothing": "quadratic", "epsilon": 0.01}
CASES: dict[str, tuple[Table, Table]] = {
    # the scene; what stands in the column of springs
    "peeling, 30,050": (peeling([600, 24]), peeling([600, 24])),
    "peeling, 465,794": (peeling([2400, 96]), peeling([2400, 96])),
    "glued bar, 0.98 of its strength": (bar([380, 2], 0.98), bar([380, 2], 0.98)),
    "single lap, load x 3": (lap(3.0), lap(3.0)),
    "plate in space": (plate([24, 10, 3], 1e-4), plate([24, 10, 3], 1e-4)),
    "anchor in space, load x 1.3": (anchor([16, 16, 8], 1.3), anchor([16, 16, 8], 1.3)),
    "anchor with friction in space, load x 1.3": (sticking_anchor([8, 8, 4], 1.3), anchor([8, 8, 4], 1.3)),
    "no: glued bar, 1.05 of its strength": (bar([380, 2], 1.05), bar([380, 2], 0.98)),
    "no: single lap, load x 8": (lap(8.0), lap(3.0)),
    "no: smoothed glued bar, 1.05 of its strength": (bar([190, 2], 1.05, **SMOOTHED), bar([190, 2], 0.98)),
    "no: anchor with friction in space, load x 1.42": (sticking_anchor([8, 8, 4], 1.42), anchor([8, 8, 4], 1.3)),
}


def on_springs(table: Table) -> Table:
    """The scene with springs in the place of softening laws."""
    found = copy.deepcopy(table)
    places = [*found["boundary"].values(), *found.get("interface", {}).values()]
    for place in places:
        for effect in ("friction", "adhesion"):
            if place.get(effect, {}).get("law") == "graph":
                at, traction = place[effect]["points"][1]
                place[effect] = {"law": "linear_spring", "stiffness": traction / at}
    return found


def timed(table: Table, thresholds: Any, limit: float) -> Table:
    """Seconds, Newton steps and the answer."""
    prepared = prepare(Scene.model_validate(table), thresholds=thresholds)
    start = time.process_time()
    solution = finish(prepared, lambda step: None, lambda: time.process_time() - start > limit, estimating=False)
    seconds = time.process_time() - start
    found = solution.solve_result
    return {
        "seconds": seconds,
        "dofs": solution.dofs,
        "newton": found.counts.newton,
        "levels": found.levels,
        "answer": "certified" if solution.converged else f"over {limit:g} s" if found.interrupted else found.reason,
        "energy": solution.examination.energy,
    }


def measure(name: str, limit: float) -> Table:
    """One case, in the three ways."""
    scene, beside = CASES[name]
    springs = beside if name.startswith("no:") else on_springs(beside)
    tables = {"springs": (springs, DEFAULT), "path": (scene, DEFAULT), "without": (scene, WITHOUT)}
    return {"name": name} | {key: timed(table, chosen, limit) for key, (table, chosen) in tables.items()}


def row(found: Table) -> str:
    """A row of the table."""
    base, path, before = (found[key] for key in ("springs", "path", "without"))
    ratios = [f"{one['seconds'] / base['seconds']:.1f}" for one in (path, before)]
    same = abs(path["energy"] - before["energy"]) <= 1e-6 * abs(before["energy"])
    answers = (
        path["answer"] if path["answer"] == before["answer"] and same else f"{path['answer']} / {before['answer']}"
    )
    cells = [found["name"], path["dofs"], f"{base['seconds']:.2f}", base["newton"], ratios[0], path["newton"]]
    return "| " + " | ".join(map(str, [*cells, ratios[1], before["newton"], answers])) + " |"


def main() -> None:
    """Measure all cases, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of names")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of processor time for one solve")
    parser.add_argument("--json", type=Path)
    words = parser.parse_args()
    wanted = [name for name in CASES if not words.names or any(word in name for word in words.names)]
    timed(peeling([30, 2]), DEFAULT, words.limit)
    timed(plate([8, 4, 2], 1e-5), DEFAULT, words.limit)
    print("| | unknowns | springs, s | Newton | path / springs | Newton | without / springs | Newton | answer |")
    print("|" + "---|" * 9)
    results = []
    for name in wanted:
        results.append(measure(name, words.limit))
        print(row(results[-1]), flush=True)
    if words.json:
        words.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
