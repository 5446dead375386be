"""The composite layer of Mäkelä and others at its eight loads: the state on the loading path, and the lowest one.

    ./hvi exec python3 benchmarks/composite_loads.py

Columns: load in MPa; energy of the path's state, of what `hvi run` finds, and the proven lowest, J/m; the gap of that
proof; largest displacement on the path and in the lowest state, mm.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import hvi_fenicsx as hvi

SCENE = Path(__file__).resolve().parent.parent / "verification" / "scenes" / "composite.toml"
LOADS = (20, 21, 22, 23, 25, 26, 26.2, 27)


def main() -> int:
    print("load\tpath\trun\tlowest\tgap\tlargest u on path\tin the lowest state", flush=True)
    for load in LOADS:
        scene = hvi.read_scene(SCENE, [f"boundary.top.traction=[0.0, {1e6 * load}]"])
        path, run, found = hvi.follow(scene), hvi.solve(scene), hvi.equilibria(scene, lowest=True)
        end, lowest = path.rows[-1], found.solutions[0]
        reached = f"{end.energy:.8g}" if path.end == "reached" else f"{path.end} at {end.factor:.6g}"
        energies = (reached, f"{run.energy:.8g}", f"{lowest.energy:.8g}", f"{found.gap:.1e}")
        sizes = [1e3 * float(np.max(np.abs(u.x.array))) for u in (path.u(len(path.rows) - 1), lowest.u)]
        print(load, *energies, *(f"{size:.3f}" for size in sizes), sep="\t", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
