"""``solution.npz``: a solution as plain arrays, in SI, for pictures, pages and studies.

This module alone knows the keys of the file. With n vertices and c cells in d dimensions they are:

- ``points`` (n, d) in m; ``cells`` (c, d+1), the vertices of each cell
- ``displacement`` (n, d) in m, or ``escape_mode`` (n, d) where no solution exists
- ``von_mises`` (c,) in N/m²
- ``degree`` of the elements; at degree 2 the vertices are the nodes, and the parts of each cell of the mesh follow one
  another
- ``region:NAME`` (k,), the cells of a region of the mesh
- ``side:NAME`` (k, d), the vertices of each facet of a boundary table of the scene
- ``load:NAME:KEY``, a load there that no formula of the scene tells, at m vertices: ``vertices`` (m,), ``traction``
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

from ..runtime import writing
from ..typing import Array, Integers
from .contact_part import ContactPart
from .errors import ResultError

Singles = npt.NDArray[np.float32]
"""Real numbers in single precision, whose seven digits are enough for a stress."""
FILE = "solution.npz"
_OF_PART = {"vertices": "vertices", "facets": "facets", "weights": "weight", "normals": "normal", "drops": "drops"}
"""The attributes of a part that are no columns, by their keys."""
_SIDE, _REGION, _LOAD, _PART = "side:", "region:", "load:", "part:"


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
        von_mises: the von Mises stress of each cell, N/m², (c,); None where it was not computed.
        sides: the facets of each boundary table of the scene, (k, d), each row ascending.
        regions: the cells of each region of the mesh, (k,).
        loads: by boundary table, the loads that no formula of the scene tells.
        parts: the parts of Γc by name.
    """

    points: Array
    cells: Integers
    degree: int = 1
    displacement: Array | None = None
    escape_mode: Array | None = None
    von_mises: Singles | None = None
    sides: Mapping[str, Integers] = field(default_factory=dict)
    regions: Mapping[str, Integers] = field(default_factory=dict)
    loads: Mapping[str, LoadArrays] = field(default_factory=dict)
    parts: Mapping[str, ContactPart] = field(default_factory=dict)


def _members(arrays: SolutionArrays) -> Iterator[tuple[str, Any]]:
    """The arrays by their keys, in the order of the file; those that are None are left out."""
    plain = {key: value for key, value in vars(arrays).items() if not isinstance(value, Mapping)}
    yield from ((key, value) for key, value in plain.items() if value is not None)
    yield from ((f"{_SIDE}{name}", facets) for name, facets in arrays.sides.items())
    yield from ((f"{_REGION}{name}", cells) for name, cells in arrays.regions.items())
    for name, load in arrays.loads.items():
        yield from ((f"{_LOAD}{name}:{key}", value) for key, value in vars(load).items())
    for name, part in arrays.parts.items():
        own = {key: getattr(part, attribute) for key, attribute in _OF_PART.items()}
        yield from ((f"{_PART}{name}:{key}", value) for key, value in {**own, **part.columns}.items())


def save(path: Path, arrays: SolutionArrays) -> None:
    """Write a solution, whole or not at all.

    Args:
        path: the file.
        arrays: the solution.

    Raises:
        NotWrittenError: it cannot be written.
    """
    members: dict[str, Any] = {key: np.asarray(value) for key, value in _members(arrays)}
    with writing.whole(path) as aside, aside.open("wb") as stream:
        np.savez(stream, **members)


def load(path: Path) -> SolutionArrays:
    """Read a solution.

    Raises:
        ResultError: the file is missing or damaged.
    """
    try:
        with np.load(path) as stored:
            return _of_members({key: stored[key] for key in stored.files})
    except FileNotFoundError:
        raise ResultError(
            f"{path}: there is no such file; results of earlier versions do not have it: run the scene again"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ResultError(f"{path}: damaged ({error})") from None


def _of_members(members: Mapping[str, Any]) -> SolutionArrays:
    """The arrays from those by their keys."""
    plain = {key: value for key, value in members.items() if ":" not in key}
    return SolutionArrays(
        **plain | {"degree": int(members["degree"])},
        sides=_named(members, _SIDE),
        regions=_named(members, _REGION),
        loads={name: LoadArrays(**own) for name, own in _grouped(members, _LOAD).items()},
        parts={name: _part(name, own) for name, own in _grouped(members, _PART).items()},
    )


def _named(members: Mapping[str, Any], kind: str) -> dict[str, Any]:
    return {key.removeprefix(kind): value for key, value in members.items() if key.startswith(kind)}


def _grouped(members: Mapping[str, Any], kind: str) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for key, value in _named(members, kind).items():
        name, own = key.rsplit(":", 1)
        found.setdefault(name, {})[own] = value
    return found


def _part(name: str, members: dict[str, Any]) -> ContactPart:
    own = {attribute: members.pop(key) for key, attribute in _OF_PART.items()}
    return ContactPart(name=name, columns=members, **own)
