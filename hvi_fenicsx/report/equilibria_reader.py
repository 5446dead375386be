"""The finished folder of ``hvi equilibria``: scene, summary, and the rows of its tables. Read from its files alone."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import ResultError
from .reader import title_of

Row = Mapping[str, str]
"""The cells of a row by the names of the columns."""


@dataclass(frozen=True, kw_only=True)
class EquilibriaResult:
    """A finished search.

    Attributes:
        folder: where it was read from.
        scene: what ``scene.toml`` says.
        summary: what ``summary.json`` says.
        rows: of ``equilibria.csv``, by energy.
    """

    folder: Path
    scene: Mapping[str, Any]
    summary: Mapping[str, Any]
    rows: Sequence[Row]

    @property
    def title(self) -> str:
        """The scene's title."""
        return title_of(self.scene)

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
        if not self.rows:
            return "J/m"
        own = json.loads((self.folder / self.rows[0]["folder"] / "summary.json").read_text(encoding="utf-8"))
        return "J" if any(len(force) > 2 for force in own["resultants"].values()) else "J/m"

    def state(self, row: Row) -> list[Row]:
        """The rows of ``contact.csv`` of an equilibrium; none where there is neither contact nor law.

        Args:
            row: of :attr:`rows`.
        """
        file = self.folder / row["folder"] / "contact.csv"
        return _table(file) if file.exists() else []


def read(folder: Path) -> EquilibriaResult:
    """Read the folder of a search.

    Raises:
        ResultError: no search is there, or its files are damaged.
    """
    try:
        summary = dict(json.loads((folder / "summary.json").read_text(encoding="utf-8")))
        scene = dict(tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8")))
        return EquilibriaResult(folder=folder, scene=scene, summary=summary, rows=_table(folder / "equilibria.csv"))
    except OSError as error:
        raise ResultError(f"{folder}: {error.strerror or error}; this is no finished search") from None
    except (ValueError, KeyError, TypeError) as error:
        raise ResultError(f"{folder}: damaged ({error})") from None


def _table(path: Path) -> list[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
