"""The journal of a path: what was written is read again, also where the end is torn off."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hvi_fenicsx.runtime import writing
from hvi_fenicsx.runtime.writing import Journal

RECORDS: list[dict[str, Any]] = [
    {"factor": 0.1 + 0.2, "event": "kink", "x": np.array([1.0, np.nextafter(1.0, 2.0)]), "memory": None},
    {"factor": np.inf, "event": "end", "x": np.zeros(0), "place": {"part": "Kante", "point": np.arange(3.0)}},
]


def write(path: Path, identity: str = "this") -> None:
    with closing(Journal(path, identity)) as opened:
        for record in RECORDS:
            opened.append(record)


def test_another_path_has_no_records_here(tmp_path: Path) -> None:
    write(tmp_path / "j")
    assert writing.read_journal(tmp_path / "j", "that") == []
    assert writing.read_journal(tmp_path / "absent", "this") == []


def test_wherever_the_end_is_torn_off_the_whole_records_stay_and_the_next_follows_them(tmp_path: Path) -> None:
    write(tmp_path / "j")
    whole = (tmp_path / "j").read_bytes()
    counts = set()
    for length in range(len(whole)):
        (tmp_path / "j").write_bytes(whole[:length])
        with closing(Journal(tmp_path / "j", "this")) as opened:
            counts.add(len(opened.records))
            opened.append(RECORDS[1])
        assert writing.read_journal(tmp_path / "j", "this")[-1]["event"] == "end"
    assert counts == {0, 1}


@pytest.mark.parametrize("at", [20, 60, -20])
def test_a_changed_byte_ends_the_journal_before_its_record(at: int, tmp_path: Path) -> None:
    write(tmp_path / "j")
    content = bytearray((tmp_path / "j").read_bytes())
    content[at] ^= 1
    (tmp_path / "j").write_bytes(content)
    assert len(writing.read_journal(tmp_path / "j", "this")) < len(RECORDS)
