"""One and two ranks, over what two processes gain on this machine with plain loops in the same run.

    ./hvi exec python3 benchmarks/ranks.py [--cells 512]

Strong: the same mesh. Weak: the same body in twice the cells (704 x 736 for 512 x 512, on as many levels); the gain
is that of unknowns per second. The loops: one that only computes, and one that reads memory as a sparse product does,
each alone and twice at once. Everything runs in turn, as often as ``--repeats`` says, and a gain is the median of those
of the repeats, so that a machine that drifts does so for all.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
from common import Figures, document, median, parser, picture, run, say, spread, table, work

LOOPS = {
    "computing": "s = 0\nfor i in range(12_000_000): s += i",
    "reading memory": "import numpy as np\na = np.ones(12_000_000)\nfor i in range(60): a.sum()",
}
PHASES = ("assembly", "jit", "setup", "solve")
TWICE = (11 / 8, 23 / 16)
"""Times the cells each way: 1.98 times as many, and as often halved as those of a square."""
Runs = Mapping[str, Figures]
"""Figures of one repeat and scene: on one rank, on two, and on two with twice the cells."""


def together(code: str, processes: int) -> float:
    """Seconds until so many processes that run the code are through, by their own clocks."""
    timed = f"import time\nstart = time.perf_counter()\n{code}\nprint(time.perf_counter() - start)"
    running = [
        subprocess.Popen([sys.executable, "-c", timed], stdout=subprocess.PIPE, text=True) for _ in range(processes)
    ]
    return max(float(p.communicate()[0]) for p in running)


def solved(scene: str, options: argparse.Namespace) -> Runs:
    """A scene's three runs; those that fail are left out."""
    n = options.cells
    wanted = {"one": (1, [n, n]), "strong": (2, [n, n]), "weak": (2, [round(n * factor) for factor in TWICE])}
    found: dict[str, Figures] = {}
    for name, (ranks, cells) in wanted.items():
        figures = run(scene, "contact", [f"domain.cells={cells}"], options, ranks=ranks)
        say(f"{scene}, {name}: {'given up' if figures is None else f'{work(figures):.2f} s'}")
        if figures is not None:
            found[name] = figures
    return found


def gain(repeats: Sequence[Runs], kind: str) -> float:
    """Work per second of two ranks over that of one."""
    pairs = [(r["one"], r[kind]) for r in repeats if "one" in r and kind in r]
    gains = [two["dofs"] / one["dofs"] * work(one) / work(two) for one, two in pairs]
    return statistics.median(gains) if gains else float("nan")


def main() -> None:
    made = parser(__doc__)
    made.set_defaults(repeats=5)
    made.add_argument("--cells", type=int, default=512, help="each way, a multiple of 16")
    made.add_argument("--scenes", nargs="*", default=["paper", "strong law"])
    options = made.parse_args()
    ratios: dict[str, list[float]] = {name: [] for name in LOOPS}
    runs: dict[str, list[Runs]] = {scene: [] for scene in options.scenes}
    for _ in range(options.repeats):
        for name, code in LOOPS.items():
            ratios[name].append(2 * together(code, 1) / together(code, 2))
        for scene in options.scenes:
            runs[scene].append(solved(scene, options))
    loops = {name: statistics.median(found) for name, found in ratios.items()}
    gains = {(scene, kind): gain(runs[scene], kind) for scene in runs for kind in ("strong", "weak")}
    draw(gains, loops)
    gained_by_loops = ", ".join(f"{g:.2f} ({name})" for name, g in loops.items())
    text = f"Two independent processes, each with a plain loop, give a speedup of {gained_by_loops} in the same run."
    meaning = (
        '"Gain" is the speedup of two ranks over one: strong on the same mesh, weak with twice the cells. The last two '
        "columns are the gain over that of the loops."
    )
    parts = [f"{text} {meaning}", gained(runs, gains, loops), "Time by phase, the median in s:", phases(runs)]
    document("ranks", "Two ranks", parts, options)


def gained(
    runs: Mapping[str, Sequence[Runs]], gains: Mapping[tuple[str, str], float], loops: Mapping[str, float]
) -> str:
    """The table of gains."""
    head = ("scene", "scaling", "1 rank / s", "2 ranks / s", "gain", *(f"of the loop {name}" for name in loops))
    rows = []
    for (scene, kind), value in gains.items():
        times = [spread(kept(runs[scene], name)) for name in ("one", kind)]
        rows.append([scene, kind, *times, f"**{value:.2f}**", *(f"{value / g:.0%}" for g in loops.values())])
    return table(head, rows)


def phases(runs: Mapping[str, Sequence[Runs]]) -> str:
    """The table of phases."""
    named = {"one": "1 rank", "strong": "2 ranks", "weak": "2 ranks, twice the cells"}
    rows: list[list[object]] = []
    for scene, repeats in runs.items():
        for name, label in named.items():
            found = kept(repeats, name)
            seconds = [f"{median(found, lambda r, phase=phase: r[phase]):.2f}" for phase in PHASES]
            steps = [f"{median(found, lambda r, count=count: r[count]):.0f}" for count in ("newton", "linear")]
            rows.append([scene, label, *seconds, *steps])
    return table(("scene", "run", *PHASES, "Newton steps", "linear iterations"), rows)


def kept(repeats: Sequence[Runs], name: str) -> list[Figures]:
    """The runs of this name that did not fail."""
    return [r[name] for r in repeats if name in r]


def draw(gains: Mapping[tuple[str, str], float], loops: Mapping[str, float]) -> None:
    figure, axes = plt.subplots(figsize=(7, 3.5))
    axes.barh([", ".join(names) for names in gains], list(gains.values()))
    for style, (name, value) in zip(("--", ":"), loops.items(), strict=True):
        axes.axvline(value, color="black", ls=style, label=f"two plain processes, {name}")
    axes.set_xlabel("gain of two ranks")
    axes.invert_yaxis()
    axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.4, -0.2), ncol=2)
    picture("ranks", figure)


if __name__ == "__main__":
    main()
