"""The facets of a grid of cells that are cut into simplices, numbered without a search.

A simplex is a path of edges from the lowest to the highest corner of its cell, so it is known by that corner and the
order of its steps. A facet of it is a shorter path. Facets with the same steps begin at different vertices, so the
first vertex and the steps tell a facet, and equal facets of two cells have equal numbers.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..typing import Entities, Integers


def facets(simplices: Integers, steps: Sequence[int], vertices: int) -> tuple[Entities, Entities]:
    """The facets of a grid's simplices.

    Args:
        simplices: by their vertices, (c, d+1), ascending; the paths of one cell follow each other, in the order of the
            permutations of the steps.
        steps: from a vertex to the next one along each axis, (d,).
        vertices: number of vertices.

    Returns:
        The vertices of each facet, (f, d), ascending; the facets of each simplex, (c, d+1), facet i being opposite to
        vertex i.
    """
    d, paths = len(steps), [np.cumsum([0, *path]) for path in itertools.permutations(steps)]
    shortened = [[tuple(np.delete(path - path[int(i == 0)], i)) for i in range(d + 1)] for path in paths]
    kinds = {kind: number for number, kind in enumerate(dict.fromkeys(itertools.chain(*shortened)))}
    own = np.array([[kinds[kind] for kind in row] for row in shortened], dtype=np.int32)
    first = simplices[:, [1, *[0] * d]].reshape(-1, len(paths), d + 1)
    keys = (first + own * vertices).reshape(-1, d + 1)
    there = np.zeros(len(kinds) * vertices, dtype=np.bool_)
    there[keys] = True
    found, numbered = np.flatnonzero(there), np.cumsum(there, dtype=np.int32) - 1
    ways = np.array(list(kinds), dtype=np.int64)
    corners = found[:, None] % vertices + ways[found // vertices]
    return corners.astype(np.int32), numbered[keys].astype(np.int32)
