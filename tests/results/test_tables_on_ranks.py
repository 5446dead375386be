"""Tables that all ranks write are those that one rank would write from all rows, byte by byte; none holds all rows."""

from __future__ import annotations

import os
from typing import Any

import pytest
from runs import RANKS, on_ranks

SAMPLES = 32


@pytest.fixture(scope="module", params=RANKS)
def ranks(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def found(ranks: int) -> Any:
    """What ``table_ranks.py`` tells."""
    return on_ranks(ranks, "tests/results/table_ranks.py")


def test_a_table_has_the_bytes_of_one_that_is_gathered(found: Any) -> None:
    wanted = dict.fromkeys(found["tables"], (True, True))
    assert {name: (table["same"], table["ordered"]) for name, table in found["tables"].items()} == wanted


def test_no_rank_holds_the_rows_of_all_also_where_one_had_none(found: Any, ranks: int) -> None:
    for table in found["tables"].values():
        rows = sum(table["had"])
        assert sum(table["has"]) == rows > 0
        assert max(table["has"]) <= rows / ranks + 3  # three more for each part
    if ranks == 3:
        assert any(0 in table["had"] for table in found["tables"].values())


def test_rows_are_sorted_over_all_ranks_in_equal_stretches(found: Any, ranks: int) -> None:
    """Equal keys stay together: 729 kinds of them, so that a stretch may be longer by one kind."""
    for same, longest, rows in found["orders"].values():
        assert same
        assert longest <= rows / ranks * (1 + ranks / SAMPLES) + max(2, 3 * rows / 729)


def test_where_one_rank_cannot_write_all_are_told_and_later_ones_do_not_begin(found: Any, ranks: int) -> None:
    acted, words = found["failing"]
    assert acted == [1, 1, 0][:ranks]
    assert words == ["contact.csv: No space left on device"] * ranks


def test_an_archive_has_the_bytes_of_one_that_is_gathered(found: Any, ranks: int) -> None:
    for archive in found["archives"].values():
        assert archive["differing"] == []
        assert archive["share"] < 1.5 / ranks
    assert found["uneven"][0] == []


def test_rank_0_never_holds_the_arrays_of_all(found: Any) -> None:
    """Only a block of 4 MB goes through it, of the 12 to 70 MB that it writes beside what it has."""
    assert found["uneven"][1] < 0.5


def test_a_disk_that_is_full_is_told_to_all_ranks_and_leaves_nothing(found: Any, ranks: int) -> None:
    reasons, left = found["full"]
    assert reasons == ["File too large; make room on the disk"] * ranks
    assert left == []


def test_pictures_are_begun_before_the_result_is_finished_where_a_processor_is_free(found: Any, ranks: int) -> None:
    assert found["begun"] is (ranks < (os.cpu_count() or 1))
