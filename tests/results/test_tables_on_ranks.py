"""What several ranks write is what one writes: the rows of tables in their order, and the arrays of pictures."""

from __future__ import annotations

import csv
from typing import Any

import pytest
from runs import RANKS, on_ranks


@pytest.fixture(scope="module")
def alone() -> Any:
    return on_ranks(1, "tests/results/table_ranks.py")


@pytest.fixture(scope="module", params=RANKS)
def ranks(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def found(ranks: int) -> Any:
    """What ``table_ranks.py`` tells."""
    return on_ranks(ranks, "tests/results/table_ranks.py")


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def test_tables_have_the_same_rows_in_the_same_order(found: Any, alone: Any) -> None:
    for name, one in alone["results"].items():
        for table, text in one["tables"].items():
            mine, wanted = rows(found["results"][name]["tables"][table]), rows(text)
            assert [row["part"] for row in mine] == [row["part"] for row in wanted]
            for column in set(wanted[0]) - {"part"}:
                values, expected = ([float(row[column] or "nan") for row in each] for each in (mine, wanted))
                largest = max((abs(v) for v in expected if v == v), default=0.0)
                near = pytest.approx(expected, rel=1e-6, abs=1e-6 * largest, nan_ok=True)
                assert values == near, (name, table, column)


def test_arrays_are_the_same_but_for_the_numbers_of_vertices(found: Any, alone: Any) -> None:
    for name, one in alone["results"].items():
        for key in ("moments", "facets", "parts"):
            mine, wanted = found["results"][name][key], one[key]
            pairs = zip(mine.values(), wanted.values(), strict=True) if isinstance(wanted, dict) else [(mine, wanted)]
            assert all(values == pytest.approx(expected, rel=1e-6) for values, expected in pairs), (name, key)


def test_a_disk_that_is_full_is_told_to_all_ranks_and_leaves_nothing(found: Any, ranks: int) -> None:
    reasons, left = found["full"]
    assert len(set(reasons)) == 1
    assert reasons[0].endswith("make room on the disk")
    assert len(reasons) == ranks
    assert left == []
