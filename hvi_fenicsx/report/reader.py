"""A finished result folder: the scene, the summary, the body and the parts of Γc. Read from its files alone."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import HviError
from ..formula import Formula
from ..typing import Array, Integers
from . import solution_arrays
from .body_mesh import BodyMesh, body_mesh
from .contact_part import ContactPart
from .errors import ResultError
from .rounding import without_noise
from .solution_arrays import SolutionArrays

if TYPE_CHECKING:
    from ..laws import Superpotential

FAR = 10.0
"""A body that was not certified, and moved by so many times its size, is on its way off."""


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
        """Whether what was found is a body far away from where it was: no state that anyone wants to see."""
        found = self.arrays.displacement
        if self.certified or found is None:
            return False
        return bool(np.max(np.abs(found)) > FAR * np.max(np.ptp(self.arrays.points, axis=0)))

    @cached_property
    def parts(self) -> tuple[ContactPart, ...]:
        """The parts of Γc, in the order of ``contact.csv``; none where the body is carried off."""
        found = {} if self.carried_off else self.arrays.parts
        return tuple(replace(part, columns=without_noise(part.columns, self.body)) for part in found.values())

    @property
    def sides(self) -> Mapping[str, Integers]:
        """The facets of each boundary table of the scene, (k, 2) or (k, 3)."""
        return self.arrays.sides

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
        """What the effects on a part do (:class:`hvi_fenicsx.effects.Role`)."""
        return [role for where, role in self._roles("boundary") if where == part]

    def _roles(self, place: str) -> list[tuple[str | None, Mapping[str, Any]]]:
        found = [(entry["where"], entry.get("role") or {}) for entry in self.summary.get("effects") or []]
        return [(where, role) for where, role in found if role.get("place") == place]

    @property
    def within(self) -> list[str]:
        """What acts inside of the body, in words; loads first."""
        roles = sorted((role for _, role in self._roles("body")), key=lambda role: role["drive"] != "load")
        return list(dict.fromkeys(role["label"] for role in roles))

    @property
    def driven(self) -> list[tuple[str, str, Any]]:
        """What drives a boundary part without a traction: the part, the effect's key, and its value in the scene.

        These are total loads, and displacements that are not all zero or free.
        """
        found = []
        for entry in self.summary.get("effects") or []:
            role, part, key = entry.get("role") or {}, entry["where"], entry["effect"]
            value = self.scene.get("boundary", {}).get(part, {}).get(key)
            if role.get("place") != "boundary" or value is None or part in self.arrays.loads:
                continue
            total = role["drive"] == "load" and not role["traction"] and role["pressure"] is None
            moved = role["prescribed"] and isinstance(value, list) and any(v not in (0, "free") for v in value)
            if total or moved:
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
        return np.pad(np.array(known[0], dtype=np.float64), (0, 3 - len(known[0]))) if known else None

    def resists(self, part: str, *directions: str) -> bool:
        """Whether a law acts on a displacement of a part.

        Args:
            part: the part's name.
            *directions: any of "slip", "opening", "penetration", or "separation" for opening and slip together.
        """
        return any(self._laws(part, direction) for direction in directions)

    def law(self, part: str, direction: str = "slip") -> Superpotential | None:
        """The law of a part, not smoothed.

        Args:
            part: the part's name.
            direction: the displacement that it acts on: "slip", "opening" or "penetration".

        Returns:
            The law; None if the part has none or several, or one that only its author's program knows.
        """
        from .. import laws  # a tenth of a second, for the picture that asks

        tables = self._laws(part, direction)
        if len(tables) != 1:
            return None
        parameters = {key: value for key, value in tables[0].items() if key != "law"}
        try:
            return laws.create(tables[0]["law"], parameters)
        except HviError:
            return None

    def multipliers(self, part: ContactPart, direction: str = "slip") -> tuple[Array, Array] | None:
        """What tractions and lengths of a part's law are multiplied by at its vertices, (m,); None: not known.

        Args:
            part: the part.
            direction: the displacement that the law acts on.
        """
        found = self._brought(part.name, direction)
        if len(found) != 1:
            return None
        points = part.points.astype(np.float64)
        try:
            return Formula(found[0]["multiplier"]).at(points), Formula(found[0]["length_multiplier"]).at(points)
        except HviError:
            return None

    def _laws(self, part: str, direction: str) -> list[Mapping[str, Any]]:
        """The laws that act on a displacement of a part, as a scene writes them."""
        return [law["law"] for law in self._brought(part, direction)]

    def _brought(self, part: str, direction: str) -> list[Mapping[str, Any]]:
        return [law for role in self.roles(part) for law in role["laws"] if law["direction"] == direction]


def read(folder: Path) -> Result:
    """Read a result folder.

    Raises:
        ResultError: no result is there, or its files are damaged.
    """
    scene, summary = _told(folder / "scene.toml", read_toml), _told(folder / "summary.json", read_json)
    arrays = solution_arrays.load(folder / solution_arrays.FILE)
    return Result(folder=folder, scene=scene, summary=summary, arrays=arrays)


def read_json(path: Path) -> dict[str, Any]:
    """The entries of a file."""
    return dict(json.loads(path.read_text(encoding="utf-8")))


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a file."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _told(path: Path, read: Callable[[Path], dict[str, Any]]) -> dict[str, Any]:
    """Read a file, or say in one line why it cannot be read."""
    try:
        return read(path)
    except OSError as error:
        raise ResultError(f"{path}: {error.strerror or error}; this is no finished result folder") from None
    except (ValueError, KeyError, TypeError) as error:
        raise ResultError(f"{path}: damaged ({error})") from None
