"""The folder of a result or a study: one process at a time fills it, with whole files; no other file is touched.

The files are written into a hidden folder of their own beside it (in it, where it is a mount point). A new folder is
that one, renamed. In a folder that exists the program's earlier files make room: the mark goes first, and comes last,
after the manifest. A process that is killed between leaves the hidden folder with its manifest; the next one goes on
from there.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

from mpi4py import MPI

from ..errors import InputError, NotWrittenError
from ..model import Model, dump_scene
from ..runtime import manifest, processes, writing
from ..runtime.manifest import MARKS, Kind, Manifest
from ..runtime.mpi import on_root
from ..runtime.processes import SIGNALS
from .moving import FolderLock, discard, is_folder, move_in

Existing = Literal["refuse", "replace", "resume"]
_WAYS = {
    "result": "--force (force=True in Python) replaces it",
    "study": "--resume keeps its finished points, --force begins anew",
}
"""What a user may do with a folder that is there, by its kind."""
_UNFINISHED = "--resume goes on with it, --force begins anew"
"""And with one that a killed process has left."""


def existing(*, force: bool) -> Existing:
    """What to do with a folder of this kind that is there already.

    Args:
        force: whether it may be replaced.
    """
    return "replace" if force else "refuse"


class OutputFolder:
    """A folder that this process alone writes, from its making to :meth:`close`. Not collective.

    Args:
        target: the folder; a symbolic link stands for what it points to.
        kind: what goes into it.

    Raises:
        InputError: another process writes it, or it cannot be written.
    """

    def __init__(self, target: Path, kind: Kind) -> None:
        self.kind, self.target = kind, resolved(target)
        self.work: Path | None = None
        self._left, self._announced = False, list[str]()
        with self.told():
            self._made = [folder for folder in self.target.parents if not folder.exists()]
            self.target.parent.mkdir(parents=True, exist_ok=True)
            self._lock = FolderLock(self.target)
            around = self.target if os.path.ismount(self.target) else self.target.parent
            self._hidden = around / f".{self.target.name}.hvi-new"
            with self._closed_on_error():
                self._recover()

    def _recover(self) -> None:
        """Go on where a killed process was: a whole result is moved in, another one removed."""
        if self._lock.was_left and is_folder(self._hidden):
            self._left = True  # until it is done, the next one must find it too
            self._finish(self._hidden)
            self._left = False
        self._remove_half()

    def _remove_half(self) -> None:
        """Remove a manifest that a killed process did not write whole: with an older one, or in a new folder alone."""
        half = writing.half_of(self.target / manifest.NAME)
        if half.exists() and (manifest.read(self.target) is not None or [*self.target.iterdir()] == [half]):
            half.unlink()

    def _finish(self, left: Path) -> None:
        if manifest.read(left) is not None:
            move_in(left, self.target)
        else:
            shutil.rmtree(left)

    def check(self, existing: Existing, inputs: Iterable[Path] = ()) -> None:
        """Refuse a folder that may not be written.

        Args:
            existing: what to do with a folder of this kind that is there already.
            inputs: files that must not be replaced.

        Raises:
            InputError: it holds other files, or such a folder; it would replace an input; it may not be written.
        """
        with self.told(), self._closed_on_error():
            if not self.target.exists():
                return
            if not self.target.is_dir():
                raise self._refused("is a file; choose a folder")
            if not os.access(self.target, os.W_OK | os.X_OK):
                raise PermissionError(errno.EACCES, "", str(self.target))  # now, not after hours
            if any(self.target.iterdir()):
                self._check_files(existing, inputs)

    def _check_files(self, existing: Existing, inputs: Iterable[Path]) -> None:
        found = manifest.read(self.target)
        if found is None:
            text = f"holds other files, and no {manifest.NAME} of this program; choose a new or empty folder"
            raise self._refused(text)
        if found.kind != self.kind:
            raise self._refused(f"holds a {found.kind}, and this is a {self.kind}; choose a new or empty folder")
        if existing == "refuse":
            finished = (self.target / MARKS[self.kind]).exists()
            state, ways = "already holds a", _WAYS[self.kind]
            if not finished:
                state, ways = "holds an unfinished", _UNFINISHED
            raise self._refused(f"{state} {self.kind}; {ways}, --out DIR writes beside")
        owned = {self.target / name for name in found.owned}
        for file in inputs:
            if Path(os.path.realpath(file)) in owned:
                raise self._refused(f"{file}, which is to be read, would be replaced; choose another folder")

    def stage(self) -> Path:
        """Make the hidden folder that the files are to be written into.

        Raises:
            InputError: it cannot be made.
        """
        with self.told(), self._closed_on_error():
            self._hidden.mkdir()
        self.work = self._hidden
        return self.work

    def announce(self, name: str) -> Path:
        """A file in the folder itself, to be written while the others are not there yet, and listed at once.

        Args:
            name: of the file.

        Raises:
            InputError: it cannot be listed.
        """
        with self.told():
            if not self.target.exists():
                self.target.mkdir()
                self._made.insert(0, self.target)
            if manifest.read(self.target) is None:
                manifest.write(self.target, Manifest(kind=self.kind, files={}))
            manifest.add(self.target, [name], changing=True)
        self._announced.append(name)
        return self.target / name

    def move_in(self, inputs: Mapping[str, str], other: Mapping[str, str | None] | None = None) -> tuple[str, ...]:
        """Make the written files the folder's, in the place of those that the program wrote before.

        Args:
            inputs: SHA-256 of the files that the scene named, by their name there.
            other: files in the folder that stay, as a manifest lists them.

        Returns:
            What became of files of others that had the name of one of these, in words.

        Raises:
            InputError: files cannot be written or moved.
        """
        assert self.work is not None
        with self.told():
            files = {**manifest.listed(self.work), **(other or {})}
            manifest.write(self.work, Manifest(kind=self.kind, files=files, inputs=inputs))
        try:
            with processes.held(SIGNALS):
                kept = move_in(self.work, self.target)
                self.work = None
        except OSError as error:
            self._left = True
            raise self._refused(
                f"{error.strerror or error}; the whole {self.kind} is in {self.work}, the next run into this folder "
                "moves it there"
            ) from None
        return kept

    def close(self) -> None:
        """Let the folder go, and remove what was not moved in, with the empty folders around it that were made."""
        if self.work is not None and not self._left:
            discard(self.work)
        self._lock.release(keep=self._left)
        for folder in self._made:
            with contextlib.suppress(OSError):  # not empty: something else is there by now
                folder.rmdir()

    @contextlib.contextmanager
    def _closed_on_error(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self.close()
            raise

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
            inside = any(file.is_relative_to(folder) for folder in (self.work, self.target) if folder)
            raise self.in_words(writing.not_written(file if inside else self.target, error.errno)) from None
        except NotWrittenError as error:
            raise self.in_words(error) from None

    def in_words(self, error: NotWrittenError) -> NotWrittenError:
        """The error of a file in the words of the user, who knows this folder, and what it still has.

        Args:
            error: of a file that could not be written.
        """
        found = placed(error, self.target, self.work)
        if found is error or not any((self.target / name).exists() for name in self._announced):
            return found
        words = f"{found}; what is finished is kept, --resume goes on from there"
        return NotWrittenError(found.file, found.reason, words)

    def _refused(self, reason: str) -> InputError:
        return InputError(f"--out {self.target}: {reason}")


def placed(error: NotWrittenError, target: Path, work: Path | None) -> NotWrittenError:
    """The error of a file as one in the folder that a user knows; one of another file as it is.

    Args:
        error: of the file.
        target: the folder.
        work: the hidden one, in which its files are written.
    """
    for folder in filter(None, (work, target)):
        if error.file.is_relative_to(folder):
            file = target / error.file.relative_to(folder)
            name = f"{file.relative_to(target)} " if file != target else ""
            return NotWrittenError(file, error.reason, f"--out {target}: {name}could not be written: {error.reason}")
    return error


def resolved(target: Path) -> Path:
    """A folder without symbolic links.

    Raises:
        InputError: the links go round in a circle.
    """
    try:
        found = target.resolve()
    except (OSError, RuntimeError) as error:
        raise InputError(f"--out {target}: {error}; choose another folder") from None
    if found.is_symlink():  # Python 3.13 and later hand a circle back
        raise InputError(f"--out {target}: its symbolic links go round in a circle; choose another folder")
    return found


_READ = ("scene.toml", MARKS["result"])


class ResultFolder:
    """A folder for one result, or a study. As a context it is discarded where an exception leaves it.

    Args:
        comm: the ranks that write.
        target: where the result goes.
        existing: what to do with a result that is there already.
        inputs: files that must not be replaced.
        kind: what goes into it.

    Attributes:
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
        existing: Existing = "refuse",
        inputs: Iterable[Path] = (),
        kind: Kind = "result",
    ) -> None:
        self.comm = comm
        self.kept: tuple[str, ...] = ()
        self._folder: OutputFolder | None = None

        def opened() -> tuple[Path, Path]:
            self._folder = OutputFolder(target, kind)
            self._folder.check(existing, inputs)
            return self._folder.target, self._folder.stage()

        self.target, self.work = on_root(comm, opened)

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
            words = placed(error, self.target, self.work) if self._folder is None else self._folder.in_words(error)
            raise words from None

    @property
    def _own(self) -> OutputFolder:
        """The folder itself. Rank 0 only."""
        assert self._folder is not None
        return self._folder

    def announce(self, name: str) -> Path:
        """A file in the target itself that grows while the result is made. Rank 0 only.

        Args:
            name: of the file.

        Raises:
            InputError: it cannot be listed.
        """
        return self._own.announce(name)

    def commit(self, scene: Model, keep: Iterable[str] = ()) -> None:
        """Make the written files the result, all at once. Collective.

        Args:
            scene: what was solved.
            keep: the announced files that stay.

        Raises:
            InputError: the files cannot be moved, on all ranks alike.
        """

        def move() -> tuple[str, ...]:
            kept = self._own.move_in(inputs_of(scene, self.target), dict.fromkeys(keep))
            self._own.close()
            return kept

        self.comm.barrier()
        self.kept = on_root(self.comm, move)

    def discard(self) -> None:
        """Remove what was written, with the folders around it that were made for it. Rank 0 acts; not collective."""
        if self._folder is not None:
            self._folder.close()


