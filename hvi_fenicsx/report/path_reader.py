"""The finished folder of a load path: scene, summary and the columns of ``path.csv``. Read from its files alone."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..typing import Array, Mask
from .errors import ResultError
from .reader import title_of

_WORDS = frozenset({"event", "part"})
"""Columns that are no numbers."""
_NOTHING = 1e-9
"""Work so small beside the largest force on the largest displacement is none."""


@dataclass(frozen=True, kw_only=True)
class PathResult:
    """A finished load path.

    Attributes:
        folder: where it was read from.
        scene: what ``scene.toml`` says.
        summary: what ``summary.json`` says.
        columns: the numbers of ``path.csv`` by their names, (rows,) each; NaN where a cell is empty.
        events: its column ``event``, (rows,).
    """

    folder: Path
    scene: Mapping[str, Any]
    summary: Mapping[str, Any]
    columns: Mapping[str, Array]
    events: Sequence[str]

    @property
    def path(self) -> Mapping[str, Any]:
        """The summary's entry."""
        return dict(self.summary["path"])

    @property
    def title(self) -> str:
        """The scene's title."""
        return title_of(self.scene)

    @cached_property
    def axes(self) -> str:
        """The coordinates that the body has, as letters."""
        return "xyz" if any(name.endswith(".fz") for name in self.columns) else "xy"

    @cached_property
    def stable(self) -> Mask:
        """Which rows are stable, (rows,)."""
        return np.asarray(self.columns["stable"] == 1.0)

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

    def vectors(self, part: str, kind: str) -> Array:
        """The forces or displacements of a part, (rows, d).

        Args:
            part: its name.
            kind: "f" for forces, "u" for displacements.
        """
        return np.column_stack([self.columns[f"{part}.{kind}{axis}"] for axis in self.axes])

    def along(self, part: str) -> tuple[Array, Array]:
        """Mean displacement and force of a part in the direction of its largest force, (rows,) each.

        Where no force acts on it, in that of its largest displacement.

        Args:
            part: its name.
        """
        forces, displacements = self.vectors(part, "f"), self.vectors(part, "u")
        leading = forces if np.any(forces) else displacements
        sizes = np.linalg.norm(leading, axis=1)
        strongest = leading[int(np.argmax(sizes))] / (np.max(sizes) or 1.0)
        return displacements @ strongest, forces @ strongest


def read(folder: Path) -> PathResult:
    """Read the folder of a load path.

    Raises:
        ResultError: no load path is there, or its files are damaged.
    """
    try:
        summary = dict(json.loads((folder / "summary.json").read_text(encoding="utf-8")))
        scene = dict(tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8")))
        with (folder / "path.csv").open(newline="", encoding="utf-8") as stream:
            names, *rows = list(csv.reader(stream))
        table = dict(zip(names, zip(*rows, strict=True), strict=True))
        columns = {
            n: np.array([float(v) if v else np.nan for v in cells]) for n, cells in table.items() if n not in _WORDS
        }
        return PathResult(folder=folder, scene=scene, summary=summary, columns=columns, events=table["event"])
    except OSError as error:
        raise ResultError(f"{folder}: {error.strerror or error}; this is no finished load path") from None
    except (ValueError, KeyError, TypeError) as error:
        raise ResultError(f"{folder}: damaged ({error})") from None
