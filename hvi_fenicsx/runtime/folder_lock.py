"""The right of one process to write a folder: an advisory lock (flock) on a file beside it; it ends with the process.

The file says who holds it and in which hidden folder the output grows, so that the next one finds what a killed process
left. A file system without flock (some cluster file systems) gives no lock; then nothing of others is removed.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
from pathlib import Path
from typing import Any

from ..errors import InputError

_PROGRAM = "hvi_fenicsx"
_LONGEST = 10_000
"""Bytes of a lock's file at most."""
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
"""What flock ends with where the file system has none."""


class FolderLock:
    """The lock of a folder, held from the beginning.

    Attributes:
        left: the hidden folder that a killed process left, by its name; None if there is none.

    Args:
        target: the folder; that around it must exist.

    Raises:
        InputError: another process holds it, or the file is another program's.
        OSError: the file cannot be written.
    """

    def __init__(self, target: Path) -> None:
        self._target, self._path = target, target.parent / f".{target.name}.hvi-lock"
        self._file = self._taken()
        try:
            record = self._record()
        except BaseException:
            os.close(self._file)
            raise
        self.left = str(record["folder"]) if self._exclusive and record.get("folder") else None

    def _taken(self) -> int:
        """The file, opened and locked."""
        while True:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
            try:
                self._exclusive = self._lock(file)
                if self._is_in_place(file):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)  # the last holder removed it since

    def _lock(self, file: int) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            who = _parsed(os.pread(file, _LONGEST, 0))
            by = f" (process {who['pid']} on {who['host']})" if {"pid", "host"} <= who.keys() else ""
            raise InputError(
                f"--out {self._target}: another run writes into it just now{by}; wait for its end, or choose another "
                "folder"
            ) from None
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise
            return False
        return True

    def _is_in_place(self, file: int) -> bool:
        try:
            return os.path.samestat(os.fstat(file), os.stat(self._path, follow_symlinks=False))
        except FileNotFoundError:
            return False

    def _record(self) -> dict[str, Any]:
        raw = os.pread(self._file, _LONGEST, 0)
        record = _parsed(raw)
        if raw and record.get("program") != _PROGRAM:
            raise InputError(
                f"--out {self._target}: {self._path} marks a folder that is being written, and holds something else; "
                "move it away, or choose another folder"
            )
        return record

    def note(self, folder: str | None) -> None:
        """Say in which hidden folder the output grows.

        Raises:
            OSError: it cannot be written.
        """
        who = {"program": _PROGRAM, "host": socket.gethostname(), "pid": os.getpid(), "folder": folder}
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, json.dumps(who).encode(), 0)

    def release(self, *, keep: bool = False) -> None:
        """Let the folder go; at once or a second time.

        Args:
            keep: leave the note to the next process.
        """
        if self._file < 0:
            return
        if not keep:
            self._path.unlink(missing_ok=True)
        os.close(self._file)
        self._file = -1


def _parsed(raw: bytes) -> dict[str, Any]:
    try:
        found = json.loads(raw)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
