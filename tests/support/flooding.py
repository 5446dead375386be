"""Barriers of two unknowns by the flooding of a grid, and by passes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.stationary_points.passes import Pass
from hvi_fenicsx.stationary_points.point_list import StationaryPoint
from hvi_fenicsx.stationary_points.stationarity import Kind

Array = npt.NDArray[np.float64]
Levels = dict[tuple[int, int], float]
"""The lowest energy over which two minimisers are joined, by their numbers."""


def flooded(values: Array, starts: Sequence[tuple[int, int]]) -> dict[tuple[int, int], float]:
    """The lowest level at which the cells of a grid that are below it join two starts."""
    group = np.arange(values.size)

    def root(i: int) -> int:
        while group[i] != i:
            group[i] = group[group[i]]
            i = int(group[i])
        return i

    rows, columns = values.shape
    wet, levels = np.zeros(values.size, dtype=bool), values.ravel()
    marks = [a * columns + b for a, b in starts]
    result: dict[tuple[int, int], float] = {}
    for cell in map(int, np.argsort(levels)):
        wet[cell] = True
        i, j = divmod(cell, columns)
        for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if 0 <= a < rows and 0 <= b < columns and wet[a * columns + b]:
                group[root(a * columns + b)] = root(cell)
        for p, q in itertools.combinations(range(len(marks)), 2):
            if (p, q) not in result and wet[marks[p]] and wet[marks[q]] and root(marks[p]) == root(marks[q]):
                result[p, q] = float(levels[cell])
        if len(result) == len(marks) * (len(marks) - 1) // 2:
            break
    return result


def joined_levels(points: Sequence[StationaryPoint], joins: Sequence[Pass]) -> dict[tuple[int, int], float]:
    """The same by the passes, over several of them where that is lower."""
    basins = [{i} for i, p in enumerate(points) if p.kind is Kind.MINIMISER]
    result = {}
    for one in sorted(joins, key=lambda p: points[p.saddle].energy):
        a, b = (next(s for s in basins if m in s) for m in one.minimisers)
        if a is not b:
            result |= {(min(p, q), max(p, q)): points[one.saddle].energy for p in a for q in b}
            basins = [s for s in basins if s is not a and s is not b] + [a | b]
    return result


def flooded_levels(problem: CondensedProblem, points: Sequence[StationaryPoint], side: Array) -> Levels:
    """The same by the flooding of a grid of two unknowns, each of which takes the values of `side`."""
    minimisers = [i for i, p in enumerate(points) if p.kind is Kind.MINIMISER]
    at = np.stack(np.meshgrid(side, side, indexing="ij"))
    values = 0.5 * np.einsum("iab,ij,jab->ab", at, problem.stiffness, at)
    values -= np.einsum("i,iab->ab", problem.load(1.0), at)
    for bonds in problem.bonds:
        for i, sign, weight in zip(bonds.unknowns[:, 0], bonds.signs[:, 0], bonds.weights, strict=True):
            values += weight * bonds.law.value(sign * at[i].ravel()).reshape(at[i].shape)
    starts = [
        (int(np.abs(side - points[m].x[0]).argmin()), int(np.abs(side - points[m].x[1]).argmin())) for m in minimisers
    ]
    return {(minimisers[p], minimisers[q]): level for (p, q), level in flooded(values, starts).items()}


def assert_levels(got: Levels, wanted: Levels, *, above: float, below: float) -> None:
    """Whether levels are those of a grid: lower by `above` at most, and higher by `below` at most."""
    assert got.keys() == wanted.keys()
    for pair, level in wanted.items():
        assert level - above <= got[pair] <= level + below
