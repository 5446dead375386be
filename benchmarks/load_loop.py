"""A loop over loads on one body: time of a load over the solver's own, memory, and the same loads by `hvi run`.

    ./hvi exec python3 benchmarks/load_loop.py [--cells 128] [--loads 100] [--runs 5]

The pull of the strong law grows from 1 to 4 MN/m² within one process. Each load is solved twice in turn: from the
coarse meshes, and from the last solution. The solver's own time is that of setup and solve on all levels. Some of the
loads are then solved by `hvi run` in processes of their own. All times are CPU time, which other programs change
little. The table goes into docs/python.md.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import DEMOS, ROOT, insert, machine, parser, say, table

import hvi_fenicsx as hvi
from hvi_fenicsx.runtime.timing import Timer

PULLS = (1e6, 4e6)  # N/m²
OWN = ("setup", "solve")
PAGE = 4096  # bytes


def memory() -> float:
    """Resident memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * PAGE / 2**20


def of_children() -> float:
    """CPU time of all processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def block(cells: int) -> hvi.Model:
    law = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=9e-6)
    effects = [
        hvi.Isotropic(youngs_modulus=2.15e11, poisson_ratio=0.29),
        hvi.Displacement("left", [0.0, None]),
        hvi.Traction("right", [PULLS[0], 0.0]),
        hvi.Traction("top", [0.0, -1e6]),
        hvi.Contact("bottom"),
        hvi.Friction("bottom", law),
    ]
    return hvi.Model(hvi.Body.rectangle([1.0, 1.0], [cells, cells]), effects)


def timed(model: hvi.Model, start: hvi.Solution | None) -> tuple[hvi.Solution, float, float]:
    """The solution, the CPU seconds of the whole call, and those of the solver alone."""
    began = time.process_time()
    found = hvi.solve(model, start=start, estimate=False, timer=Timer(time.process_time))
    assert found.converged, found.reason
    spent = time.process_time() - began
    return found, spent, sum(found.timer.seconds[phase] for phase in OWN)


def loop(cells: int, pulls: Any) -> dict[str, Any]:
    """Figures of the loop, by name."""
    model, last = block(cells), None
    hvi.solve(model, estimate=False)  # compiles, and makes the coarse meshes
    rows, sizes = [], {}
    for number, pull in enumerate(pulls, 1):
        loaded = model.replace(hvi.Traction("right", [pull, 0.0]))
        _, spent, own = timed(loaded, None)
        last, begun, begun_own = timed(loaded, last)
        rows.append((spent, own, begun, begun_own))
        if number in (10, len(pulls)):
            sizes[number] = memory()
            say(f"{number} loads: {sizes[number]:.0f} MB")
    return {"rows": np.array(rows), "memory": sizes}


def by_command(cells: int, pulls: Any) -> list[float]:
    """CPU seconds of each load by ``hvi run``, without pictures; the first one, which fills the caches, is left out."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number, pull in enumerate([pulls[0], *pulls]):
            changes = [f"domain.cells=[{cells}, {cells}]", f"boundary.pull.traction=[{pull}, 0.0]"]
            words = [word for change in changes for word in ("--set", change)]
            scene = ["run", str(DEMOS / "strong_law.toml"), "--out", f"{folder}/{number}", "--no-pictures", *words]
            began = of_children()
            subprocess.run([sys.executable, "-m", "hvi_fenicsx", *scene], check=True, capture_output=True, cwd=ROOT)
            found.append(of_children() - began)
    return found[1:]


def main() -> None:
    made = parser(__doc__)
    made.add_argument("--cells", type=int, default=128)
    made.add_argument("--loads", type=int, default=100)
    made.add_argument("--runs", type=int, default=5)
    options = made.parse_args()
    pulls = np.linspace(*PULLS, options.loads)
    figures = loop(options.cells, pulls)
    command = statistics.median(by_command(options.cells, pulls[:: max(1, options.loads // options.runs)]))
    spent, own, begun, begun_own = figures["rows"].T
    few, all_ = figures["memory"][min(10, options.loads)], figures["memory"][options.loads]
    ways = {"from the coarse meshes": (spent, own), "from the last solution": (begun, begun_own)}
    rows = [
        [name, f"{np.median(time):.3f}", f"{np.max(time):.3f}", f"{np.sum(time) / np.sum(alone):.2f}",
         f"{command / np.median(time):.0f}"] for name, (time, alone) in ways.items()
    ]  # fmt: skip
    head = ["each load begins", "CPU s per load", "slowest", "over setup and solve", "`hvi run` over it"]
    say(f"{machine()} Memory after 10 loads {few:.0f} MB, after {options.loads} {all_:.0f} MB")
    insert(ROOT / "docs" / "python.md", "load loop", table(head, rows))


if __name__ == "__main__":
    main()
