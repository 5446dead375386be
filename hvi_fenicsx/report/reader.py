"""What a result folder tells: the scene, the summary, Γc as a table. Read from its files alone."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..errors import HviError
from ..typing import Array, Mask
from .pictures.draw import PictureError

if TYPE_CHECKING:
    from ..laws import Superpotential

T = TypeVar("T")
NUMBERS = ("s", "x", "y", "z", "u_n", "u_t1", "u_t2", "gap", "sigma_n", "friction_t1", "friction_t2")
STATES = ("contact", "branch_t", "branch_n")


@dataclass(frozen=True)
class Part:
    """A part of Γc: its name and the columns of ``contact.csv`` by name, each (m,), NaN where the file has nothing."""

    name: str
    columns: Mapping[str, Array]

    def __getitem__(self, column: str) -> Array:
        return self.columns[column]

    def has(self, column: str) -> bool:
        """Whether the file has any value in it."""
        return bool(np.isfinite(self.columns[column]).any())

    @property
    def points(self) -> Array:
        """The vertices (m, 3), in the file's order."""
        return np.nan_to_num(np.column_stack([self["x"], self["y"], self["z"]]))

    @property
    def spatial(self) -> bool:
        """Whether it is a surface in space rather than a line in the plane."""
        return self.has("z")

    @property
    def slip(self) -> Array:
        """Signed slip in the plane, length of the slip in space."""
        return _tangential(self["u_t1"], self["u_t2"])

    @property
    def friction(self) -> Array:
        """-σ_t in the plane, its length in space."""
        return _tangential(self["friction_t1"], self["friction_t2"])

    @property
    def pressure(self) -> Array:
        """-σ_n: positive where the part is pressed."""
        return -self["sigma_n"]

    @property
    def idle(self) -> Mask:
        """Vertices that are lifted and carry nothing; where something adheres, a lifted one may."""
        stress = np.nan_to_num(np.abs(self["sigma_n"]))
        return self.lifted & (stress <= 1e-6 * stress.max(initial=0.0))

    @property
    def lifted(self) -> Mask:
        """Vertices off the obstacle; none where the part has no contact."""
        return self["contact"] == 0.0


def _tangential(first: Array, second: Array) -> Array:
    return np.hypot(first, second) if np.isfinite(second).any() else first


@dataclass(frozen=True)
class Result:
    """A folder's tables.

    Attributes:
        scene, summary: as the files have them. parts: Γc. sides: vertices (m, 3) of the boundary tables, by name.
    """

    folder: Path
    scene: Mapping[str, Any]
    summary: Mapping[str, Any]
    parts: tuple[Part, ...]
    sides: Mapping[str, Array] = field(default_factory=dict)

    @property
    def solvability(self) -> Mapping[str, Any]:
        """The summary's entry, empty if there is none."""
        return self.summary.get("solvability") or {}

    @property
    def solved(self) -> bool:
        """Whether there was a solution to look for."""
        return self.solvability.get("state") != "escapes"

    @property
    def certified(self) -> bool:
        """Whether the certificate was passed."""
        return bool((self.summary.get("certificate") or {}).get("passed"))

    def _on(self, part: str) -> Mapping[str, Any]:
        return (self.scene.get("boundary") or {}).get(part) or {}

    @property
    def within(self) -> list[str]:
        """What acts inside of the body, in words."""
        body = self.scene.get("body") or {}
        named = {key for name, value in body.items() for key in (value if isinstance(value, dict) else [name])}
        words = {"force": "a force on the body itself", "temperature": "a change of temperature"}
        return [said for key, said in words.items() if key in named]

    def obstacle(self, part: str) -> Array | None:
        """The unit vector (3,) from a part towards its flat obstacle, if it has one."""
        contact = self._on(part).get("contact") or {}
        normal = np.array((contact.get("obstacle") or {}).get("normal") or [], dtype=np.float64)
        return np.pad(-normal / np.linalg.norm(normal), (0, 3 - len(normal))) if normal.any() else None

    def acts(self, part: str, key: str) -> bool:
        """Whether an effect is in force on a part."""
        return key in self._on(part)

    def law(self, part: str, key: str = "friction") -> Superpotential | None:
        """The law of a part, not smoothed; None if it has none, or one that only its author's program knows."""
        from .. import laws  # a tenth of a second, for the picture that asks

        table = dict(self._on(part).get(key) or {})
        try:
            return laws.create(table.pop("law"), table)
        except (HviError, KeyError):
            return None


def read(folder: Path) -> Result:
    """Read a folder's tables; ``contact.csv`` and ``boundary.csv`` may be missing.

    Raises:
        PictureError: no result is there, or its files are damaged.
    """
    scene = _read(folder / "scene.toml", lambda text: dict(tomllib.loads(text)))
    summary = _read(folder / "summary.json", lambda text: dict(json.loads(text)))
    table, sides = folder / "contact.csv", folder / "boundary.csv"
    parts = _read(table, _parts) if table.exists() else ()
    return Result(folder, scene, summary, parts, _read(sides, _sides) if sides.exists() else {})


def _read(path: Path, parse: Callable[[str], T]) -> T:
    try:
        return parse(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PictureError(f"{path}: {error.strerror or error}; pictures need a finished result folder") from None
    except (ValueError, KeyError, TypeError) as error:
        raise PictureError(f"{path}: damaged ({error})") from None


def _parts(text: str) -> tuple[Part, ...]:
    rows = csv.DictReader(text.splitlines())
    return tuple(_part(name, list(own)) for name, own in groupby(rows, key=lambda row: row["part"]))


def _part(name: str, rows: list[dict[str, str]]) -> Part:
    return Part(name, {c: np.array([float(row[c]) if row[c] else np.nan for row in rows]) for c in (*NUMBERS, *STATES)})


def _sides(text: str) -> dict[str, Array]:
    rows = [(row["part"], [float(row[c] or 0.0) for c in "xyz"]) for row in csv.DictReader(text.splitlines())]
    return {name: np.array([point for _, point in own]) for name, own in groupby(rows, key=lambda row: row[0])}
