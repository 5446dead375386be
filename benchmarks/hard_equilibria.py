"""Which of the hard cases that are metastable or borderline have an equilibrium at all: searched with a proof.

    ./hvi exec python3 benchmarks/hard_equilibria.py [--cells 16] [--only KEY ...] [--limit SECONDS]

Of each such case in which `auto` certifies nothing, all equilibria are searched (`hvi equilibria`); one line each.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from typing import Any

import hard_scenes
from covering import Case, Table, cases
from hard_cases import AXES
from mpi4py import MPI

from hvi_fenicsx.errors import HviError
from hvi_fenicsx.workflow import finish
from hvi_fenicsx.workflow.equilibria import Equilibria

UNDECIDED = ("metastable", "borderline")
LARGEST = 8
"""Cells along the floor of cases that a report has searched."""


def number_of_equilibria(case: Case, data: Mapping[str, Any], limit: float = 60.0) -> int | None:
    """How many equilibria a case has; None where that is not proven within the limit of processor time."""
    prepared = hard_scenes.prepare(case, data, "auto", MPI.COMM_SELF)
    try:
        found = Equilibria(prepared).find(lowest=False, gap=1e-8, stop=_clock(limit), report=lambda _: None)
    except HviError:
        return None
    return len(found.points) if found.complete else None


def is_open(case: Case, data: Mapping[str, Any], limit: float) -> bool:
    """Whether existence is undecided, and `auto` certifies nothing."""
    prepared = hard_scenes.prepare(case, data, "auto", MPI.COMM_SELF)
    if prepared.solvability.state not in UNDECIDED:
        return False
    return not finish(prepared, interrupted=_clock(limit), estimating=False).converged


def _clock(limit: float) -> Callable[[], bool]:
    """Whether so many seconds of processor time are over."""
    begin = time.process_time()
    return lambda: time.process_time() - begin > limit


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=16)
    parser.add_argument("--only", nargs="+", metavar="KEY", help="cases, by default all up to that size")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of processor time for each case and search")
    options = parser.parse_args()
    table = Table.read(AXES)
    for case in cases(table):
        wanted = case.key in options.only if options.only else case["cells"] <= options.cells
        if wanted and is_open(case, table.data, options.limit):
            number = number_of_equilibria(case, table.data, options.limit)
            words = "not proven" if number is None else f"{number} equilibria"
            about = (case["law"], case["smoothing"], case["cells"])
            print(case.number, case.key, *about, words, sep="\t", flush=True)


if __name__ == "__main__":
    main()
