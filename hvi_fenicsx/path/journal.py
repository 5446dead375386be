"""The states of a path in a file that only grows, so that a run that was killed goes on from its last state.

A record is its length, a checksum and the fields: numbers and texts as JSON, arrays as they are in memory. What a
killed process wrote in part is cut off. The first record says what the path is of.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..runtime import writing

NAME = "path.journal"
_FRAME = struct.Struct("<QI")
"""Length of a record's content, and its CRC-32."""
Record = Mapping[str, Any]


class Journal:
    """A journal that is open for writing; rank 0 only.

    Args:
        path: the file.
        identity: what the path is of.

    Attributes:
        records: what it held already, if that is of the same path.

    Raises:
        OSError: it cannot be read.
        NotWrittenError: it cannot be written.
    """

    def __init__(self, path: Path, identity: str) -> None:
        self._path = path
        self.records, whole = _read(path, identity)
        with writing.told(path):
            self._file = path.open("r+b" if whole else "wb")
            self._file.truncate(whole)
            self._file.seek(whole)
        if not whole:
            self.append({"identity": identity})

    def append(self, record: Record) -> None:
        """Add a record; a process that is killed afterwards leaves it whole.

        Args:
            record: numbers, texts, None, arrays of floats or tables of these.

        Raises:
            NotWrittenError: it cannot be written; the records before it are there.
        """
        content = _packed(record)
        with writing.told(self._path):
            self._file.write(_FRAME.pack(len(content), zlib.crc32(content)) + content)
            self._file.flush()

    def close(self) -> None:
        """Close the file; a power cut harms it no more.

        Raises:
            NotWrittenError: it could not be written.
        """
        with writing.told(self._path), self._file:
            os.fsync(self._file.fileno())


def read(path: Path, identity: str) -> list[Record]:
    """The records of a journal; none where there is no journal, or one of another path.

    Args:
        path: the file.
        identity: what the path is of.
    """
    return _read(path, identity)[0]


def _read(path: Path, identity: str) -> tuple[list[Record], int]:
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
    at = 0
    while at + _FRAME.size <= len(content):
        length, checksum = _FRAME.unpack_from(content, at)
        body = content[at + _FRAME.size : at + _FRAME.size + length]
        if len(body) != length or zlib.crc32(body) != checksum:
            return
        at += _FRAME.size + length
        yield _unpacked(body), at


def _packed(record: Record) -> bytes:
    """Arrays are left out of the JSON and follow it, in their order."""
    arrays: list[bytes] = []

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            arrays.append(np.ascontiguousarray(value, dtype=np.float64).tobytes())
            return {"array": list(value.shape)}
        if isinstance(value, Mapping):
            return {"table": {key: plain(entry) for key, entry in value.items()}}
        return value

    text = json.dumps({key: plain(value) for key, value in record.items()}).encode()
    return struct.pack("<Q", len(text)) + text + b"".join(arrays)


def _unpacked(content: bytes) -> Record:
    (length,) = struct.unpack_from("<Q", content)
    at = 8 + length

    def read(value: Any) -> Any:
        nonlocal at
        if not isinstance(value, dict):
            return value
        if "table" in value:
            return {key: read(entry) for key, entry in value["table"].items()}
        count = int(np.prod(value["array"]))
        array = np.frombuffer(content, np.float64, count, at).reshape(value["array"]).copy()
        at += array.nbytes
        return array

    return {key: read(value) for key, value in json.loads(content[8 : 8 + length]).items()}
