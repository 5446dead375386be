"""The folder of a result or a study: one process at a time fills it, with whole files; no other file is touched.

The files are written into a hidden folder of their own beside it (in it, where it is a mount point). A new folder is
that one, renamed. In a folder that exists the program's earlier files make room: the mark goes first, and comes last,
after the manifest. A process that is killed between leaves the hidden folder with its manifest; the next one goes on
from there.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from mpi4py import MPI

from ..errors import InputError, NotWrittenError
from ..model import Model, dump_scene
from ..runtime import manifest, processes, writing
from ..runtime.manifest import MARKS, Kind, Manifest
from ..runtime.mpi import on_root
from .moving import FolderLock, discard, is_folder, make_room, move_in

_WAYS = "--resume goes on with what is unfinished, --force (force=True in Python) replaces it, --out DIR writes beside"
"""What a user may do with a folder that is there."""


def resolved(target: Path) -> Path:
    """A folder without symbolic links.

    Raises:
        InputError: the links go round in a circle.
    """
    found = Path(os.path.realpath(target))
    if found.is_symlink():  # it hands a circle back
        raise InputError(f"--out {target}: its symbolic links go round in a circle; choose another folder")
    return found


class ResultFolder:
    """A folder for one result, or a study. As a context it is discarded where an exception leaves it.

    Args:
        comm: the ranks that write.
        target: where the result goes; a symbolic link stands for what it points to.
        force: whether a result that is there already is replaced.
        resume: whether one of its kind is gone on with.
        inputs: files that must not be replaced.
        kind: what goes into it.

    Attributes:
        journal: grows in the target while the result is made; on rank 0, after :meth:`begin_journal`.
        unfinished: whether it stays.
        target: where the result goes, without symbolic links; the same on all ranks, as all attributes.
        work: the hidden folder that the files are to be written into.
        kept: what became of files of others that had the name of one of the result's, in words.

    Raises:
        InputError: on all ranks alike: it holds a result or other files, another run writes it, or it cannot be
            written. Collective.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        target: Path,
        *,
        force: bool = False,
        resume: bool = False,
        inputs: Iterable[Path] = (),
        kind: Kind = "result",
    ) -> None:
        self.comm, self.kind, self.kept = comm, kind, tuple[str, ...]()
        self._force, self._resume, self._staged, self._left, self.unfinished = force, resume, False, False, False
        self._journal, self._made = "", list[Path]()
        self._lock: FolderLock | None = None
        self.target, self.work = on_root(comm, lambda: self._opened(resolved(target), inputs))

    def _opened(self, target: Path, inputs: Iterable[Path]) -> tuple[Path, Path]:
        """Lock the folder and make the hidden one. Rank 0 only."""
        around = target if os.path.ismount(target) else target.parent
        self.target, self.work = target, around / f".{target.name}.hvi-new"
        try:
            with self.told():
                self._made += [folder for folder in target.parents if not folder.exists()]
                target.parent.mkdir(parents=True, exist_ok=True)
                self._lock = FolderLock(target)
                self._recover(was_left=self._lock.was_left)
                self._check(inputs)
                self.work.mkdir()
                self._staged = True
        except BaseException:
            self.discard()
            raise
        return self.target, self.work

    def _recover(self, *, was_left: bool) -> None:
        """Go on where a killed process was: a whole result is moved in, another one removed."""
        if was_left and is_folder(self.work):
            self._left = True  # until it is done, the next one must find it too
            if manifest.read(self.work) is not None:
                move_in(self.work, self.target)
            else:
                shutil.rmtree(self.work)
            self._left = False

    def _check(self, inputs: Iterable[Path]) -> None:
        """Refuse a folder that may not be written, or whose files may not be replaced."""
        if not self.target.exists():
            return
        if not self.target.is_dir():
            raise self._refused("is a file; choose a folder")
        if not os.access(self.target, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "", str(self.target))  # now, not after hours
        found = manifest.read(self.target)
        if found is None:
            if any(self.target.iterdir()):
                raise self._refused(
                    f"holds other files, and no {manifest.NAME} of this program; choose a new or empty folder"
                )
            return
        if found.kind != self.kind and not (self._force and MARKS[found.kind] == MARKS[self.kind]):
            raise self._refused(f"holds a {found.kind}, not a {self.kind}; --force replaces all but a study")
        if not (self._force or self._resume):
            finished = (self.target / MARKS[self.kind]).exists()
            raise self._refused(f"{'already holds a' if finished else 'holds an unfinished'} {self.kind}; {_WAYS}")
        owned = {self.target / name for name in found.owned}
        for file in inputs:
            if Path(os.path.realpath(file)) in owned:
                raise self._refused(f"{file}, which is to be read, would be replaced; choose another folder")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: object) -> None:
        """Leave nothing behind of a result that was not finished; not collective.

        Raises:
            NotWrittenError: a file could not be written, in the words of the user.
        """
        if kind is not None:
            self.discard()
        if isinstance(error, NotWrittenError):
            raise self._in_words(error) from None

    def begin_journal(self, name: str, identity: Sequence[str]) -> list[writing.Record]:
        """What a journal in the target has, if it is gone on with. Rank 0 only.

        Args:
            name: of the file.
            identity: what the computation is of, and by what.

        Raises:
            InputError: what is there cannot be gone on with.
        """
        self._journal, file = name, self.target / name
        self.journal = writing.Journal(file, identity, self.work, anew=not self._resume, begin=self._announce)
        return self.journal.records

    def _announce(self) -> None:
        """List the journal in the target."""
        with self.told():
            if not self.target.exists():
                self.target.mkdir()
                self._made.insert(0, self.target)
            name, known = self._journal, manifest.read(self.target) or Manifest(kind=self.kind, files={})
            self.kept += make_room(self.target / name, owned=name in known.files)
            files = {**known.files, name: None}
            manifest.write(self.target, replace(known, kind=self.kind, files=files), self.work)

    def commit(self, scene: Model) -> None:
        """Make the written files the result, all at once, in the place of those that were written before. Collective.

        Args:
            scene: what was solved.

        Raises:
            InputError: the files cannot be written or moved, on all ranks alike.
        """
        self.comm.barrier()
        self.kept = on_root(self.comm, lambda: self._moved_in(inputs_of(scene, self.target)))

    def _moved_in(self, inputs: Mapping[str, str]) -> tuple[str, ...]:
        """Move the files in; what became of files of others, in words. Rank 0 only."""
        with self.told():
            there = manifest.read(self.target)
            stay = {self._journal} & set(there.files if there and self.unfinished else ())
            files = {**manifest.listed(self.work), **dict.fromkeys(stay)}
            manifest.write(self.work, Manifest(kind=self.kind, files=files, inputs=inputs))
        try:
            with processes.held(processes.SIGNALS):
                kept = move_in(self.work, self.target)
                self._staged = False
        except (OSError, NotWrittenError) as error:
            self._left = True
            raise self._refused(
                f"{getattr(error, 'strerror', error)}; the whole {self.kind} is in {self.work}, the next run into this "
                "folder moves it there"
            ) from None
        self.discard()
        return (*self.kept, *kept)

    def discard(self) -> None:
        """Let the folder go; remove what was not moved in, and the empty folders that were made. Not collective."""
        if self._staged and not self._left:
            discard(self.work)
        if self._lock is not None:
            self._lock.release(keep=self._left)
        for folder in self._made:
            with contextlib.suppress(OSError):  # not empty: something else is there by now
                folder.rmdir()

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """Say of what the file system refuses where the output was to go.

        Raises:
            NotWrittenError: what was refused, and why.
        """
        try:
            yield
        except OSError as error:
            file = Path(error.filename or self.target)
            inside = any(file.is_relative_to(folder) for folder in (self.work, self.target))
            raise self._in_words(writing.not_written(file if inside else self.target, error.errno)) from None
        except NotWrittenError as error:
            raise self._in_words(error) from None

    def _in_words(self, error: NotWrittenError) -> NotWrittenError:
        """The error of a file in the words of the user, who knows this folder; that of another file as it is."""
        around = next((folder for folder in (self.work, self.target) if error.file.is_relative_to(folder)), None)
        if around is None:
            return error
        file = self.target / error.file.relative_to(around)
        name = f"{file.relative_to(self.target)} " if file != self.target else ""
        words = f"--out {self.target}: {name}could not be written: {error.reason}"
        if self._journal and (self.target / self._journal).exists():
            words += "; what is finished is kept, --resume goes on from there"
        return NotWrittenError(file, error.reason, words)

    def _refused(self, reason: str) -> InputError:
        return InputError(f"--out {self.target}: {reason}")


