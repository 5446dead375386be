"""The cost of what a run says of other equilibria, over the processor time of the run.

    ./hvi exec python3 benchmarks/proof_cost.py [--cells 512] [--repeats 3]

The strong law's scene with its own law, with Tresca's and with one that falls. Each is prepared, solved, certified and
estimated as `hvi run` does it, without files. Then the proof is repeated alone; all that is compared is in one process.
"""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

import common

from hvi_fenicsx import read_scene
from hvi_fenicsx.certify.uniqueness import uniqueness
from hvi_fenicsx.workflow import finish, prepare

LAWS: dict[str, dict[str, Any]] = {
    "quadratic_linear": {},
    "tresca": {"law": "tresca", "yield_traction": 5e5},
    "falling": {"law": "graph", "points": [[0.0, 0.0], [9e-6, 1e6], [9e-5, 5e5]]},
}


def once(law: str, cells: int) -> tuple[str, float, float]:
    """What is said, and the seconds of the run and of its proof."""
    given = [f"domain.cells=[{cells},{cells}]"]
    scene = read_scene(common.DEMOS / "strong_law.toml", given)
    if LAWS[law]:
        table = scene.model_dump(exclude_none=True)
        table["boundary"]["floor"]["friction"] = LAWS[law]
        scene = type(scene).model_validate(table)
    began = time.process_time()
    prepared = prepare(scene)
    solution = finish(prepared)
    whole = time.process_time() - began
    assert solution.solve_result is not None
    assert solution.examination is not None
    began = time.process_time()
    found = uniqueness(prepared.system, solution.solve_result.u, solution.examination)
    return found.state, whole, time.process_time() - began


def main() -> None:
    """A table, medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=512)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    rows = []
    for law in LAWS:
        once(law, 8)  # compiles the forms
        runs = [once(law, options.cells) for _ in range(options.repeats)]
        shares = [proof / whole for _, whole, proof in runs]
        seconds = [statistics.median(run[k] for run in runs) for k in (1, 2)]
        rows.append([law, runs[0][0], *(f"{s:.3g}" for s in seconds), f"{100 * statistics.median(shares):.2g} %"])
    print(common.table(["law", "other equilibria", "run, s", "proof, s", "share"], rows))


if __name__ == "__main__":
    main()
