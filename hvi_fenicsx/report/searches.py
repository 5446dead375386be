"""The finished folders of a load path and of a search of all equilibria. Read from their files alone."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..typing import Array, Mask
from .errors import ResultError
from .reader import Finished, read_json, read_toml

T = TypeVar("T")
Row = Mapping[str, str]
"""The cells of a row by the names of the columns."""
_WORDS = frozenset({"event", "part"})
"""Columns of a path that are no numbers."""
_NOTHING = 1e-9
"""Work so small beside the largest force on the largest displacement is none."""


@dataclass(frozen=True, kw_only=True)
class PathResult(Finished):
    """A finished load path.

    Attributes:
        columns: the numbers of ``path.csv`` by their names, (rows,) each; NaN where a cell is empty.
        events: its column ``event``, (rows,).
    """

    columns: Mapping[str, Array]
    events: Sequence[str]

    @property
    def path(self) -> Mapping[str, Any]:
        """The summary's entry."""
        return dict(self.summary["path"])

    @cached_property
    def axes(self) -> str:
        """The coordinates that the body has, as letters."""
        return "xyz" if any(name.endswith(".fz") for name in self.columns) else "xy"

    @cached_property
    def stable(self) -> Mask:
        """Which rows are stable, (rows,)."""
        return np.asarray(self.columns["stable"] == 1.0)

    @property
    def largest_force(self) -> float:
        """The largest component of a force on any part, N or N/m."""
        return max((abs(f) for found in self.path["peak_forces"].values() for f in found["force"]), default=0.0)

    @cached_property
    def driven(self) -> str | None:
        """The part that is drawn: of those that the factor drives the one whose force goes the longest way.

        Where no force does, as under a moment, the one that moves most.
        """
        scaled = {str(name).rpartition(".")[0] for name in self.path["scaled"]}
        parts = list(self.path["peak_forces"])
        known = [part for part in parts if part in scaled] or parts
        ways = {part: [float(np.max(np.abs(values))) for values in self.along(part)] for part in known}
        largest = [max((way[k] for way in ways.values()), default=0.0) for k in (0, 1)]
        done = max((u * force for u, force in ways.values()), default=0.0)
        worked = done > _NOTHING * largest[0] * largest[1]
        return max(known, key=lambda part: ways[part][0] * (ways[part][1] if worked else 1.0), default=None)

    def along(self, part: str) -> tuple[Array, Array]:
        """Mean displacement and force of a part in the direction of its largest force, (rows,) each.

        Where no force acts on it, in that of its largest displacement.

        Args:
            part: its name.
        """
        forces, displacements = (
            np.column_stack([self.columns[f"{part}.{kind}{axis}"] for axis in self.axes]) for kind in "fu"
        )
        leading = forces if np.any(forces) else displacements
        sizes = np.linalg.norm(leading, axis=1)
        strongest = leading[int(np.argmax(sizes))] / (np.max(sizes) or 1.0)
        return displacements @ strongest, forces @ strongest


@dataclass(frozen=True, kw_only=True)
class EquilibriaResult(Finished):
    """A finished search.

    Attributes:
        rows: of ``equilibria.csv``, by energy.
    """

    rows: Sequence[Row]

    @property
    def known(self) -> Mapping[str, Any]:
        """The summary's entry."""
        return dict(self.summary["equilibria"])

    @property
    def energies(self) -> tuple[float, ...]:
        """The energies of the equilibria, J/m or J."""
        return tuple(float(row["energy"]) for row in self.rows)

    @property
    def unit(self) -> str:
        """The unit of energy: J in space, where forces have three components."""
        own = read_json(self.folder / self.rows[0]["folder"] / "summary.json")["resultants"] if self.rows else {}
        return "J" if any(len(force) > 2 for force in own.values()) else "J/m"

    def state(self, row: Row) -> list[Row]:
        """The rows of ``contact.csv`` of an equilibrium; none where there is neither contact nor law.

        Args:
            row: of :attr:`rows`.
        """
        file = self.folder / row["folder"] / "contact.csv"
        return _rows(file) if file.exists() else []


def read_path(folder: Path) -> PathResult:
    """Read the folder of a load path.

    Raises:
        ResultError: no load path is there, or its files are damaged.
    """

    def read() -> PathResult:
        rows = _rows(folder / "path.csv")
        numbers = [name for name in rows[0] if name not in _WORDS]
        columns = {name: np.array([float(row[name] or "nan") for row in rows]) for name in numbers}
        return PathResult(**_words(folder), columns=columns, events=[row["event"] for row in rows])

    return _finished(folder, "load path", read)


def read_equilibria(folder: Path) -> EquilibriaResult:
    """Read the folder of a search.

    Raises:
        ResultError: no search is there, or its files are damaged.
    """
    return _finished(
        folder, "search", lambda: EquilibriaResult(**_words(folder), rows=_rows(folder / "equilibria.csv"))
    )


def _words(folder: Path) -> dict[str, Any]:
    summary, scene = read_json(folder / "summary.json"), read_toml(folder / "scene.toml")
    return {"folder": folder, "scene": scene, "summary": summary}


def _finished(folder: Path, what: str, read: Callable[[], T]) -> T:
    """Read a folder, or say in one line why it cannot be read."""
    try:
        return read()
    except OSError as error:
        raise ResultError(f"{folder}: {error.strerror or error}; this is no finished {what}") from None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ResultError(f"{folder}: damaged ({error})") from None


def _rows(path: Path) -> list[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