def inputs_of(scene: Model, folder: Path) -> dict[str, str]:
    """SHA-256 of the files that a scene names.

    Args:
        scene: the scene.
        folder: from which their paths are given.
    """
    files = [*scene.files(), *map(Path, scene.plugins or ())]
    return {os.path.relpath(file, folder): manifest.digest(file) or "" for file in files}


_READ = ("scene.toml", MARKS["result"])


def read_finished(target: Path, scene: Model, kind: Kind) -> tuple[dict[str, Any] | None, str | None]:
    """The result of a scene in a folder, if one is there, whole and of the same mesh files and plugins.

    Args:
        target: the folder, without symbolic links.
        scene: the scene.
        kind: of what is asked for.

    Returns:
        What ``summary.json`` says, None where there is no such result; why one that is there cannot be kept.

    Raises:
        InputError: it is of another scene, and no single run, which is soon run again.
    """
    found = manifest.read(target)
    if found is None or found.kind != kind or MARKS["result"] not in found.files:
        return None, None
    of = found.files.get("scene.toml")
    if of and of != hashlib.sha256(dump_scene(scene, target).encode()).hexdigest():
        if kind != "result":
            raise InputError(f"--out {target}: holds another scene; {_WAYS}")
        return None, None
    unknown = next((name for name in _READ if not found.files.get(name)), None)  # listed without what was in it
    if damaged := found.damaged(target) or unknown:
        return None, f"{damaged} is not as it was written"
    if found.inputs != inputs_of(scene, target):
        return None, "a file that the scene reads has changed"
    return json.loads(writing.content(target / MARKS["result"])), None
