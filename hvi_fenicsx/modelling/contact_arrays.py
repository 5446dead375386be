"""A part of Γc as arrays over its vertices, in SI, the same on all ranks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from .. import geometry
from ..report.solution_arrays import PartArrays
from ..typing import Array, Integers, Mask


@dataclass(frozen=True, kw_only=True)
class ContactArrays:
    """A part with m vertices in d dimensions, in the order of ``contact.csv``: in 2D along the part.

    Attributes:
        x: the vertices, m, (m, d).
        s: in 2D the arc length, m, (m,); None in 3D.
        weight: the area of each vertex, m (2D) or m², (m,).
        normal: outward unit normals, (m, d).
        tangents: unit tangents, (m, d-1, d).
        displacement: u·n, m, (m,).
        gap: the distance to the obstacle, m, (m,); NaN where there is no contact.
        slip: u_t, m: (m,) in 2D, (m, 2) in 3D, along the tangents.
        pressure: -σ_n, positive where the part is pressed, N/m², (m,).
        friction: -σ_t, N/m², as ``slip``; NaN where no law of the slip acts.
        active: whether the vertex is in contact, (m,).
        branch: the active piece of the law of the slip, from 0, -1 on a kink; (m,); None where there is no such law.
        normal_branch: that of the law of the opening or penetration, likewise.
    """

    x: Array
    s: Array | None
    weight: Array
    normal: Array
    tangents: Array
    displacement: Array
    gap: Array
    slip: Array
    pressure: Array
    friction: Array
    active: Mask
    branch: Integers | None
    normal_branch: Integers | None

    @classmethod
    def of(cls, part: PartArrays) -> Self:
        """The arrays of a part as results have them."""
        columns = part.columns
        slip = _tangential(columns, "u_t")
        return cls(
            x=np.column_stack([columns[axis] for axis in "xyz" if axis in columns]),
            s=columns.get("s"),
            weight=part.weights,
            normal=part.normals,
            tangents=geometry.tangents(part.normals),
            displacement=columns["u_n"],
            gap=columns.get("gap", np.full(len(part.weights), np.nan)),
            slip=slip,
            pressure=-columns["sigma_n"],
            friction=_tangential(columns, "friction_t") if "friction_t1" in columns else np.full_like(slip, np.nan),
            active=columns.get("contact", np.zeros(len(part.weights))) == 1.0,
            branch=_pieces(columns, "branch_t"),
            normal_branch=_pieces(columns, "branch_n"),
        )

    def __len__(self) -> int:
        return len(self.x)

    def __repr__(self) -> str:
        closed = int(np.count_nonzero(self.active))
        return f"ContactArrays({len(self)} vertices, {closed} in contact)"


class ContactParts(dict[str, ContactArrays]):
    """The arrays of all parts by name."""

    def __missing__(self, part: str) -> ContactArrays:
        raise KeyError(f"no contact and no law acts on {part!r}; there are: {', '.join(self) or 'none'}")


def _tangential(columns: Mapping[str, Array], name: str) -> Array:
    first = columns[f"{name}1"]
    return np.column_stack([first, columns[f"{name}2"]]) if f"{name}2" in columns else first


def _pieces(columns: Mapping[str, Array], name: str) -> Integers | None:
    return columns[name].astype(np.int64) if name in columns else None
