"""What several problems on one mesh have in common: made once, and kept with the mesh."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from mpi4py import MPI

from ..runtime.mpi import agree

Kept = TypeVar("Kept")


class Shared:
    """Objects by name; of each name the last one, so that memory does not grow from problem to problem."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Any, Any]] = {}

    def get(self, comm: MPI.Comm, name: str, origin: Any, make: Callable[[], Kept]) -> Kept:
        """The object that was made from an equal origin, else a new one. Collective.

        Args:
            comm: the ranks of the mesh.
            name: what it is.
            origin: what it is made from besides the mesh; the ranks may have different ones.
            make: makes it. Collective.
        """
        known = name in self._kept and self._kept[name][0] == origin
        if not all(agree(comm, known)):
            self._kept.pop(name, None)  # first, so that there are never two of them
            self._kept[name] = (origin, make())
        found: Kept = self._kept[name][1]
        return found
