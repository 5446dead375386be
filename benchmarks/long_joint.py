"""A glued bar with ever more vertices, followed to where it comes off, with and without the condensed stiffness.

    ./hvi exec python3 benchmarks/long_joint.py [--cells 190 380 760 1520 3040] [--formed 760] [--write]

Each path is followed in a process of its own. ``events`` counts all vertices that pass an end, those of the jump too;
``--formed`` is the number of cells up to which the stiffness is also formed. Processor times of the path alone, with
its certificates; memory of the process. ``--write`` puts the table into docs/benchmarks/paths.md.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from common import DEMOS, ROOT, insert, table

import hvi_fenicsx as hvi
from hvi_fenicsx.equilibrium_paths.tracer import Tracer
from hvi_fenicsx.path.following import Control, PathRun
from hvi_fenicsx.solvers.thresholds import PathThresholds
from hvi_fenicsx.workflow import DEFAULT, prepare

PAGE = ROOT / "docs" / "benchmarks" / "paths.md"
HEAD = ("condensed unknowns", "stiffness", "rows", "events", "largest factor", "certified", "s", "ms per event", "MB")


def counted() -> list[int]:
    """A list that gets an entry for each event from now on."""
    events: list[int] = []
    plain = Tracer.enter

    def enter(self: Tracer, i: int, *rest: Any) -> None:
        events.append(i)
        plain(self, i, *rest)

    Tracer.enter = enter  # type: ignore[method-assign]
    return events


def followed(cells: int, *, formed: bool) -> tuple[Any, ...]:
    """The row of one path."""
    limits = PathThresholds(largest_dense=10**6 if formed else 0)
    linear = replace(DEFAULT.solvers.linear, solve_overhead=np.inf if formed else 0.0)
    thresholds = replace(DEFAULT, solvers=replace(DEFAULT.solvers, path=limits, linear=linear))
    scene = hvi.read_scene(DEMOS / "glued_bar.toml", [f"domain.cells=[{cells},1]"])
    assert scene.path is not None
    events, start = counted(), time.process_time()
    run = PathRun(prepare(scene, thresholds=thresholds), scene.path)
    path = run.follow(Control())
    seconds = time.process_time() - start
    assert path.end == "escapes", path.reason
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    certified = "all" if not path.uncertified else f"**{len(path.rows) - path.uncertified}**"
    figures = (f"{seconds:.1f}", f"{1e3 * seconds / len(events):.1f}", f"{memory:.0f}")
    kind = "array" if formed else "factors"
    return (run.size, kind, len(path.rows), len(events), f"{path.factors[path.peak]:.8g}", certified, *figures)


def in_process(cells: int, kind: str) -> list[Any]:
    """The row of a path in a process of its own."""
    words = [sys.executable, __file__, "--one", str(cells), kind]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return list(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--cells", type=int, nargs="+", default=[190, 380, 760, 1520, 3040])
    parser.add_argument("--formed", type=int, default=760)
    parser.add_argument("--write", action="store_true", help="the table into docs/benchmarks/paths.md")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(followed(int(options.one[0]), formed=options.one[1] == "array")))
        return
    rows = []
    for cells in options.cells:
        for kind in ("array", "factors") if cells <= options.formed else ("factors",):
            rows.append(in_process(cells, kind))
            print(*rows[-1], sep="\t", flush=True)
    if options.write:
        insert(PAGE, "long joint", table(HEAD, rows))


if __name__ == "__main__":
    main()
