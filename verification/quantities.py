"""What is read from a finished result folder, to be compared with what others found.

A quantity is a class named by the table `quantity` of `cases.toml`; the other keys of that table are its fields.
"""

from __future__ import annotations

import csv
import json
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Rows = list[dict[str, str]]
EXPECTATION = frozenset({"quantity", "unit", "value", "tolerance", "from", "miss"})
"""Keys of a table that belong to the expectation, not to the quantity."""


def rows_of(path: Path) -> Rows:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def column(rows: Rows, name: str) -> Array:
    return np.array([float(row[name] or "nan") for row in rows])


@dataclass(frozen=True, kw_only=True)
class Quantity(ABC):
    """One number of a result folder, in the unit of the source (``scale`` times SI)."""

    kinds: ClassVar[dict[str, type[Quantity]]] = {}
    scale: float = 1.0

    def __init_subclass__(cls, *, name: str = "") -> None:
        if name:
            cls.kinds[name] = cls

    @abstractmethod
    def in_si(self, folder: Path) -> float:
        """The number, SI."""

    def read(self, folder: Path) -> float:
        return self.scale * self.in_si(folder)


@dataclass(frozen=True, kw_only=True)
class Summary(Quantity, name="summary"):
    """An entry of ``summary.json``, its key with dots."""

    key: str

    def in_si(self, folder: Path) -> float:
        content = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return float(reduce(lambda table, key: table[key], self.key.split("."), content))


@dataclass(frozen=True, kw_only=True)
class PeakFactor(Summary, name="peak_factor"):
    """The largest factor that a path bears."""

    key: str = "path.peak_factor"


@dataclass(frozen=True, kw_only=True)
class OnPath(Quantity):
    """Force and displacement of a part along a path."""

    part: str
    axis: str

    def curve(self, folder: Path) -> tuple[Array, Array]:
        """Displacement (m) and force (N or N/m), a state each."""
        rows = rows_of(folder / "path.csv")
        return column(rows, f"{self.part}.u{self.axis}"), column(rows, f"{self.part}.f{self.axis}")


@dataclass(frozen=True, kw_only=True)
class PeakForce(OnPath, name="peak_force"):
    """The largest force on the part."""

    def in_si(self, folder: Path) -> float:
        return float(self.curve(folder)[1].max())


@dataclass(frozen=True, kw_only=True)
class DisplacementAtPeak(OnPath, name="displacement_at_peak"):
    """The part's mean displacement where the force is largest."""

    def in_si(self, folder: Path) -> float:
        moved, force = self.curve(folder)
        return float(moved[force.argmax()])


@dataclass(frozen=True, kw_only=True)
class ForceAt(OnPath, name="force_at"):
    """The force at a displacement (m) that rises along the path; linear between two states."""

    displacement: float

    def in_si(self, folder: Path) -> float:
        moved, force = self.curve(folder)
        after = int(np.argmax(moved >= self.displacement))
        around = slice(after - 1, after + 1)
        return float(np.interp(self.displacement, moved[around], force[around]))


@dataclass(frozen=True, kw_only=True)
class LeverAtPeak(Quantity, name="lever_at_peak"):
    """How far a rigid lever's load point goes down at the largest load that falls again.

    The lever stands on the middle and pulls the end.
    """

    lever: float
    half_span: float

    def in_si(self, folder: Path) -> float:
        rows = rows_of(folder / "path.csv")
        at = largest_turn(column(rows, "factor"))
        end, middle = (float(column(rows, f"{part}.uy")[at]) for part in ("end", "middle"))
        return -middle + self.lever / self.half_span * (end - middle)


@dataclass(frozen=True, kw_only=True)
class LargestTurn(Quantity, name="largest_turn"):
    """The largest factor of a path from which it falls again: the load at which a crack grows."""

    def in_si(self, folder: Path) -> float:
        factors = column(rows_of(folder / "path.csv"), "factor")
        return float(factors[largest_turn(factors)])


def largest_turn(factors: Array) -> int:
    """The row of the largest factor from which a path falls again."""
    turns = np.flatnonzero((np.diff(factors[:-1]) >= 0.0) & (np.diff(factors[1:]) < 0.0)) + 1
    return int(turns[factors[turns].argmax()])


@dataclass(frozen=True, kw_only=True)
class OnContact(Quantity):
    """A column of ``contact.csv`` on one part."""

    part: str
    column: str = "sigma_n"

    def values(self, folder: Path) -> Array:
        return column([row for row in rows_of(folder / "contact.csv") if row["part"] == self.part], self.column)


@dataclass(frozen=True, kw_only=True)
class Largest(OnContact, name="largest"):
    """The largest absolute value."""

    def in_si(self, folder: Path) -> float:
        return float(np.nanmax(np.abs(self.values(folder))))


