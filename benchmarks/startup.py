"""Start-up: imports, the first compilation and the later ones, the help, the demo from shell to files.

./hvi exec python3 benchmarks/startup.py
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
from common import DEMOS, ROOT, document, parser, picture, table

HVI = [sys.executable, "-m", "hvi_fenicsx"]
DEMO = [*HVI, "run", str(DEMOS / "wall_left.toml"), "--force"]


def seconds(words: list[str], **environment: str) -> float:
    start = time.perf_counter()
    subprocess.run(words, capture_output=True, check=True, cwd=ROOT, env={**os.environ, **environment})
    return time.perf_counter() - start


def main() -> None:
    options = parser(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = ["--out", str(Path(folder) / "result")]
        bare = [*DEMO, *out, "--no-pictures"]
        cases = {
            "Python itself": lambda i: seconds([sys.executable, "-c", "pass"]),
            "import hvi_fenicsx": lambda i: seconds([sys.executable, "-c", "import hvi_fenicsx"]),
            "import dolfinx.fem.petsc": lambda i: seconds([sys.executable, "-c", "import dolfinx.fem.petsc"]),
            "hvi --help": lambda i: seconds([*HVI, "--help"]),
            "the demo, JIT cold, no pictures": lambda i: seconds(bare, XDG_CACHE_HOME=str(Path(folder) / f"cold{i}")),
            "the demo, JIT warm, no pictures": lambda i: seconds(bare),
            "the demo with its pictures": lambda i: seconds([*DEMO, *out]),
        }
        found = {name: [case(i) for i in range(options.repeats)] for name, case in cases.items()}
    rows = [[n, f"{statistics.median(v):.2f} ({min(v):.2f} to {max(v):.2f})"] for n, v in found.items()]
    figure, axes = plt.subplots(figsize=(7, 3))
    axes.barh(list(found), [statistics.median(v) for v in found.values()])
    axes.set_xlabel("s")
    axes.invert_yaxis()
    picture("startup", figure)
    text = (
        "The table has the wall time of processes that are started inside the environment. `./hvi` adds the time "
        "to enter it."
    )
    document("startup", "Start-up", [text, table(("what", "s"), rows)], options)


if __name__ == "__main__":
    main()
