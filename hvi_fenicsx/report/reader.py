"""The finished folders of a result, a load path and a search of all equilibria. Read from their files alone."""

from __future__ import annotations

import csv
import json
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..geometry import ROUNDING, in_space
from ..typing import Array, Mask, magnitude
from . import solution_arrays
from .body_mesh import BodyMesh, body_mesh
from .solution_arrays import CONTACT_LENGTHS, CONTACT_STRESSES, ContactPart, ResultError, SolutionArrays

Row = Mapping[str, str]
"""The cells of a row by the names of the columns."""
_WORDS = ("event", "part")
"""Columns of a path that are no numbers."""


@dataclass(frozen=True, kw_only=True)
class Finished:
    """What every finished folder has.

    Attributes:
        folder: where it was read from.
        scene: what ``scene.toml`` says.
        summary: what ``summary.json`` says.
    """

    folder: Path
    scene: Mapping[str, Any]
    summary: Mapping[str, Any]

    @property
    def title(self) -> str:
        """The scene's title, for headings."""
        return str(self.scene.get("title") or "untitled")

    @property
    def reason(self) -> str:
        """How it ended, as the beginning of a sentence."""
        reason = str(self.summary["reason"])
        return f"{reason[:1].upper()}{reason[1:]}"


F = TypeVar("F", bound=Finished)


@dataclass(frozen=True, kw_only=True)
class Result(Finished):
    """A finished result.

    Attributes:
        arrays: what ``solution.npz`` holds.
    """

    arrays: SolutionArrays

    @cached_property
    def body(self) -> BodyMesh:
        """The body with its fields; without them where it is carried off."""
        if self.carried_off:
            return body_mesh(replace(self.arrays, displacement=None, von_mises=None))
        return body_mesh(self.arrays)

    @cached_property
    def carried_off(self) -> bool:
        """Whether what was found is no equilibrium but a body on its way off, by more than its size."""
        found = self.arrays.displacement
        if self.certified or found is None:
            return False
        return bool(magnitude(found) > np.max(np.ptp(self.arrays.points, axis=0)))

    @cached_property
    def parts(self) -> tuple[ContactPart, ...]:
        """The parts of Γc, in the order of ``contact.csv``; none where the body is carried off."""
        found = {} if self.carried_off else self.arrays.parts
        return tuple(map(self._without_noise, found.values()))

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

    @property
    def last_borne(self) -> Mapping[str, Any] | None:
        """Where the state that is shown is the last that is borne: its load factor and its certificate."""
        return self.summary.get("last_borne")

    @property
    def coarse(self) -> bool:
        """Whether the mesh's estimated error is so large that the numbers are rough."""
        return bool((self.summary.get("estimate") or {}).get("coarse"))

    def roles(self, part: str) -> list[Mapping[str, Any]]:
        """What the effects on a part do (:data:`hvi_fenicsx.problem.effect_summary.Role`)."""
        return [role for where, _, role in self._effects("boundary") if where == part]

    def _effects(self, place: str) -> Iterator[tuple[Any, str, Mapping[str, Any]]]:
        """Where each effect acts, its key and its role."""
        for entry in self.summary.get("effects") or []:
            if (role := entry.get("role") or {}).get("place") == place:
                yield entry["where"], entry["effect"], role

    @property
    def within(self) -> list[str]:
        """What acts inside of the body, in words; loads first."""
        roles = sorted((role for *_, role in self._effects("body")), key=lambda role: role["drive"] != "load")
        return list(dict.fromkeys(role["label"] for role in roles))

    @property
    def driven(self) -> list[tuple[str, str, Any]]:
        """What drives a boundary part without a traction: the part, the effect's key, and its value in the scene.

        These are total loads, and displacements that are not all zero or free.
        """
        found = []
        for part, key, role in self._effects("boundary"):
            value = self.scene.get("boundary", {}).get(part, {}).get(key)
            total = role["drive"] == "load" and not role["traction"] and role["pressure"] is None
            moved = role["prescribed"] and isinstance(value, list) and any(v not in (0, "free") for v in value)
            if value is not None and (total or moved):
                found.append((part, key, value))
        return found

    @property
    def with_laws(self) -> bool:
        """Whether a law acts on any part of Γc."""
        return any(role["laws"] for part in self.parts for role in self.roles(part.name))

    def between_bodies(self, part: str) -> bool:
        """Whether a part is where two bodies meet.

        Args:
            part: its name.
        """
        return part in self.scene.get("interface", {})

    def obstacle(self, part: str) -> Array | None:
        """The unit vector (3,) from a part towards its flat obstacle, if it has one."""
        known = [role["obstacle"] for role in self.roles(part) if role["obstacle"]]
        return in_space(np.array(known[:1], dtype=np.float64))[0] if known else None

    def resists(self, part: str, *directions: str) -> bool:
        """Whether a law acts on a displacement of a part.

        Args:
            part: the part's name.
            *directions: any of "slip", "opening", "penetration", or "separation" for opening and slip together.
        """
        return any(law["direction"] in directions for role in self.roles(part) for law in role["laws"])

    def _without_noise(self, part: ContactPart) -> ContactPart:
        """A part whose columns are zero where they are rounding beside others, or beside the body's field."""
        kept = dict(part.columns)
        for names, field in ((CONTACT_STRESSES, self.body.von_mises), (CONTACT_LENGTHS, self.body.displacement)):
            own = {name: _largest(kept[name]) for name in names if name in kept}
            least = ROUNDING * max([*own.values(), 0.0 if field is None else _largest(field)], default=0.0)
            kept |= {name: 0.0 * kept[name] for name, largest in own.items() if largest <= least}
        return replace(part, columns=kept)


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


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
        return self.columns["stable"] == 1.0

    @cached_property
    def driven(self) -> str | None:
        """The part that is drawn: of those that the factor drives the one whose force goes the longest way.

        Where no force does, as under a moment, the one that moves most.
        """
        scaled = {str(name).rpartition(".")[0] for name in self.path["scaled"]}
        parts = list(self.path["peak_forces"])
        known = [part for part in parts if part in scaled] or parts
        return max(known, key=self._way) if known else None

    def _way(self, part: str) -> tuple[float, float]:
        """The way of a part times its force, and the way."""
        u, force = (magnitude(values) for values in self.along(part))
        return u * force, u

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
        if not self.rows:
            return "J/m"
        own = _parsed(self.folder / self.rows[0]["folder"] / "summary.json", json.loads)["resultants"]
        return "J" if any(len(force) > 2 for force in own.values()) else "J/m"

    def state(self, row: Row) -> list[Row]:
        """The rows of ``contact.csv`` of an equilibrium; none where there is neither contact nor law.

        Args:
            row: of :attr:`rows`.
        """
        file = self.folder / row["folder"] / "contact.csv"
        return _rows(file) if file.exists() else []


