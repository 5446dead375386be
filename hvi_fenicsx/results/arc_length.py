"""The order of a plane part's vertices along it: chains of facets, followed from end to end, with their arc length."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..geometry import chains
from ..mesh import nodes
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..typing import Array, Integers

_DIGITS = 9
"""Digits of the part's size; coordinates that should be equal may differ in later ones."""


def edges(problem: Problem, surface: Surface) -> Integers:
    """A part's facets that this rank knows by their global ends, the body to their left, at degree 2 halves; (k, 2).

    Args:
        problem: what was solved.
        surface: the part.
    """
    mesh, space = problem.domain.mesh, problem.space
    facets = np.asarray(surface.facets, dtype=np.int32)
    if not len(facets):
        return np.empty((0, 2), dtype=np.int64)
    on = nodes.facet_nodes(space, facets)
    mesh.topology.create_connectivity(1, 2)
    cells = [mesh.topology.connectivity(1, 2).links(f)[0] for f in facets]
    x = problem.points[:, :2]
    first, last = x[on[:, 0]], x[on[:, 1]]
    inwards = x[space.dofmap.list[cells][:, :3]].mean(axis=1) - first
    along = last - first
    left = along[:, 0] * inwards[:, 1] - along[:, 1] * inwards[:, 0] > 0
    dofs = np.where(left[:, None], on[:, :2], on[:, 1::-1])
    if nodes.degree(space) == 2:
        dofs = np.vstack([np.column_stack([dofs[:, 0], on[:, 2]]), np.column_stack([on[:, 2], dofs[:, 1]])])
    return spaces.global_numbers(space, dofs)


def lexicographic(points: Array) -> npt.NDArray[np.intp]:
    """The order of points (m, d) by their coordinates, rounded."""
    return np.lexsort(rounded(points, float(np.max(np.ptp(points, axis=0), initial=0.0))).T[::-1])


def rounded(points: Array, size: float) -> Array:
    """Coordinates over the size of the part, in which those that should be equal are, (m, d).

    Args:
        points: m, (m, d).
        size: of the part, m; 0 where it is a point.
    """
    return np.round(points / (size or 1.0), _DIGITS)


def along(points: Array, numbers: Integers, pairs: Integers) -> tuple[Integers, Array]:
    """The order of vertices along their part and the arc length of each, in that order.

    A chain runs from the lexicographically smaller of its ends; a closed one from its smallest vertex, the body to the
    left, and is cut there. Chains follow one another by their smallest vertices, each beginning at the arc length at
    which the last one ended. The arc length is 0 at the smallest vertex of all, and negative before it.

    Args:
        points: the vertices, m, (m, 2).
        numbers: of the vertices, (m,).
        pairs: the facets by these numbers, the body to their left, (k, 2); a facet may be there twice. One with a
            vertex that is none of these is left out.
    """
    rank = np.empty(len(points), dtype=np.int64)
    rank[lexicographic(points)] = np.arange(len(points))
    by_number = np.argsort(numbers)
    within = np.unique(pairs[np.isin(pairs, numbers).all(axis=1)], axis=0)
    edges = by_number[np.searchsorted(numbers[by_number], within)]
    inner = np.unique(edges[:, 1])
    found = [chain if chain[0] in inner else _oriented(chain, rank) for chain in chains(edges, rank)]
    found += [np.array([alone]) for alone in np.setdiff1d(np.arange(len(points)), edges)]
    return _measured(points, sorted(found, key=lambda chain: int(np.min(rank[chain]))), rank)


def _oriented(chain: Integers, rank: Integers) -> Integers:
    """An open chain from the lower of its ends."""
    return chain if rank[chain[0]] <= rank[chain[-1]] else chain[::-1]


def _measured(points: Array, ordered: list[Integers], rank: Integers) -> tuple[Integers, Array]:
    """All chains one after the other; a vertex where two of them touch belongs to the first."""
    order: dict[int, float] = {}
    end = 0.0
    for i, chain in enumerate(ordered):
        steps = np.linalg.norm(np.diff(points[chain], axis=0), axis=1)
        s = end + np.concatenate([[0.0], np.cumsum(steps)])
        if i == 0:
            s -= s[int(np.argmin(rank[chain]))]
        for vertex, length in zip(chain, s, strict=True):
            order.setdefault(int(vertex), float(length))
        end = float(s[-1])
    return np.array(list(order), dtype=np.int64), np.array(list(order.values()))
