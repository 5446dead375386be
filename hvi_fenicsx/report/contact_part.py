"""A part of Γc as arrays over its vertices, in SI: what results, pictures, studies and Python users have of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .. import geometry
from ..typing import Array, Integers, Mask

NOTHING = 1e-6
"""A pressure, or a length, so small beside the largest is none."""


@dataclass(frozen=True, kw_only=True, repr=False)
class ContactPart:
    """A part of Γc with m vertices and k facets, in d dimensions, in the order of ``contact.csv``.

    Attributes:
        name: of its boundary table in the scene.
        columns: the columns of ``contact.csv`` that the part has, (m,) each, in the order of that table; NaN where the
            table is empty.
        vertices: the vertices of the body, (m,).
        facets: segments or triangles by the vertices of the body, (k, d), each row ascending.
        weight: lumped lengths or areas of the vertices, m or m², (m,).
        normal: outward unit normals, (m, d).
        drops: the slips at which the friction law drops at each vertex, m, (m, j).
    """

    name: str
    columns: Mapping[str, Array]
    vertices: Integers
    facets: Integers
    weight: Array
    normal: Array
    drops: Array

    def __len__(self) -> int:
        return len(self.vertices)

    def __repr__(self) -> str:
        return f"ContactPart({self.name!r}, {len(self)} vertices, {np.count_nonzero(self.active)} in contact)"

    def __getitem__(self, column: str) -> Array:
        """A column of the table, (m,); NaN where the table is empty."""
        return self.columns.get(column, np.full(len(self), np.nan))

    def has(self, column: str) -> bool:
        """Whether the table has any value in it."""
        return bool(np.isfinite(self[column]).any())

    @property
    def x(self) -> Array:
        """The vertices, m, (m, d)."""
        return np.column_stack([self.columns[axis] for axis in "xyz" if axis in self.columns])

    @property
    def points(self) -> Array:
        """The vertices in space, m, (m, 3)."""
        return np.nan_to_num(np.column_stack([self["x"], self["y"], self["z"]]))

    @property
    def s(self) -> Array | None:
        """The arc length in 2D, m, (m,); None in 3D."""
        return self.columns.get("s")

    @property
    def tangents(self) -> Array:
        """Unit tangents, (m, d-1, d)."""
        return geometry.tangents(self.normal)

    @property
    def displacement(self) -> Array:
        """u·n, m, (m,)."""
        return self["u_n"]

    @property
    def gap(self) -> Array:
        """The distance to the obstacle, m, (m,); NaN where there is no contact."""
        return self["gap"]

    @property
    def slip(self) -> Array:
        """u_t, m: (m,) in 2D, (m, 2) in 3D, along the tangents."""
        return self._tangential("u_t")

    @property
    def friction(self) -> Array:
        """-σ_t, N/m², as :attr:`slip`; NaN where no law of the slip acts."""
        return self._tangential("friction_t")

    @property
    def pressure(self) -> Array:
        """-σ_n, N/m², (m,): positive where the part is pressed."""
        return -self["sigma_n"]

    @property
    def active(self) -> Mask:
        """Whether each vertex is in contact, (m,)."""
        return self["contact"] == 1.0

    @property
    def lifted(self) -> Mask:
        """Vertices off the obstacle, (m,); none where the part has no contact."""
        return self["contact"] == 0.0

    @property
    def idle(self) -> Mask:
        """Vertices that are lifted and carry nothing, (m,); where something adheres, a lifted one may."""
        stress = np.nan_to_num(np.abs(self["sigma_n"]))
        return self.lifted & (stress <= NOTHING * stress.max(initial=0.0))

    @property
    def branch(self) -> Integers | None:
        """The active piece of the law of the slip, from 0, -1 on a kink, (m,); None where there is no such law."""
        return self._pieces("branch_t")

    @property
    def normal_branch(self) -> Integers | None:
        """That of the law of the opening or penetration, likewise."""
        return self._pieces("branch_n")

    @property
    def largest_gap(self) -> float:
        """The largest distance of a lifted vertex from the obstacle, m; 0 where none is lifted."""
        return float(np.nanmax(self.gap[self.lifted], initial=0.0))

    def at(self, rows: Mask) -> ContactPart:
        """Some of its vertices, with all facets."""
        own = {name: getattr(self, name)[rows] for name in ("vertices", "weight", "normal", "drops")}
        return replace(self, columns={name: values[rows] for name, values in self.columns.items()}, **own)

    def size(self, quantity: str) -> Array:
        """The signed value of a tangential quantity in the plane, its length in space, (m,).

        Args:
            quantity: "slip" or "friction".
        """
        values: Array = getattr(self, quantity)
        return values if values.ndim == 1 else np.linalg.norm(values, axis=1)

    def vectors(self, quantity: str) -> Array:
        """A tangential quantity as vectors, (m, d): tangents may turn their sign from vertex to vertex of a curve.

        Args:
            quantity: "slip" or "friction".
        """
        along = getattr(self, quantity).reshape(len(self), -1)
        return np.asarray(np.einsum("mk,mkd->md", along, self.tangents))

    def _tangential(self, column: str) -> Array:
        first = self[f"{column}1"]
        return first if self.normal.shape[1] == 2 else np.column_stack([first, self[f"{column}2"]])

    def _pieces(self, column: str) -> Integers | None:
        return self.columns[column].astype(np.int64) if column in self.columns else None
