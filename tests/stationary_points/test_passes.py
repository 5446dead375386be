"""Barriers between minimisers: by hand on teeth, and against the flooding of a fine grid."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import condensed
import numpy as np
import numpy.typing as npt
import pytest

from hvi_fenicsx.stationary_points.all_points import Enumeration
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.passes import Pass, passes
from hvi_fenicsx.stationary_points.point_list import StationaryPoint
from hvi_fenicsx.stationary_points.stationarity import Kind
from hvi_fenicsx.system.condensed_problem import CondensedProblem

Array = npt.NDArray[np.float64]
Found = tuple[list[StationaryPoint], tuple[Pass, ...]]


def found(problem: CondensedProblem) -> Found:
    scalar = scalar_problem(problem)
    search = Enumeration(problem=scalar)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    points = sorted(search.points, key=lambda p: p.energy)
    return points, passes(scalar, points)


def test_each_drop_between_teeth_is_the_barrier_between_its_neighbours() -> None:
    """By hand: k (x0 - x) = 3 (x - i) on the tooth i; at the drop it is i + 1, and a tooth takes 1.5 of energy."""
    k, x0, teeth = 0.1, 8.0, 3
    law = condensed.graph([(0, 0), *((x, t) for i in range(1, teeth + 1) for x, t in ((i, 3.0), (i, 0.0)))])
    points, joins = found(condensed.problem(k, k * x0, condensed.bonds(law, 0), lower=0.0))
    assert len(joins) == teeth
    for one in joins:
        drop = points[one.saddle].x[0]
        beside = sorted(float(points[m].x[0]) for m in one.minimisers)
        before = (k * x0 + 3.0 * (drop - 1.0)) / (k + 3.0)
        behind = (k * x0 + 3.0 * drop) / (k + 3.0) if drop < teeth else x0
        np.testing.assert_allclose(beside, [before, behind], rtol=1e-12)
        height = points[one.saddle].energy - min(points[m].energy for m in one.minimisers if points[m].x[0] < drop)
        wanted = 0.5 * k * ((x0 - drop) ** 2 - (x0 - before) ** 2) + 1.5 * (1.0 - (before - drop + 1.0) ** 2)
        assert height == pytest.approx(wanted, rel=1e-9)


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


def levels(points: Sequence[StationaryPoint], joins: Sequence[Pass]) -> dict[tuple[int, int], float]:
    """The same by the passes, over several of them where that is lower."""
    basins = [{i} for i, p in enumerate(points) if p.kind is Kind.MINIMISER]
    result = {}
    for one in sorted(joins, key=lambda p: points[p.saddle].energy):
        a, b = (next(s for s in basins if m in s) for m in one.minimisers)
        if a is not b:
            result |= {(min(p, q), max(p, q)): points[one.saddle].energy for p in a for q in b}
            basins = [s for s in basins if s is not a and s is not b] + [a | b]
    return result


@pytest.mark.parametrize("load", [(1.2, 1.2), (1.3, 1.1), (1.0, 1.3)])
def test_barriers_of_two_unknowns_are_those_of_a_flooded_grid(load: tuple[float, float]) -> None:
    law = condensed.graph([(0, 0), (1, 1), (1, 0.3)])
    problem = condensed.problem([[0.6, -0.1], [-0.1, 0.6]], load, condensed.bonds(law, [0, 1]))
    points, joins = found(problem)
    minimisers = [i for i, p in enumerate(points) if p.kind is Kind.MINIMISER]
    assert len(minimisers) >= 2
    side = np.linspace(0.0, 5.0, 126)  # 1, where the law drops, is among them
    x, y = np.meshgrid(side, side, indexing="ij")
    at = np.stack([x, y])
    quadratic = np.einsum("iab,ij,jab->ab", at, problem.stiffness, at)
    work = np.einsum("i,iab->ab", problem.load(1.0), at)
    values = 0.5 * quadratic - work + problem.bonds[0].law.value(at.ravel()).reshape(at.shape).sum(axis=0)
    starts = [
        (int(np.abs(side - points[m].x[0]).argmin()), int(np.abs(side - points[m].x[1]).argmin())) for m in minimisers
    ]
    wanted = {(minimisers[p], minimisers[q]): level for (p, q), level in flooded(values, starts).items()}
    got = levels(points, joins)
    assert got.keys() == wanted.keys()
    for pair, level in wanted.items():
        assert got[pair] == pytest.approx(level, abs=4e-3)
        assert got[pair] <= level + 1e-12
