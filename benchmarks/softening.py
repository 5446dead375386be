"""What softening costs: `auto` beside the same scene on springs, with the load path as a start or also without it.

    ./hvi exec python3 benchmarks/softening.py [--limit 120] [--without] [--json FILE] [NAME ...]

Processor time of the solve, from the assembled system to the certificate, in one process; a small run before loads the
libraries. On springs each law is replaced by a linear spring of its first slope. Above a strength there is no answer on
springs to compare with: the answer just below it stands in that column. A solve that takes longer than the limit is
interrupted. Newton steps are those of all levels, and of the finest one.
"""

from __future__ import annotations

import argparse
import copy
import json
import logging
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

from typing_extensions import override

from hvi_fenicsx import Scene
from hvi_fenicsx.runtime.log import NewtonStep
from hvi_fenicsx.solvers.thresholds import PathThresholds
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.workflow import DEFAULT, finish, prepare

Table = dict[str, Any]
DEMOS = Path(__file__).parent.parent / "demos"
SOFT_ANCHOR = [[0, 0], [5e-6, 1e6], [100e-6, 0]]
SOFT_FLOOR = [[0, 0], [2e-6, 1e6], [1.6e-5, 3e5]]
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


def lap(load: float, lower: list[int], upper: list[int]) -> Table:
    """The single-lap joint under a multiple of its load."""
    table = demo("single_lap")
    table["domain"]["lower"]["cells"], table["domain"]["upper"]["cells"] = lower, upper
    table["boundary"]["pull"]["traction"] = [load * 3.0e7, 0.0]
    return table


def block(cells: list[int], load: float) -> Table:
    """The pushed block on a floor whose friction falls, under a multiple of its push."""
    table = demo("pushed_block", cells)
    table["boundary"]["floor"]["friction"] = {"law": "graph", "points": SOFT_FLOOR}
    table["boundary"]["push"]["traction"] = [load * 6.0e5, 0.0]
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
SMALL_LAP = ([100, 4], [128, 4])
CASES: dict[str, tuple[Table, Table]] = {
    # the scene; what stands in the column of springs
    name: (table, table)
    for name, table in {
        "peeling, 30,000": peeling([600, 24]),
        "peeling, 470,000": peeling([2400, 96]),
        "glued bar, 0.98 of its strength, 30,000": bar([1520, 8], 0.98),
        "glued bar, 0.98 of its strength, 470,000": bar([6080, 32], 0.98),
        "single lap, load x 4, 30,000": lap(4.0, [400, 16], [512, 16]),
        "single lap, load x 4, 470,000": lap(4.0, [1600, 64], [2048, 64]),
        "pushed block, load x 1.35, 30,000": block([128, 128], 1.35),
        "pushed block, load x 1.35, 470,000": block([480, 480], 1.35),
        "plate in space, 30,000": plate([48, 20, 8], 1e-4),
        "plate in space, 470,000": plate([120, 48, 24], 1e-4),
        "anchor in space, load x 1.3, 30,000": anchor([24, 24, 12], 1.3),
        "anchor in space, load x 1.3, 470,000": anchor([64, 64, 32], 1.3),
    }.items()
} | {
    "anchor with friction in space, load x 1.3": (sticking_anchor([8, 8, 4], 1.3), anchor([8, 8, 4], 1.3)),
    "no: glued bar, 1.05 of its strength": (bar([380, 2], 1.05), bar([380, 2], 0.98)),
    "no: single lap, load x 8": (lap(8.0, *SMALL_LAP), lap(3.0, *SMALL_LAP)),
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


class FinestSteps(logging.Handler):
    """Counts the Newton steps of the level that is solved; the finest one is the last."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.count = 0

    @override
    def emit(self, record: logging.LogRecord) -> None:
        if str(record.msg).startswith("level of"):
            self.count = 0

    def step(self, step: NewtonStep) -> None:
        """One more, but for the start of a solve."""
        self.count += step.iteration > 0


def timed(table: Table, thresholds: Any, limit: float) -> Table:
    """Seconds, Newton steps and the answer."""
    prepared, finest = prepare(Scene.model_validate(table), thresholds=thresholds), FinestSteps()
    log = logging.getLogger("hvi_fenicsx")
    log.addHandler(finest)
    start = time.process_time()
    solution = finish(prepared, finest.step, lambda: time.process_time() - start > limit, estimating=False)
    seconds = time.process_time() - start
    log.removeHandler(finest)
    found = solution.solve_result
    return {
        "seconds": seconds,
        "dofs": solution.dofs,
        "newton": f"{found.counts.newton}, {finest.count}",
        "levels": found.levels,
        "answer": "certified" if solution.converged else f"over {limit:g} s" if found.interrupted else found.reason,
        "energy": solution.examination.energy,
    }


def measure(name: str, limit: float, *, without: bool) -> Table:
    """One case, in the two or three ways."""
    scene, beside = CASES[name]
    springs = beside if name.startswith("no:") else on_springs(beside)
    tables = {"springs": (springs, DEFAULT), "path": (scene, DEFAULT)}
    if without:
        tables["without"] = (scene, WITHOUT)
    return {"name": name} | {key: timed(table, chosen, limit) for key, (table, chosen) in tables.items()}


def row(found: Table) -> str:
    """A row of the table."""
    base, path = found["springs"], found["path"]
    cells = [found["name"], path["dofs"], path["levels"], f"{base['seconds']:.2f}", base["newton"]]
    for one in (found[key] for key in ("path", "without") if key in found):
        cells += [f"{one['seconds'] / base['seconds']:.1f}", one["newton"], one["answer"]]
    return "| " + " | ".join(map(str, cells)) + " |"


def main() -> None:
    """Measure all cases, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of names")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of processor time for one solve")
    parser.add_argument("--without", action="store_true", help="also without the load path as a start")
    parser.add_argument("--json", type=Path)
    words = parser.parse_args()
    wanted = [name for name in CASES if not words.names or any(word in name for word in words.names)]
    logging.getLogger("hvi_fenicsx").setLevel(logging.INFO)
    timed(peeling([30, 2]), DEFAULT, words.limit)
    timed(plate([8, 4, 2], 1e-5), DEFAULT, words.limit)
    ways = ["over springs", *(["without the path"] if words.without else [])]
    head = ["", "unknowns", "levels", "springs, s", "Newton"]
    head += [title for way in ways for title in (way, "Newton", "answer")]
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    results = []
    for name in wanted:
        results.append(measure(name, words.limit, without=words.without))
        print(row(results[-1]), flush=True)
    if words.json:
        words.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
