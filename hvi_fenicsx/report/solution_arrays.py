"""``solution.npz``: a solution as plain arrays, in SI, for pictures, pages and studies.

This module alone knows the keys of the file. With n vertices and c cells in d dimensions they are:

- ``points`` (n, d) in m; ``cells`` (c, d+1), the vertices of each cell
- ``displacement`` (n, d) in m, or ``escape_mode`` (n, d) where no solution exists
- ``von_mises`` (c,) in N/m²
- ``degree`` of the elements; at degree 2 the vertices are the nodes, and the parts of each cell of the mesh follow one
  another
- ``region:NAME`` (k,), the cells of a region of the mesh
- ``side:NAME`` (k, d), the vertices of each facet of a boundary table of the scene
- ``load:NAME:KEY``, a load there, at m vertices: ``vertices`` (m,), ``traction``
  (m, d) and ``pressure`` (m,) against the boundary in N/m²
- ``part:NAME:KEY``, a part of Γc with m vertices: ``vertices`` (m,), ``facets`` (k, d), ``weights`` (m,), ``normals``
  (m, d), ``drops`` (m, j), and the columns of ``contact.csv`` by their names, (m,) each
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import geometry
from ..errors import HviError
from ..runtime import writing
from ..typing import Array, Integers, Mask

FILE = "solution.npz"
_OF_PART = {"vertices": "vertices", "facets": "facets", "weights": "weight", "normals": "normal", "drops": "drops"}
"""The attributes of a part that are no columns, by their keys."""
NOTHING = 1e-6
"""A pressure, or a length, so small beside the largest is none."""
CONTACT_LENGTHS = ("u_n", "u_t1", "u_t2", "gap")
CONTACT_STRESSES = ("sigma_n", "friction_t1", "friction_t2")
"""Columns of ``contact.csv`` by their unit, m and N/m²."""


class ReportError(HviError):
    """A picture or a page cannot be made; it costs no result."""


class ResultError(ReportError):
    """A folder holds no finished result, or its files are damaged."""


@dataclass(frozen=True, kw_only=True, repr=False)
class ContactPart:
    """A part of Γc with m vertices and k facets, in d dimensions, in the order of ``contact.csv``.

    Attributes:
        name: of its boundary table in the scene.
        columns: the columns of ``contact.csv`` that the part has, (m,) each, by name; NaN where the table is empty.
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
        return geometry.in_space(self.x)

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
        return np.einsum("mk,mkd->md", along, self.tangents)

    def _tangential(self, column: str) -> Array:
        first = self[f"{column}1"]
        return first if self.normal.shape[1] == 2 else np.column_stack([first, self[f"{column}2"]])

    def _pieces(self, column: str) -> Integers | None:
        return self.columns[column].astype(np.int64) if column in self.columns else None


@dataclass(frozen=True, kw_only=True)
class LoadArrays:
    """A load on a side at m vertices, in d dimensions.

    Attributes:
        vertices: the vertices of the body, ascending, (m,).
        traction: N/m², (m, d).
        pressure: N/m², against the boundary, (m,).
    """

    vertices: Integers
    traction: Array
    pressure: Array


@dataclass(frozen=True, kw_only=True)
class SolutionArrays:
    """A solution with n vertices and c cells in d dimensions.

    Attributes:
        points: the vertices, m, (n, d).
        cells: the vertices of each cell, (c, d+1); at degree 2 the parts of a cell follow one another.
        degree: of the elements, 1 or 2.
        displacement: m, (n, d); None where nothing was solved.
        escape_mode: the rigid motion along which the body escapes, (n, d); None where it does not.
        von_mises: the von Mises stress of each cell, N/m², (c,), to seven digits; None where it was not computed.
        sides: the facets of each boundary table of the scene, (k, d), each row ascending.
        regions: the cells of each region of the mesh, (k,).
        loads: by boundary table.
        parts: the parts of Γc by name.
    """

    points: Array
    cells: Integers
    degree: int = 1
    displacement: Array | None = None
    escape_mode: Array | None = None
    von_mises: npt.NDArray[np.float32] | None = None
    sides: Mapping[str, Integers] = field(default_factory=dict)
    regions: Mapping[str, Integers] = field(default_factory=dict)
    loads: Mapping[str, LoadArrays] = field(default_factory=dict)
    parts: Mapping[str, ContactPart] = field(default_factory=dict)


def _members(arrays: SolutionArrays) -> Iterator[tuple[str, Any]]:
    """The arrays by their keys, in the order of the file; those that are None are left out."""
    yield from ((key, value) for key, value in vars(arrays).items() if not isinstance(value, Mapping | None))
    yield from ((f"side:{name}", facets) for name, facets in arrays.sides.items())
    yield from ((f"region:{name}", cells) for name, cells in arrays.regions.items())
    for name, load in arrays.loads.items():
        yield from ((f"load:{name}:{key}", value) for key, value in vars(load).items())
    for name, part in arrays.parts.items():
        own = {key: getattr(part, attribute) for key, attribute in _OF_PART.items()}
        yield from ((f"part:{name}:{key}", value) for key, value in {**own, **part.columns}.items())


def save(path: Path, arrays: SolutionArrays) -> None:
    """Write a solution, whole or not at all.

    Args:
        path: the file.
        arrays: the solution.

    Raises:
        NotWrittenError: it cannot be written.
    """
    with writing.whole(path) as aside, aside.open("wb") as stream:
        np.savez(stream, **dict(_members(arrays)))


def load(path: Path) -> SolutionArrays:
    """Read a solution.

    Raises:
        ResultError: the file is missing or damaged.
    """
    try:
        with np.load(path) as stored:
            if any(member.compress_type for member in stored.zip.infolist()):  # then nothing is larger than the file
                raise ValueError("compressed")
            return _of_members({key: stored[key] for key in stored.files})
    except FileNotFoundError:
        raise ResultError(
            f"{path}: there is no such file; results of earlier versions do not have it: run the scene again"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        raise ResultError(f"{path}: damaged ({error})") from None


def _of_members(members: Mapping[str, Any]) -> SolutionArrays:
    """The arrays from those by their keys."""
    found: dict[str, dict[str, Any]] = {kind: {} for kind in ("", "side", "region", "load", "part")}
    for key, value in members.items():
        kind, _, name = key.partition(":") if ":" in key else ("", "", key)
        if kind in ("load", "part"):
            name, _, own = name.rpartition(":")
            found[kind].setdefault(name, {})[own] = value
        else:
            found[kind][name] = value
    return SolutionArrays(
        **found[""] | {"degree": int(members["degree"])},
        sides=found["side"],
        regions=found["region"],
        loads={name: LoadArrays(**own) for name, own in found["load"].items()},
        parts={name: _part(name, own) for name, own in found["part"].items()},
    )


def _part(name: str, members: dict[str, Any]) -> ContactPart:
    own = {attribute: members.pop(key) for key, attribute in _OF_PART.items()}
    return ContactPart(name=name, columns=members, **own)
