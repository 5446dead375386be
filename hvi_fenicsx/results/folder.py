"""The folder of a result: refused when it holds one, written aside, moved in when whole; whether it is finished."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple, Self

from mpi4py import MPI

from ..errors import InputError, NotWrittenError
from ..model import Model, dump_scene
from ..runtime import manifest
from ..runtime.manifest import MARKS
from ..runtime.mpi import on_root
from .output_folder import Existing, OutputFolder, placed

_XML, _PNG = b"</VTKFile>", b"IEND\xaeB`\x82"
_ENDS = {".pvd": _XML, ".vtu": _XML, ".pvtu": _XML, ".png": _PNG, ".html": b"</html>"}
_LONGEST_END = 64
_READ = ("scene.toml", MARKS["result"])


class ResultFolder:
    """A folder for one result. As a context it is discarded where an exception leaves it.

    Args:
        comm: the ranks that write.
        target: where the result goes.
        existing: what to do with a result that is there already.
        inputs: files that must not be replaced.

    Attributes:
        target: where the result goes, without symbolic links; the same on all ranks, as all attributes.
        work: the hidden folder that the files are to be written into.
        kept: what became of files of others that had the name of one of the result's, in words.

    Raises:
        InputError: on all ranks alike: it holds a result or other files, another run writes it, or it cannot be
            written. Collective.
    """

    def __init__(
        self, comm: MPI.Comm, target: Path, existing: Existing = "refuse", inputs: Iterable[Path] = ()
    ) -> None:
        self.comm = comm
        self.kept: tuple[str, ...] = ()
        self._folder: OutputFolder | None = None
        self.target, self.work = on_root(comm, lambda: self._open(target, existing, inputs))

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

    def _in_words(self, error: NotWrittenError) -> NotWrittenError:
        return placed(error, self.target, self.work) if self._folder is None else self._folder.in_words(error)

    def _open(self, target: Path, existing: Existing, inputs: Iterable[Path]) -> tuple[Path, Path]:
        self._folder = OutputFolder(target, "result")
        self._folder.check(existing, inputs)
        return self._folder.target, self._folder.stage()

    def announce(self, name: str) -> Path:
        """A file in the target itself that grows while the result is made. Rank 0 only.

        Args:
            name: of the file.

        Raises:
            InputError: it cannot be listed.
        """
        assert self._folder is not None
        return self._folder.announce(name)

    def commit(self, scene: Model) -> None:
        """Make the written files the result, all at once. Collective.

        Args:
            scene: what was solved.

        Raises:
            InputError: the files are not whole or cannot be moved, on all ranks alike.
        """
        self.comm.barrier()
        self.kept = on_root(self.comm, lambda: self._commit(scene))

    def _commit(self, scene: Model) -> tuple[str, ...]:
        assert self._folder is not None
        with self._folder.told():
            self._refuse_torn()
        kept = self._folder.move_in(inputs_of(scene, self.target))
        self._folder.close()
        return kept

    def _refuse_torn(self) -> None:
        """VTK's writers do not say that a disk was full."""
        for file in sorted(self.work.iterdir()):
            if file.name.startswith(".") and file.is_file():  # of a picture that was not drawn in time
                file.unlink()
            elif not _is_whole(file):
                raise InputError(f"--out {self.target}: {file.name} could not be written whole; is the disk full?")

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


def _is_whole(file: Path) -> bool:
    """Whether a file ends as files of its kind do."""
    end = _ENDS.get(file.suffix)
    if end is None:
        return True
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - _LONGEST_END))
        return stream.read().rstrip().endswith(end)


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
