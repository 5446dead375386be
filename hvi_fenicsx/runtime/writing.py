"""Files that are written whole or not at all, journals, and what is said of a file that cannot be written.

A journal holds what a long computation has so far, so that a run that was killed goes on from there: a path adds each
of its states, a search replaces its last one. A record is a line of JSON behind its checksum, arrays as base64; what a
killed process wrote in part is cut off. The first record says what the computation is of.
"""

from __future__ import annotations

import base64
import contextlib
import errno
import json
import os
import sys
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import NotWrittenError

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_MARK = "not written: "
"""How the line of a child process begins."""


def not_written(file: Path, number: int | None) -> NotWrittenError:
    """The error of a file that could not be written.

    Args:
        file: which one.
        number: what the operating system said, as in ``errno``.
    """
    why = os.strerror(number or errno.EIO)
    mend = "make room on the disk" if number in _FULL else "choose another folder"
    return NotWrittenError(file, f"{why}; {mend}")


@contextlib.contextmanager
def told(file: Path) -> Iterator[None]:
    """Say which file could not be written: the error of a full disk does not name it.

    Args:
        file: that is written in the block.

    Raises:
        NotWrittenError: it could not be written.
    """
    try:
        yield
    except OSError as error:
        raise not_written(file, error.errno) from None


def half_of(file: Path) -> Path:
    """The name under which a file is written until it is whole; a killed process leaves that.

    Args:
        file: that is to be there in the end.
    """
    return file.with_name(f".{file.name}.part")


@contextlib.contextmanager
def whole(file: Path) -> Iterator[Path]:
    """A name beside a file to write to; renamed to the file when all went well, else removed.

    Args:
        file: that is to be there in the end.

    Raises:
        NotWrittenError: it could not be written.
    """
    aside = half_of(file)
    with told(file):
        try:
            yield aside
            os.replace(aside, file)
        finally:
            with contextlib.suppress(OSError):
                aside.unlink(missing_ok=True)


def text(file: Path, content: str) -> None:
    """Write a text, whole or not at all.

    Args:
        file: where to.
        content: what it says.

    Raises:
        NotWrittenError: it could not be written.
    """
    with whole(file) as aside:
        aside.write_text(content, encoding="utf-8")


def hand_over(error: NotWrittenError) -> int:
    """Say on standard error what could not be written, for :func:`raise_handed_over` of the process that started this.

    Args:
        error: of the file.

    Returns:
        The exit code of this process.
    """
    print(_MARK + json.dumps([str(error.file), error.reason]), file=sys.stderr)
    return os.EX_IOERR


def raise_handed_over(code: int, errors: str) -> None:
    """Raise what a child process has handed over; nothing where it has ended for another reason.

    Args:
        code: its exit code.
        errors: its standard error.

    Raises:
        NotWrittenError: a file could not be written.
    """
    if code == os.EX_IOERR and _MARK in errors:
        file, reason = json.loads(errors.rpartition(_MARK)[2].partition("\n")[0])
        raise NotWrittenError(Path(file), reason)


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
        with told(path):
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
        with told(self._path):
            self._file.write(_line(record))
            self._file.flush()

    def close(self) -> None:
        """Close the file; a power cut harms it no more.

        Raises:
            NotWrittenError: it could not be written.
        """
        with told(self._path), self._file:
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
    with whole(path) as aside:
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
    data = base64.b64encode(array.tobytes()).decode()
    return {"array": data, "type": array.dtype.str, "shape": array.shape}


def _with_array(table: dict[str, Any]) -> Any:
    if table.keys() != {"array", "type", "shape"}:
        return table
    import numpy as np  # takes a tenth of a second, and help is instant

    return np.frombuffer(base64.b64decode(table["array"]), table["type"]).reshape(table["shape"]).copy()
