"""Which of the hard cases that are metastable or borderline have an equilibrium at all: searched with a proof.

    ./hvi exec python3 benchmarks/hard_equilibria.py [--cells 16] [--only KEY ...] [--limit SECONDS]

Of each such case in which `auto` certifies nothing, all equilibria are searched (`hvi equilibria`); one line each.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import hard_scenes
from covering import Case, Table, cases
from hard_cases import AXES
from mpi4py import MPI

from hvi_fenicsx import workflow
from hvi_fenicsx.errors import HviError
from hvi_fenicsx.stationary_points.bodies import Equilibria

UNDECIDED = ("metastable", "borderline")


def decided(case: Case, table: Table, limit: float) -> str | None:
    """What is known of a case; None where `auto` certifies an equilibrium, or existence is decided."""
    prepared = hard_scenes.prepare(case, table.data, "auto", MPI.COMM_SELF)
    if prepared.solvability.state not in UNDECIDED:
        return None
    if workflow.finish(prepared, interrupted=_clock(limit), estimating=False).converged:
        return None
    begin = time.process_time()
    try:
        found = Equilibria(prepared).find(lowest=False, gap=1e-8, stop=_clock(limit), report=lambda _: None)
    except HviError as error:
        return f"not searched: {error}"
    return f"{found.reason}\t{found.nodes} cells\t{time.process_time() - begin:.1f} s"


def _clock(limit: float) -> Callable[[], bool]:
    """Whether so many seconds of processor time are over."""
    begin = time.process_time()
    return lambda: time.process_time() - begin > limit


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--cells", type=int, default=16)
    parser.add_argument("--only", nargs="+", metavar="KEY", help="cases, by default all up to that size")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of processor time for each case and search")
    options = parser.parse_args()
    table = Table.read(AXES)
    for case in cases(table):
        wanted = case.key in options.only if options.only else case["cells"] <= options.cells
        if wanted and (words := decided(case, table, options.limit)):
            print(
                f"{case.number}\t{case.key}\t{case['law']}\t{case['smoothing']}\t{case['cells']}\t{words}", flush=True
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