@dataclass(frozen=True, kw_only=True)
class PointContactPeak(OnContact, name="point_contact_peak"):
    """The peak p of p √(1 - r²/a²), fitted to the nodal pressures at the distances r < a from the origin."""

    radius: float

    def in_si(self, folder: Path) -> float:
        rows = [row for row in rows_of(folder / "contact.csv") if row["part"] == self.part]
        shape = np.sqrt(np.clip(1 - (column(rows, "x") ** 2 + column(rows, "y") ** 2) / self.radius**2, 0, None))
        return float(shape @ -column(rows, self.column) / (shape @ shape))


@dataclass(frozen=True, kw_only=True)
class Median(OnContact, name="median"):
    """The median: what stands along a part, whatever happens at its ends."""

    def in_si(self, folder: Path) -> float:
        return float(np.nanmedian(self.values(folder)))


@dataclass(frozen=True, kw_only=True)
class PeakOverLineContact(OnContact, name="peak_over_line_contact"):
    """The largest pressure over that of Hertz's line contact, √(P E*/(π R*)), P being the resultant of the run."""

    modulus: float
    radius: float

    def in_si(self, folder: Path) -> float:
        force = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["resultants"][self.part]
        wanted = np.sqrt(abs(force[1]) * self.modulus / (np.pi * self.radius))
        return float(np.nanmax(np.abs(self.values(folder))) / wanted)


@dataclass(frozen=True, kw_only=True)
class Cattaneo(OnContact):
    """Partial slip on |x| < 1 m of a half-plane, at the tangential force of the run.

    ``bound`` is the largest of the friction's bound, N/m².
    """

    bound: float

    def stick(self, folder: Path) -> float:
        """Half the width of the stick zone in closed form, m."""
        force = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["resultants"][self.part]
        return float(np.sqrt(1.0 - abs(force[0]) / (0.5 * np.pi * self.bound)))

    def points(self, folder: Path) -> Array:
        """The coordinates x of the part's vertices, m."""
        return column([row for row in rows_of(folder / "contact.csv") if row["part"] == self.part], "x")


@dataclass(frozen=True, kw_only=True)
class CattaneoStick(Cattaneo, name="cattaneo_stick"):
    """Half the width between the outermost vertices that stick, and half a cell beyond; over the closed form."""

    column: str = "u_t1"

    def in_si(self, folder: Path) -> float:
        x, slip = self.points(folder), np.abs(self.values(folder))
        stuck = x[slip < 1e-6 * slip.max()]
        return float((np.ptp(stuck) + np.median(np.diff(x))) / 2 / self.stick(folder))


@dataclass(frozen=True, kw_only=True)
class CattaneoMiddle(Cattaneo, name="cattaneo_middle"):
    """The traction at x = 0 over the closed form."""

    def in_si(self, folder: Path) -> float:
        middle = self.values(folder)[np.abs(self.points(folder)).argmin()]
        return float(abs(middle) / (self.bound * (1.0 - self.stick(folder))))


@dataclass(frozen=True, kw_only=True)
class CattaneoTraction(Cattaneo, name="cattaneo_traction"):
    """The traction's projection on that of the closed form."""

    def in_si(self, folder: Path) -> float:
        x, c = self.points(folder), self.stick(folder)
        inner = c * np.sqrt(np.clip(1.0 - (x / c) ** 2, 0.0, None))
        wanted = np.sqrt(np.clip(1.0 - x**2, 0.0, None)) - inner
        return float(np.abs(self.values(folder)) @ wanted / (wanted @ wanted) / self.bound)


@dataclass(frozen=True, kw_only=True)
class SlipOfEquilibrium(Quantity, name="slip_of_equilibrium"):
    """The largest slip in an equilibrium, by its number from 1 in the order of energies."""

    index: int

    def in_si(self, folder: Path) -> float:
        return float(rows_of(folder / "equilibria.csv")[self.index - 1]["max_slip"])


@dataclass(frozen=True, kw_only=True)
class TipOfLowest(Quantity, name="tip_of_lowest"):
    """The largest displacement of a part in the equilibrium of the lowest energy."""

    part: str
    axis: str

    def in_si(self, folder: Path) -> float:
        lowest = folder / rows_of(folder / "equilibria.csv")[0]["folder"]
        rows = [row for row in rows_of(lowest / "boundary.csv") if row["part"] == self.part]
        return float(column(rows, f"u_{self.axis}").max())


def made(table: dict[str, Any]) -> Quantity:
    """The quantity of a table of `cases.toml`."""
    keys = {key: value for key, value in table.items() if key not in EXPECTATION}
    return Quantity.kinds[table["quantity"]](**keys)
