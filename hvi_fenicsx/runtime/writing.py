"""Files of folders that others may have filled: written whole or not at all, read only where that is safe; journals.

A file is written new, beside its place or in a folder of the program's own, and renamed: no link is followed. One is
read if it is a file, and small beside the memory; what it holds may still be of any form.

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
import stat
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from io import BufferedReader
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import InputError, NotWrittenError, of_user

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_LARGEST = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 16
"""Bytes of a file that are read at once."""
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


@contextlib.contextmanager
def whole(file: Path, within: Path | None = None) -> Iterator[Path]:
    """A name at which nothing is, to write to; renamed to the file when all went well, else removed.

    Args:
        file: that is to be there in the end.
        within: the folder where it is written, on the same disk; by default its own.

    Raises:
        NotWrittenError: it could not be written.
    """
    aside = (within or file.parent) / f".{file.name}.part"
    with told(file):
        aside.unlink(missing_ok=True)
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


def opened(file: Path) -> BufferedReader:
    """A file to be read, which is no device and no pipe.

    Args:
        file: which one.

    Raises:
        OSError: it cannot be read.
    """
    stream = open(file, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))  # noqa: SIM115
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(errno.EINVAL, "is no file", str(file))
    return stream


def content(file: Path) -> bytes:
    """All that is in a file.

    Args:
        file: which one.

    Raises:
        OSError: it cannot be read, or is larger than the memory allows.
    """
    with opened(file) as stream:
        if os.fstat(stream.fileno()).st_size > _LARGEST:
            raise OSError(errno.EFBIG, "is too large to be read", str(file))
        return stream.read()


def understood(file: Path) -> contextlib.AbstractContextManager[None]:
    """Say of a file that what it holds is not what the program writes.

    Args:
        file: what is in it is used in the block.

    Raises:
        InputError: it is not.
    """
    return of_user(f"{file}: is not as the program wrote it; --force begins anew")


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
    """A journal; rank 0 only. Its file is begun by the first record that is added.

    Args:
        path: the file.
        identity: what the computation is of, and by what.
        within: the folder where it is written until it is whole; by default its own.
        anew: whether what is there is not gone on with.
        begin: is called before the file is begun.

    Attributes:
        records: what it held already, if that is of the same computation.

    Raises:
        InputError: it is of another one.
    """

    def __init__(
        self,
        path: Path,
        identity: Sequence[str],
        within: Path | None = None,
        *,
        anew: bool = False,
        begin: Callable[[], object] = lambda: None,
    ) -> None:
        self._path, self._identity, self._within, self._begin = path, identity, within, begin
        self.records = [] if anew else read_journal(path, identity)
        self._file: BinaryIO | None = None

    def append(self, record: Record) -> None:
        """Add a record; a process that is killed afterwards leaves it whole.

        Args:
            record: numbers, texts, None, arrays or tables of these.

        Raises:
            NotWrittenError: it cannot be written; the records before it are there.
        """
        if self._file is None:
            self._file = self._begun([*self.records, record])
            return
        with told(self._path):
            self._file.write(_line(record))
            self._file.flush()

    def replace(self, record: Record) -> None:
        """Have this record in the place of all others.

        Args:
            record: as for :meth:`append`.

        Raises:
            NotWrittenError: it cannot be written; what was there still is.
        """
        self._begun([record]).close()

    def _begun(self, records: Iterable[Record]) -> BinaryIO:
        """A file of these records, open, in the place of what is there."""
        self._begin()
        with whole(self._path, self._within) as aside:
            aside.write_bytes(b"".join(map(_line, [{"identity": self._identity}, *records])))
            file = aside.open("ab")
        return file

    def close(self) -> None:
        """Close the file; a power cut harms it no more.

        Raises:
            NotWrittenError: it could not be written.
        """
        if self._file is not None:
            with told(self._path), self._file:
                os.fsync(self._file.fileno())


def read_journal(path: Path, identity: Sequence[str]) -> list[Record]:
    """The records of a journal; none where there is no journal, or one of the same computation by other means.

    Args:
        path: the file.
        identity: what the computation is of, and by what.

    Raises:
        InputError: it is of another computation.
    """
    with understood(path):
        found = content(path) if os.path.lexists(path) else b""
        first, *records = [*_records(found)] or [{"identity": identity}]
        if first["identity"][0] != identity[0]:
            raise InputError(f"{path}: is of another scene or reference; --force begins anew, --out DIR writes beside")
        return records if first["identity"] == identity else []


def _records(text: bytes) -> Iterator[Record]:
    """Records, up to the first that is not whole."""
    for line in text.splitlines(keepends=True):
        checksum, _, record = line.partition(b" ")
        if checksum != _checksum(record) or not record.endswith(b"\n"):
            return
        yield json.loads(record, object_hook=_with_array)


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