def inputs_of(scene: Model, folder: Path) -> dict[str, str]:
    """SHA-256 of the files that a scene names.

    Args:
        scene: the scene.
        folder: from which their paths are given.
    """
    files = [*scene.files(), *map(Path, scene.plugins or ())]
    return {os.path.relpath(file, folder): manifest.digest(file) or "" for file in files}


class Finished(NamedTuple):
    """A folder that should hold a result of a scene.

    Attributes:
        record: what ``summary.json`` says; None where there is no such result, or not as it was written.
        fault: why a result that is there cannot be kept; None where nothing is wrong with it.
    """

    record: dict[str, Any] | None = None
    fault: str | None = None


def read_finished(target: Path, scene: Model) -> Finished:
    """The result of a scene in a folder, if one is there, whole and of the same mesh files and plugins.

    Args:
        target: the folder, without symbolic links.
        scene: the scene.
    """
    found = manifest.read(target)
    if found is None or found.kind != "result":
        return Finished()
    damaged = found.damaged(target)
    if damaged is None:
        damaged = next((name for name in _READ if not found.files.get(name)), None)  # listed without what was in it
    if damaged is not None:
        return Finished(fault=f"{damaged} is not as it was written")
    if (target / "scene.toml").read_text(encoding="utf-8") != dump_scene(scene, target):
        return Finished()
    if found.inputs != inputs_of(scene, target):
        return Finished(fault="a file that the scene reads has changed")
    return Finished(json.loads((target / MARKS["result"]).read_text(encoding="utf-8")))
