"""The result folder: refused when it holds a result, written aside, renamed when whole. Rank 0 moves files."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
from pathlib import Path
from typing import Literal

from mpi4py import MPI

from ..errors import InputError
from ..runtime.mpi import on_root
from ..runtime.signals import SIGNALS

MARK = "summary.json"
"""A folder with this file holds a finished result; it is always moved last."""
_XML, _PNG = b"</VTKFile>", b"IEND\xaeB`\x82"
_ENDS = {".pvd": _XML, ".vtu": _XML, ".pvtu": _XML, ".png": _PNG, ".html": b"</html>"}
_LONGEST_END = 64
Existing = Literal["refuse", "replace"]


class ResultFolder:
    """A folder for one result.

    Args:
        comm: the ranks that write.
        target: where the result goes.
        existing: what to do with a result that is there already.

    Raises:
        InputError: on all ranks alike: it holds a result or other files, or cannot be written. Collective.
    """

    def __init__(self, comm: MPI.Comm, target: Path, existing: Existing = "refuse") -> None:
        self.comm, self.target = comm, Path(os.path.abspath(target))
        self.work = self.target.parent / f".{self.target.name}.partial"
        self._old = self.target.parent / f".{self.target.name}.old"
        self._made: list[Path] = []
        on_root(comm, lambda: self._open(existing))

    def _open(self, existing: Existing) -> None:
        try:
            self._recover()
            self._check(existing)
            shutil.rmtree(self.work, ignore_errors=True)
            self._made = [folder for folder in self.target.parents if not folder.exists()]
            self.work.mkdir(parents=True)
        except OSError as error:
            raise InputError(
                f"--out {self.target}: cannot be written: {error.strerror or error}; choose another folder"
            ) from None

    def _recover(self) -> None:
        """Put back a result that a killed run had moved aside."""
        if self._old.exists():
            if (self.target / MARK).exists():
                shutil.rmtree(self._old)
            else:
                shutil.rmtree(self.target, ignore_errors=True)
                os.replace(self._old, self.target)

    def _check(self, existing: Existing) -> None:
        if self.target.exists() and not self.target.is_dir():
            raise InputError(f"--out {self.target}: is a file; choose a folder")
        if not self.target.exists() or not any(self.target.iterdir()):
            return
        if not (self.target / MARK).exists():
            raise InputError(f"--out {self.target}: holds other files; choose a new or empty folder")
        if existing == "refuse":
            raise InputError(
                f"--out {self.target}: already holds a result; --force replaces it, --out DIR writes beside"
            )

    def commit(self) -> None:
        """Make the written files the result, all at once. Collective.

        Raises:
            InputError: the folder cannot be renamed, on all ranks alike.
        """
        self.comm.barrier()
        on_root(self.comm, self._commit)

    def _commit(self) -> None:
        held = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            self._refuse_torn()
            self._swap()
        except OSError as error:
            raise InputError(f"--out {self.target}: {error.strerror or error}; the result is in {self.work}") from None
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)

    def _refuse_torn(self) -> None:
        """VTK's writers do not say that a disk was full."""
        for file in sorted(self.work.iterdir()):
            if not _is_whole(file):
                raise InputError(f"--out {self.target}: {file.name} could not be written whole; is the disk full?")

    def _swap(self) -> None:
        if os.path.ismount(self.target):
            self._move_files()
            return
        if self.target.exists():
            os.replace(self.target, self._old)
        os.replace(self.work, self.target)
        shutil.rmtree(self._old, ignore_errors=True)

    def _move_files(self) -> None:
        """Into a mount point, which cannot be renamed: the mark goes first and comes last."""
        (self.target / MARK).unlink(missing_ok=True)
        for file in sorted(self.work.iterdir(), key=lambda f: f.name == MARK):
            shutil.move(file, self.target / file.name)
        self.work.rmdir()

    def discard(self) -> None:
        """Remove what was written, with the folders around it that were made for it. Rank 0 acts; not collective."""
        if self.comm.rank == 0:
            shutil.rmtree(self.work, ignore_errors=True)
            for folder in self._made:
                with contextlib.suppress(OSError):  # not empty: something else is there by now
                    folder.rmdir()


def _is_whole(file: Path) -> bool:
    """Whether a file ends as files of its kind do."""
    end = _ENDS.get(file.suffix)
    return end is None or file.read_bytes()[-_LONGEST_END:].rstrip().endswith(end)
