"""The right of one process to write a folder: an advisory lock (flock) on a file beside it; it ends with the process.

A file system without flock (some cluster file systems) gives no lock; then nothing of others is removed.
"""

from __future__ import annotations

import errno
import fcntl
import os
import socket
from pathlib import Path

from ..errors import InputError

_PROGRAM = "hvi_fenicsx"
_LONGEST = 1000
"""Bytes of a lock's file that are read."""
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
"""What flock ends with where the file system has none."""


class FolderLock:
    """The lock of a folder, held from the beginning.

    Attributes:
        was_left: whether a killed process held it before.

    Args:
        target: the folder; that around it must exist.

    Raises:
        InputError: another process holds it, or the file is another program's.
        OSError: the file cannot be written.
    """

    def __init__(self, target: Path) -> None:
        self._target, self._path = target, target.parent / f".{target.name}.hvi-lock"
        self._file, exclusive = -1, False
        try:
            while not self._is_in_place():  # the last holder may have removed it since
                self.release(keep=True)
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
                exclusive = self._lock()
            said = self._said()
            if said and not said.startswith(_PROGRAM):
                words = f"{self._path} marks a folder that is being written, and holds something else"
                raise InputError(f"--out {target}: {words}; move it away, or choose another folder")
            self.was_left = bool(said) and exclusive
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"{_PROGRAM}: process {os.getpid()} on {socket.gethostname()}".encode(), 0)
        except BaseException:
            self.release(keep=True)
            raise

    def _is_in_place(self) -> bool:
        try:
            return self._file >= 0 and os.path.samestat(os.fstat(self._file), os.lstat(self._path))
        except FileNotFoundError:
            return False

    def _lock(self) -> bool:
        """Whether the file system gives a lock."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            by = self._said().removeprefix(f"{_PROGRAM}: ")
            words = f"another run writes into it just now ({by}); wait for its end, or choose another folder"
            raise InputError(f"--out {self._target}: {words}") from None
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise
            return False
        return True

    def _said(self) -> str:
        return os.pread(self._file, _LONGEST, 0).decode("utf-8", "backslashreplace")

    def release(self, *, keep: bool = False) -> None:
        """Let the folder go; at once or a second time.

        Args:
            keep: leave the file, by which the next process knows that something is left.
        """
        if self._file < 0:
            return
        if not keep:
            self._path.unlink(missing_ok=True)
        os.close(self._file)
        self._file = -1
