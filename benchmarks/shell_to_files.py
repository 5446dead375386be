"""From the shell to the files: the seconds of each phase of `hvi run`, over those of the solve.

./hvi exec python3 benchmarks/shell_to_files.py --cpu
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import DEMOS, ROOT, SCENES, document, parser, picture, say, square, table

PLANE = ("frictionless", "paper", "strong law", "lift-off")
SOLVE = ("jit", "assembly", "setup", "solve")
PHASES = ("start", "mesh", *SOLVE, "existence", "certificate", "estimate", "output")
Seconds = dict[str, float]


def processor_time() -> float:
    """Of this process and its ended children, which draw."""
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(found.ru_utime + found.ru_stime for found in map(resource.getrusage, whose))


def one(words: list[str]) -> None:
    """`hvi run` in this process, its timer on processor time where so wanted; the time before its timer as JSON."""
    cpu, words = words[0] == "cpu", words[1:]
    began = 0.0 if cpu else time.perf_counter()
    from hvi_fenicsx.runtime import cost

    if cpu:
        cost.time.perf_counter = processor_time  # type: ignore[attr-defined]
    from hvi_fenicsx.commands import cli

    made: list[float] = []
    init = cost.Timer.__init__

    def timed(self: cost.Timer) -> None:
        made.append((processor_time() if cpu else time.perf_counter()) - began)
        init(self)

    cost.Timer.__init__ = timed  # type: ignore[method-assign]
    code = cli.main(words)
    from mpi4py import MPI  # not before: the program starts PETSc first

    if MPI.COMM_WORLD.rank == 0:
        print(f"\n{json.dumps([code, made[0]])}", flush=True)


def run(scene: str, options: Any, folder: Path) -> Seconds:
    """The phases of a run in a process of its own."""
    name, own = SCENES[scene]
    changes = [word for change in [*own, *square(options.cells)] for word in ("--set", change)]
    hvi = ["run", str(DEMOS / f"{name}.toml"), *changes, "--out", str(folder), "--force", *options.more]
    words = [sys.executable, *(["-m", "mpi4py"] if options.ranks > 1 else []), str(Path(__file__))]
    words += ["--one", "cpu" if options.cpu else "wall", *hvi]
    words = (["mpirun", "-n", str(options.ranks)] if options.ranks > 1 else []) + words
    done = subprocess.run(
        words, capture_output=True, text=True, check=True, cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    code, start = json.loads(done.stdout.splitlines()[-1])
    assert code == 0, done.stdout
    found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["time"]
    return {**found, "start": start, "whole": start + found["total"], "work": sum(found[phase] for phase in SOLVE)}


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2:])
        return
    made = parser(__doc__)
    made.add_argument("--cells", type=int, default=512)
    made.add_argument("--ranks", type=int, default=1)
    made.add_argument("--more", nargs="*", default=[], help="further options of hvi run, without their dashes")
    options = made.parse_args()
    options.more = [f"--{word}" for word in options.more]
    found: dict[str, list[Seconds]] = {scene: [] for scene in PLANE}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.repeats):
            for scene in PLANE:
                found[scene].append(run(scene, options, Path(folder) / "result"))
                say(f"{scene}: {found[scene][-1]['whole']:.2f} s, {found[scene][-1]['work']:.2f} s of it the solve")
    written(found, options)


def written(found: dict[str, list[Seconds]], options: Any) -> None:
    """The page."""

    def middle(scene: str, phase: str, over: str = "") -> float:
        return statistics.median(one[phase] / (one[over] if over else 1.0) for one in found[scene])

    seconds = [[phase, *(f"{middle(scene, phase):.2f}" for scene in PLANE)] for phase in (*PHASES, "whole")]
    shares = [
        [text, *(f"{middle(scene, phase, 'work'):.2f}" for scene in PLANE)]
        for phase, text in (("whole", "whole run"), ("mesh", "mesh"), ("estimate", "estimate"), ("output", "output"))
    ]
    figure, axes = plt.subplots(figsize=(8, 3))
    left = [0.0] * len(PLANE)
    for phase in PHASES:
        widths = [middle(scene, phase) for scene in PLANE]
        axes.barh(PLANE, widths, left=left, label=phase)
        left = [a + b for a, b in zip(left, widths, strict=True)]
    axes.set_xlabel("s")
    axes.invert_yaxis()
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture("shell-to-files", figure)
    text = (
        f"`hvi run` with {options.cells} x {options.cells} cells on {options.ranks} rank(s), with pictures and page; "
        f"medians of {options.repeats}. *start* is what passes before the program's own timer begins: Python and its "
        "imports. *output* has the processor time of the process that draws."
    )
    solve = "Over the solve (jit, assembly, setup and solve):"
    parts = [text, table(("phase / s", *PLANE), seconds), solve, table(("phase", *PLANE), shares)]
    document("shell-to-files", "From the shell to the files", parts, options)


if __name__ == "__main__":
    main()
