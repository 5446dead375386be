"""One and two ranks, over what two processes gain on this machine with plain loops in the same run.

    ./hvi exec python3 benchmarks/ranks.py [--cells 512]

Strong: the same mesh. Weak: twice the cells on two ranks. The loops: one that only computes, and one that reads memory
as a sparse product does, each alone and twice at once.
"""

from __future__ import annotations

import statistics
import subprocess
import sys

import matplotlib.pyplot as plt
from common import document, median, parser, picture, repeated, spread, table

LOOPS = {
    "computing": "s = 0\nfor i in range(12_000_000): s += i",
    "reading memory": "import numpy as np\na = np.ones(12_000_000)\nfor i in range(60): a.sum()",
}


def together(code: str, processes: int) -> float:
    """Seconds until so many processes that run the code are through, by their own clocks."""
    timed = f"import time\nstart = time.perf_counter()\n{code}\nprint(time.perf_counter() - start)"
    running = [
        subprocess.Popen([sys.executable, "-c", timed], stdout=subprocess.PIPE, text=True) for _ in range(processes)
    ]
    return max(float(p.communicate()[0]) for p in running)


def gain(code: str, repeats: int) -> float:
    """Work per second of two processes over that of one."""
    return statistics.median(2 * together(code, 1) / together(code, 2) for _ in range(repeats))


def main() -> None:
    made = parser(__doc__)
    made.add_argument("--cells", type=int, default=512)
    made.add_argument("--scenes", nargs="*", default=["paper", "strong law"])
    options = made.parse_args()
    loops = {name: gain(code, options.repeats) for name, code in LOOPS.items()}
    n = options.cells
    rows: list[list[object]] = []
    for scene in options.scenes:
        for kind, cells in (("strong", [n, n]), ("weak", [2 * n, n])):
            size = [f"domain.cells={cells}", f"domain.size=[{cells[0] / n}, 1.0]"]
            one = repeated({"1": (scene, "contact", [f"domain.cells=[{n}, {n}]"])}, options)["1"]
            two = repeated({"2": (scene, "contact", size)}, options, ranks=2)["2"]
            gained = median(one) / median(two) * (2 if kind == "weak" else 1)
            shares = [f"{gained / g:.0%}" for g in loops.values()]
            rows.append([scene, kind, spread(one), spread(two), f"**{gained:.2f}**", *shares])
    draw(rows, loops)
    text = "Two plain processes gain " + ", ".join(f"{g:.2f} ({name})" for name, g in loops.items()) + "."
    head = ("scene", "scaling", "1 rank / s", "2 ranks / s", "gain", *(f"of the loop {name}" for name in loops))
    document("ranks", "Two ranks", [text, table(head, rows)], options)


def draw(rows: list[list[object]], loops: dict[str, float]) -> None:
    figure, axes = plt.subplots(figsize=(7, 3.5))
    axes.barh([f"{r[0]}, {r[1]}" for r in rows], [float(str(r[4]).strip("*")) for r in rows])
    for style, (name, value) in zip(("--", ":"), loops.items(), strict=True):
        axes.axvline(value, color="black", ls=style, label=f"two plain processes, {name}")
    axes.set_xlabel("gain of two ranks")
    axes.invert_yaxis()
    axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.4, -0.2), ncol=2)
    picture("ranks", figure)


if __name__ == "__main__":
    main()
