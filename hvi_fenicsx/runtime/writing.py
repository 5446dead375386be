"""Files that are written whole or not at all, and what is said of one that cannot be written."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

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