def read(folder: Path) -> Result:
    """Read a result folder.

    Raises:
        ResultError: no result is there, or its files are damaged.
    """
    return _read(folder, lambda words: Result(**words, arrays=solution_arrays.load(folder / solution_arrays.FILE)))


def read_path(folder: Path) -> PathResult:
    """Read the folder of a load path.

    Raises:
        ResultError: no load path is there, or its files are damaged.
    """

    def made(words: dict[str, Any]) -> PathResult:
        rows = _rows(folder / "path.csv")
        columns = {
            name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0] if name not in _WORDS
        }
        return PathResult(**words, columns=columns, events=[row["event"] for row in rows])

    return _read(folder, made)


def read_equilibria(folder: Path) -> EquilibriaResult:
    """Read the folder of a search.

    Raises:
        ResultError: no search is there, or its files are damaged.
    """
    return _read(folder, lambda words: EquilibriaResult(**words, rows=_rows(folder / "equilibria.csv")))


def _parsed(path: Path, parse: Callable[[str], Any]) -> dict[str, Any]:
    """The entries of a file; an error that names it."""
    try:
        return dict(parse(path.read_text(encoding="utf-8")))
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from None


def _rows(path: Path) -> list[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _read(folder: Path, make: Callable[[dict[str, Any]], F]) -> F:
    """What is made of the words in a folder and of its other files, or one line on why that cannot be read."""
    try:
        scene, summary = _parsed(folder / "scene.toml", tomllib.loads), _parsed(folder / "summary.json", json.loads)
        return make({"folder": folder, "scene": scene, "summary": summary})
    except OSError as error:
        raise ResultError(f"{error.filename}: {error.strerror}; this is no finished result folder") from None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ResultError(f"{folder}: damaged ({error})") from None
