"""The folder of a result: refused when it holds one, written aside, moved in when whole; whether it is finished."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple, Self

from mpi4py import MPI

from ..errors import NotWrittenError
from ..model import Model, dump_scene
from ..runtime import manifest
from ..runtime.manifest import MARKS, Kind
from ..runtime.mpi import on_root
from .output_folder import Existing, OutputFolder, placed

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
