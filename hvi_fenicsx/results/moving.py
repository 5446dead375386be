"""One process at a time moves whole files into a folder, in the place of those that the program wrote before.

No other file is touched. The right to write is an advisory lock (flock) on a file beside the folder; it ends with the
process. A file system without flock (some cluster file systems) gives no lock; then nothing of others is removed.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import os
import shutil
import socket
from pathlib import Path

from ..errors import InputError
from ..runtime import manifest

_PROGRAM = "hvi_fenicsx"
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
            if os.fstat(self._file).st_nlink > 1 or (said and not said.startswith(_PROGRAM)):
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
        return os.pread(self._file, 1000, 0).decode("utf-8", "backslashreplace")

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


def move_in(work: Path, target: Path) -> tuple[str, ...]:
    """Move the files of a hidden folder into a folder; again, it goes on where it was killed.

    The mark is there only while the manifest and all files belong to it: the manifest comes before it, as a copy, since
    the hidden folder needs its own until the end.

    Args:
        work: the hidden folder, with the manifest of what the other is to hold.
        target: the folder; one that does not exist is the hidden one, renamed.

    Returns:
        What became of files of others that had the name of one of these, in words.

    Raises:
        OSError: a file cannot be moved; what is not yet moved is still there.
    """
    if not target.exists():
        os.rename(work, target)
        return ()
    new, old = manifest.read(work), manifest.read(target)
    assert new is not None
    owned = old.owned if old else frozenset()
    mark = manifest.MARKS[new.kind]
    coming = {name for name in new.files if os.path.lexists(work / name)}
    for name in [*(owned & coming & {mark}), *(owned - new.owned)]:
        _remove(target / name)
    for name in owned & coming:
        if is_folder(target / name):
            _remove(target / name)
    kept = list[str]()
    for name in [*sorted(coming - {mark}), manifest.NAME, *(coming & {mark})]:
        if name == manifest.NAME:
            manifest.write(target, new, work)
            continue
        kept += make_room(target / name, owned=name in owned)
        os.replace(work / name, target / name)
    discard(work)
    return tuple(kept)


def discard(work: Path) -> None:
    """Remove a hidden folder; its manifest first, so that what a kill leaves is not taken for a whole result.

    Args:
        work: the hidden folder.
    """
    with contextlib.suppress(OSError):
        (work / manifest.NAME).unlink(missing_ok=True)
    shutil.rmtree(work, ignore_errors=True)


def _remove(path: Path) -> None:
    """Remove a file, or a result within a result; files of others in that stay, and it with them."""
    if not is_folder(path):
        path.unlink(missing_ok=True)
        return
    found = manifest.read(path)
    for name in sorted(found.owned if found else (), key=lambda name: name == manifest.NAME):
        with contextlib.suppress(IsADirectoryError):
            (path / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # it is not empty
        path.rmdir()


def make_room(goal: Path, *, owned: bool) -> tuple[str, ...]:
    """Give what is of others a new name; what became of it, in words.

    Args:
        goal: the name that a file of the program's is to have.
        owned: whether one that is there is the program's.
    """
    if not os.path.lexists(goal) or (owned and not is_folder(goal)):
        return ()
    names = (goal.with_name(f"{goal.name}.kept" + f"-{n}" * (n > 1)) for n in itertools.count(1))
    aside = next(free for free in names if not os.path.lexists(free))
    os.rename(goal, aside)
    return (f"{goal.name} was there, and not of this program; it is {aside.name} now",)


def is_folder(path: Path) -> bool:
    """Whether it is a folder, and no link to one.

    Args:
        path: of what may be one.
    """
    return path.is_dir() and not path.is_symlink()
