"""What a long computation has so far, in a file, so that a run that was killed goes on from there.

A path adds each of its states, a search replaces its last one. A record is a line of JSON behind its checksum, arrays
as base64; what a killed process wrote in part is cut off. The first record says what the computation is of.
"""

from __future__ import annotations

import base64
import json
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import writing

Record = Mapping[str, Any]


class Journal:
    """A journal that is open for writing; rank 0 only.

    Args:
        path: the file.
        identity: what the computation is of.

    Attributes:
        records: what it held already, if that is of the same computation.

    Raises:
        OSError: it cannot be read.
        NotWrittenError: it cannot be written.
    """

    def __init__(self, path: Path, identity: str) -> None:
        self._path = path
        self.records, whole = _journal(path, identity)
        with writing.told(path):
            self._file = path.open("r+b" if whole else "wb")
            self._file.truncate(whole)
            self._file.seek(whole)
        if not whole:
            self.append({"identity": identity})

    def append(self, record: Record) -> None:
        """Add a record; a process that is killed afterwards leaves it whole.

        Args:
            record: numbers, texts, None, arrays or tables of these.

        Raises:
            NotWrittenError: it cannot be written; the records before it are there.
        """
        with writing.told(self._path):
            self._file.write(_line(record))
            self._file.flush()

    def close(self) -> None:
        """Close the file; a power cut harms it no more.

        Raises:
            NotWrittenError: it could not be written.
        """
        with writing.told(self._path), self._file:
            os.fsync(self._file.fileno())


def write_journal(path: Path, identity: str, records: Iterable[Record]) -> None:
    """Write a journal of some records, whole or not at all.

    Args:
        path: the file.
        identity: what the computation is of.
        records: what it has so far.

    Raises:
        NotWrittenError: it cannot be written.
    """
    with writing.whole(path) as aside:
        aside.write_bytes(b"".join(map(_line, [{"identity": identity}, *records])))


def read_journal(path: Path, identity: str) -> list[Record]:
    """The records of a journal; none where there is no journal, or one of another computation.

    Args:
        path: the file.
        identity: what the computation is of.
    """
    return _journal(path, identity)[0]


def _journal(path: Path, identity: str) -> tuple[list[Record], int]:
    """The records, and the length of the file as far as they are whole."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return [], 0
    found = list(_records(content))
    if not found or found[0][0] != {"identity": identity}:
        return [], 0
    return [record for record, _ in found[1:]], found[-1][1]


def _records(content: bytes) -> Iterator[tuple[Record, int]]:
    """Records with where they end, up to the first that is not whole."""
    end = 0
    for line in content.splitlines(keepends=True):
        checksum, _, text = line.partition(b" ")
        if checksum != _checksum(text) or not text.endswith(b"\n"):
            return
        end += len(line)
        yield json.loads(text, object_hook=_with_array), end


def _line(record: Record) -> bytes:
    text = json.dumps(record, default=_packed).encode() + b"\n"
    return _checksum(text) + b" " + text


def _checksum(text: bytes) -> bytes:
    return b"%08x" % zlib.crc32(text)


def _packed(array: Any) -> dict[str, Any]:
    data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
    return {"array": data, "type": array.dtype.str, "shape": array.shape}


def _with_array(table: dict[str, Any]) -> Any:
    if table.keys() != {"array", "type", "shape"}:
        return table
    return np.frombuffer(base64.b64decode(table["array"]), table["type"]).reshape(table["shape"]).copy()
