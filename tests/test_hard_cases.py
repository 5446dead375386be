"""A reduced part of the hard-case matrix (benchmarks/hard_cases.py): ``auto``, judged by the certificate.

The cases are taken from the committed list by their size and place in it, not by what becomes of them.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import hard_run  # noqa: E402 (a script's neighbour, not a package)
from covering import Case, Table, cases  # noqa: E402

TABLE = Table.read(BENCHMARKS / "hard_cases.toml")
LISTED = cases(TABLE)
SMALL = [c for c in LISTED if c["cells"] <= 8 and c["ranks"] == 1]
FAST = SMALL[:: max(1, len(SMALL) // 30)]
REST = [c for c in LISTED if c["cells"] <= 32 and c["ranks"] == 1 and c not in FAST]
SOLVED = ("certified", "escapes", "no_equilibrium")


def parameters(chosen: list[Case]) -> list[Any]:
    return [pytest.param(case, id=case.key) for case in chosen]


def solve_and_judge(case: Case) -> None:
    record = hard_run.attempt(case, TABLE.data, "auto", TABLE.data["limit"])
    assert record["outcome"] in SOLVED, f"{case.values}: {record['reason']} {record.get('certificate')}"


@pytest.mark.parametrize("case", parameters(FAST))
def test_auto_solves_a_small_case(case: Case) -> None:
    solve_and_judge(case)


@pytest.mark.long
@pytest.mark.parametrize("case", parameters(REST))
def test_auto_solves_a_case(case: Case) -> None:
    solve_and_judge(case)


def test_the_list_covers_what_it_promises() -> None:
    left = TABLE.tuples()
    for case in LISTED:
        left -= {t for t in left if all(case[axis] == value for axis, value in t)}
    assert not left
    assert len(LISTED) >= 300
    assert all(TABLE.allowed(c.values) for c in LISTED)


def test_the_list_is_the_same_every_time() -> None:
    assert [c.key for c in cases(Table.read(BENCHMARKS / "hard_cases.toml"))] == [c.key for c in LISTED]
