"""A table as a file of comma-separated values, of which each rank writes its rows after those of the rank before it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from mpi4py import MPI

from ..runtime import writing
from ..runtime.mpi import in_turn, on_root


def write(comm: MPI.Comm, path: Path, header: Sequence[str], parts: Iterable[Iterable[Sequence[str]]]) -> None:
    """Write a table, part after part. Collective.

    The ranks write one after the other, since Open MPI's parallel files do not tell that a disk is full.

    Args:
        comm: the ranks.
        path: the file, which all ranks see.
        header: the names of the columns.
        parts: of this rank the rows of each part, as texts; as many parts on all ranks.

    Raises:
        NotWrittenError: on all ranks alike: the file cannot be written.
    """
    on_root(comm, lambda: _append(path, _text([header]), "wb"))
    for rows in parts:
        text = _text(rows)
        in_turn(comm, lambda text=text: _append(path, text))  # type: ignore[misc]


def _text(rows: Iterable[Sequence[str]]) -> bytes:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue().encode()


def _append(path: Path, text: bytes, mode: str = "ab") -> None:
    if text:
        with writing.told(path), path.open(mode) as stream:
            stream.write(text)
