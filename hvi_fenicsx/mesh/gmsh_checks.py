"""Whether the elements of a gmsh file make a mesh at all: dolfinx takes that for granted, and else crashes or hangs."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..typing import Integers


def check(gmsh: Any, path: Path, dimension: int) -> None:
    """Refuse lost nodes, elements listed twice, facets of more than two cells, sides off every cell. On gmsh's rank.

    Raises:
        InputError: with the node tags of the first fault.
    """
    known = gmsh.model.mesh.getNodes()[0]
    cells, sides = (_elements(gmsh, d) for d in (dimension, dimension - 1))
    facets = np.concatenate([cells[:, list(c)] for c in combinations(range(dimension + 1), dimension)])
    for found in (cells, sides):
        lost = np.setdiff1d(found, known)
        if len(lost):
            raise InputError(f"mesh file {path}: node {lost[0]} of an element is not there; remesh")
        _refuse_more_than(1, found, f"mesh file {path}: the element of nodes", "is listed twice, or in two groups")
    _refuse_more_than(2, facets, f"mesh file {path}: the facet of nodes", "has more than two cells")
    distinct, _ = _counted(facets)
    together, counts = _counted(np.concatenate([distinct, distinct, sides]))
    if np.any(counts == 1):
        first = ", ".join(map(str, together[np.argmax(counts == 1)]))
        raise InputError(f"mesh file {path}: the boundary element of nodes {first} lies on no cell; remesh")


def _elements(gmsh: Any, dimension: int) -> Integers:
    """Node tags of the simplices in named groups, shape (n, dimension + 1), sorted in each row."""
    found = [np.empty((0, dimension + 1), dtype=np.int64)]
    for _, group in gmsh.model.getPhysicalGroups(dimension):
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for nodes in gmsh.model.mesh.getElements(dimension, entity)[2]:
                found.append(np.asarray(nodes, dtype=np.int64).reshape(-1, dimension + 1))
    return np.sort(np.concatenate(found), axis=1)


def _refuse_more_than(most: int, rows: Integers, what: str, fault: str) -> None:
    distinct, counts = _counted(rows)
    if np.any(counts > most):
        first = ", ".join(map(str, distinct[np.argmax(counts > most)]))
        raise InputError(f"{what} {first} {fault}; remesh")


def _counted(rows: Integers) -> tuple[Integers, Integers]:
    """The distinct ones among sorted rows, and how often each is there (``np.unique`` takes four times as long)."""
    ordered = rows[np.lexsort(rows.T)]
    first = np.flatnonzero(np.append(len(rows) > 0, np.any(ordered[1:] != ordered[:-1], axis=1)))
    return ordered[first], np.diff(np.append(first, len(rows)))
