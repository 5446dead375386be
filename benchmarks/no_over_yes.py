"""What a "no" costs over a "yes": `hvi run` above a scene's strength and below it, from the shell to the answer.

    ./hvi exec python3 benchmarks/no_over_yes.py [--write] [--only WORDS] [--limit 120]

Processor time of the whole command, its start and files included, without pictures and report. Loads of a scene are
multiplied by two factors; the answers must be exit code 0, and 3 or 4. ``--write`` puts the table into
docs/benchmarks/no-over-yes.md.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import common

PAGE = common.ROOT / "docs" / "benchmarks" / "no-over-yes.md"
HEAD = ("scene", "unknowns", "yes: load", "s", "no: load", "s", "no / yes", "borne", "answer above the strength")
SOFT_FLOOR = 'boundary.floor.friction={law="graph", points=[[0,0],[2e-6,1e6],[1.6e-5,3e5]]}'
TEETH = 'boundary.floor.friction={law="graph", points=[[0,0],[4e-6,1e6],[4e-6,6e5],[9e-6,1e6],[9e-6,6e5]]}'
SOFT_BASE = "boundary.base.adhesion.points=[[0,0],[5e-6,1e6],[100e-6,0]]"
SPRING = 'boundary.base.friction={law="linear_spring", stiffness=1e11}'
WEAKENING = 'boundary.glue.friction={law="exponential", peak_traction=7.2e6, residual_traction=0.0, delta=6e-5}'
BAR = "boundary.pull.traction=[{:g}, 0.0]"
PUSH = "boundary.push.traction=[{:g}, 0.0]"
LIFT = 'boundary.pull.traction=[0.0, 0.0, "{:g}*(1 + (x - 0.1)/0.3)"]'


@dataclass(frozen=True, kw_only=True)
class Case:
    """A scene and two factors of a load.

    Attributes:
        demo: its name.
        changes: of the demo.
        load: a change, with a place for the load's size.
        size: of the load at the factor 1.
        below: a factor at which there is an equilibrium.
        above: one at which there is none.
    """

    demo: str
    changes: tuple[str, ...] = ()
    load: str
    size: float
    below: float
    above: float


CASES = {
    "glued bar": Case(
        demo="glued_bar", changes=("domain.cells=[380,2]",), load=BAR, size=2.206e8, below=0.98, above=1.05
    ),
    "glued bar, smoothed": Case(
        demo="glued_bar",
        changes=("domain.cells=[190,2]", 'solver.smoothing="quadratic"', "solver.epsilon=0.01"),
        load=BAR,
        size=2.206e8,
        below=0.98,
        above=1.05,
    ),
    "glued bar, exponential": Case(
        demo="glued_bar", changes=("domain.cells=[190,2]", WEAKENING), load=BAR, size=1.91038e8, below=0.95, above=1.05
    ),
    "pushed block": Case(
        demo="pushed_block", changes=("domain.cells=[32,32]",), load=PUSH, size=6e5, below=1.2, above=1.5
    ),
    "pushed block, softening": Case(
        demo="pushed_block", changes=("domain.cells=[32,32]", SOFT_FLOOR), load=PUSH, size=6e5, below=1.2, above=1.62
    ),
    "pushed block, teeth": Case(
        demo="pushed_block", changes=("domain.cells=[32,32]", TEETH), load=PUSH, size=6e5, below=1.3, above=1.5
    ),
    "single lap, two bodies": Case(demo="single_lap", load=BAR, size=3e7, below=3.0, above=8.0),
    "scarf joint, two bodies, cohesion": Case(demo="scarf_joint", load=BAR, size=4e7, below=1.0, above=1.3),
    "block on a wall, space": Case(
        demo="block_3d",
        changes=("boundary.wall.friction.delta=1e-7",),
        load="body.force=[0.0, 1e4, {:g}]",
        size=-2.5e4,
        below=0.8,
        above=1.44,
    ),
    "anchor, space": Case(
        demo="anchor_3d",
        changes=("domain.cells=[12,12,6]", SOFT_BASE, SPRING),
        load=LIFT,
        size=6e5,
        below=1.3,
        above=1.5,
    ),
    "anchor, friction on a length, space": Case(
        demo="anchor_3d", changes=("domain.cells=[8,8,4]", SOFT_BASE), load=LIFT, size=6e5, below=1.3, above=1.5
    ),
}


def answered(case: Case, factor: float, limit: float, folder: Path) -> dict[str, Any]:
    """Processor seconds of the command, and its summary; no summary where it took longer than the limit."""
    changes = (*case.changes, case.load.format(factor * case.size))
    words = [word for change in changes for word in ("--set", change)]
    command = [sys.executable, "-m", "hvi_fenicsx", "run", str(common.DEMOS / f"{case.demo}.toml"), *words]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(
        [*command, "--no-pictures", "--no-report", "--force", "--out", str(folder)],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit))),
    )
    process.communicate()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    known = process.returncode in (0, 3, 4)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8")) if known else {}
    return {"seconds": seconds, "code": process.returncode, "summary": summary}


def row(name: str, limit: float) -> tuple[Any, ...]:
    """The row of one scene."""
    case = CASES[name]
    with tempfile.TemporaryDirectory() as folder:
        yes, no = (answered(case, factor, limit, Path(folder) / "result") for factor in (case.below, case.above))
    assert yes["code"] == 0, f"{name}: exit code {yes['code']} below the strength"
    ratio, last = no["seconds"] / yes["seconds"], no["summary"].get("last_borne")
    borne = "" if last is None else f"{last['factor'] * case.above:.5g}"
    reason = no["summary"].get("reason", f"none in {limit:g} s")
    figures = (case.below, f"{yes['seconds']:.1f}", case.above, f"{no['seconds']:.1f}", f"{ratio:.1f}", borne)
    short = reason.split(" (")[0].split("; ")[0]
    return (name, yes["summary"]["dofs"], *figures, f"{no['code']}: {short}")


def main() -> None:
    """Measure all scenes, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="scenes whose names contain this")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of processor time for one command")
    parser.add_argument("--write", action="store_true", help="the table into docs/benchmarks/no-over-yes.md")
    options = parser.parse_args()
    rows = []
    for name in (name for name in CASES if options.only in name):
        rows.append(row(name, options.limit))
        print(*rows[-1], sep="\t", flush=True)
    if options.write:
        common.insert(PAGE, "no over yes", common.table(HEAD, rows))


if __name__ == "__main__":
    main()
