"""How far one solution is from another: relative errors of the quantities that people ask for, on the reference's mesh.

Every sample is first brought onto the reference's vertices (:mod:`.interpolation`), where the energy norm is that of
the reference's stiffness and integrals over Γc are sums over its lumped areas.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from ..typing import Array, Mask
from . import interpolation
from .solution_fields import PartFields, SolutionFields

JUMP_WIDTHS = 2.0
"""So many facets of the coarser mesh about a jump of the law count as near it."""
QUANTITIES: Mapping[str, str] = {
    "energy_norm": "displacement, energy norm",
    "u_t_l2": "u_t on Γc, L2",
    "u_t_max": "u_t on Γc, largest",
    "friction_l1": "-σ_t on Γc, L1",
    "friction_l2": "-σ_t on Γc, L2",
    "friction_max": "-σ_t on Γc, largest away from the law's jumps",
    "pressure_l1": "-σ_n on Γc, L1",
    "pressure_l2": "-σ_n on Γc, L2",
    "contact_set": "area where one is closed and the other open, over the closed area",
    "resultant": "resultant of -σ_n, over the integral of its size",
    "friction_force": "resultant of -σ_t, over the integral of its size",
}
"""What is measured, each relative to the reference's own size in the same norm."""
Errors = dict[str, float | None]


@dataclass(frozen=True)
class Moved:
    """A sample on the reference's vertices: u (n, d), columns by part; and its own mesh width on each part, m."""

    u: Array
    parts: Mapping[str, Mapping[str, Array]]
    widths: Mapping[str, float]


class Yardstick:
    """The reference that others are measured against.

    Args:
        sample: the reference. stiffness: of its mesh, in its numbering.
    """

    def __init__(self, sample: SolutionFields, stiffness: sparse.csr_array) -> None:
        self.sample, self.stiffness = sample, stiffness
        self._bodies: dict[tuple[bytes, bytes], Any] = {}
        self.here = self.move(sample)

    def move(self, sample: SolutionFields) -> Moved:
        """A sample on this mesh. The way from a mesh is found once."""
        key = (sample.points.tobytes(), sample.cells.tobytes())
        if key not in self._bodies:
            parts = {n: interpolation.surface(sample.parts[n], p.points) for n, p in self.sample.parts.items()}
            self._bodies = {key: (interpolation.body(sample, self.sample.points), parts)}
        way, along = self._bodies[key]
        columns = {
            name: {key: way @ getattr(sample.parts[name], key) for key in ("slip", "friction", "pressure", "contact")}
            for name, way in along.items()
        }
        return Moved(way @ sample.u, columns, {name: _width(part) for name, part in sample.parts.items()})

    def errors(self, found: Moved, other: Moved | None = None) -> Errors:
        """How far ``found`` is from the reference, or from ``other``; None where there is nothing to measure."""
        against = other or self.here
        result: Errors = {"energy_norm": _ratio(self._energy(found.u - against.u), self._energy(self.here.u))}
        for name, size in (("u_t", "slip"), ("friction", "friction"), ("pressure", "pressure")):
            result |= {f"{name}_{norm}": self._surface(found, against, size, norm) for norm in ("l1", "l2", "max")}
        result["contact_set"] = self._contact_set(found, against)
        result["resultant"] = self._resultant(found, against, "pressure")
        result["friction_force"] = self._resultant(found, against, "friction")
        return {key: result[key] for key in QUANTITIES}

    def left_out(self, found: Moved) -> float:
        """The share of Γc near jumps of the law, which ``friction_max`` leaves out."""
        parts = self.sample.parts
        out = sum(float(p.weights[self._near(name, found)].sum()) for name, p in parts.items())
        return out / (sum(float(p.weights.sum()) for p in parts.values()) or 1.0)

    def _energy(self, u: Array) -> float:
        flat = u.ravel()
        return math.sqrt(max(0.0, float(flat @ (self.stiffness @ flat))))

    def _surface(self, found: Moved, against: Moved, column: str, norm: str) -> float | None:
        error = size = 0.0
        for name, part in self.sample.parts.items():
            values = self.here.parts[name][column]
            difference = _length(found.parts[name][column] - against.parts[name][column])
            size = _sum(size, _length(values), part.weights, norm)
            if column == "friction" and norm == "max":
                difference = difference[~self._near(name, found)]
                if not len(difference):
                    return None
            error = _sum(error, difference, part.weights, norm)
        return _ratio(math.sqrt(error), math.sqrt(size)) if norm == "l2" else _ratio(error, size)

    def _near(self, name: str, found: Moved) -> Mask:
        """The vertices within some facets of the found mesh of where the reference's slip passes a drop of the law."""
        part = self.sample.parts[name]
        places = _jumps(part)
        if not len(places):
            return np.zeros(len(part.points), dtype=bool)
        away = np.linalg.norm(part.points[:, None] - places[None], axis=2).min(axis=1)
        return np.asarray(away <= JUMP_WIDTHS * found.widths[name])

    def _contact_set(self, found: Moved, against: Moved) -> float | None:
        wrong = closed = 0.0
        for name, part in self.sample.parts.items():
            one, other, true = (m.parts[name]["contact"] > 0.5 for m in (found, against, self.here))
            wrong += float(part.weights[one != other].sum())
            closed += float(part.weights[true].sum())
        return _ratio(wrong, closed) if any(p.bounded for p in self.sample.parts.values()) else None

    def _resultant(self, found: Moved, against: Moved, column: str) -> float | None:
        """Relative to the sum of the tractions' sizes: a resultant itself may be zero."""
        difference: Array = np.zeros(self.sample.points.shape[1])
        size = 0.0
        for name, part in self.sample.parts.items():
            values, other, true = (m.parts[name][column] for m in (found, against, self.here))
            away = values - other
            if away.ndim == 1:
                difference = difference + part.weights @ (away[:, None] * part.normals)
            else:  # tangents may turn along a part: of -σ_t the components along them are added
                difference = difference + np.pad(part.weights @ away, (0, 1))
            size += float(part.weights @ _length(true))
        return _ratio(float(np.linalg.norm(difference)), size)


def _width(part: PartFields) -> float:
    corners = part.points[part.facets]
    return float(np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), initial=0.0))


def _jumps(part: PartFields) -> Array:
    """The middles of the facets on which the slip passes a drop of the law; (k, d)."""
    slip = part.slip[:, 0] if part.slip.shape[1] == 1 else np.linalg.norm(part.slip, axis=1)
    low, high = (f(slip[part.facets], axis=1)[:, None] for f in (np.min, np.max))
    passed = np.any((low <= part.drops) & (part.drops <= high), axis=1)
    return np.asarray(part.points[part.facets[passed]].mean(axis=1))


def _length(values: Array) -> Array:
    return np.abs(values) if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def _sum(so_far: float, values: Array, weights: Array, norm: str) -> float:
    if norm == "max":
        return max(so_far, float(np.max(values, initial=0.0)))
    return so_far + float(weights @ values ** {"l1": 1, "l2": 2}[norm])


def _ratio(error: float, size: float) -> float | None:
    return error / size if size > 0.0 else None
