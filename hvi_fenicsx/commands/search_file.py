"""What is left of a search for equilibria, in a file of the result folder while it goes on: a kill loses little."""

from __future__ import annotations

import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .. import results
from ..errors import NotWrittenError
from ..runtime import writing
from ..scene import Scene
from ..stationary_points.found import Saved
from . import telling
from .target import identity
from .telling import COMM

NAME = "search.npz"
BETWEEN = 2.0
"""Seconds at least between two states that are kept."""
SHARE = 0.05
"""The share of the time that keeping them may take."""
_IDENTITY = "identity"


class SearchFile:
    """Keeps the state of a search; rank 0 writes.

    Args:
        folder: the result's, being written.
        scene: whose equilibria are searched.
    """

    def __init__(self, folder: results.ResultFolder, scene: Scene) -> None:
        self._folder, self._identity = folder, np.array(identity(scene, folder.target))
        self._next, self._broken = time.monotonic() + BETWEEN, False

    def keep(self, state: Callable[[], Saved]) -> None:
        """Write the state, if it is time.

        Args:
            state: makes it.
        """
        if COMM.rank or self._broken or time.monotonic() < self._next:
            return
        began = time.monotonic()
        try:
            self._write(state())
        except NotWrittenError as error:
            self._broken = True
            telling.LOG.info("%s; a kill would lose the search", error)
        now = time.monotonic()
        self._next = now + max(BETWEEN, (now - began) / SHARE)

    def _write(self, state: Saved) -> None:
        file = self._folder.announce(NAME)
        with writing.whole(file) as aside, aside.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **{_IDENTITY: self._identity, **state})

    def write_left(self, state: Saved) -> None:
        """Write what a search that was stopped has left, as a file of the result. Rank 0 only.

        Args:
            state: what is left; nothing is written where it is empty.
        """
        if state:
            content, file = {_IDENTITY: self._identity, **state}, self._folder.work / NAME
            with writing.told(file):
                np.savez_compressed(file, allow_pickle=False, **content)


def read(target: Path, scene: Scene) -> Saved | None:
    """The state of an earlier search of the same scene on as many ranks; None where there is none. Rank 0 only.

    Args:
        target: the folder of the result.
        scene: the scene.
    """
    try:
        with np.load(target / NAME, allow_pickle=False) as arrays:
            found = dict(arrays)
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None
    return found if found.pop(_IDENTITY, None) == np.array(identity(scene, target)) else None
