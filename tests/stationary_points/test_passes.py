"""Barriers between minimisers: by hand on teeth, and against the flooding of a fine grid."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from flooding import assert_levels, flooded_levels, joined_levels

from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.stationary_points.all_points import Enumeration
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.landscapes import PolylineLandscape
from hvi_fenicsx.stationary_points.passes import Pass, passes
from hvi_fenicsx.stationary_points.point_list import StationaryPoint

Found = tuple[list[StationaryPoint], tuple[Pass, ...]]


def found(problem: CondensedProblem) -> Found:
    scalar = scalar_problem(problem)
    search = Enumeration(problem=scalar)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    points = sorted(search.points, key=lambda p: p.energy)
    return points, passes(PolylineLandscape(scalar), points)


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


@pytest.mark.parametrize("load", [(1.2, 1.2), (1.3, 1.1), (1.0, 1.3)])
def test_barriers_of_two_unknowns_are_those_of_a_flooded_grid(load: tuple[float, float]) -> None:
    law = condensed.graph([(0, 0), (1, 1), (1, 0.3)])
    problem = condensed.problem([[0.6, -0.1], [-0.1, 0.6]], load, condensed.bonds(law, [0, 1]))
    points, joins = found(problem)
    side = np.linspace(0.0, 5.0, 126)  # 1, where the law drops, is among them
    wanted = flooded_levels(problem, points, side)
    assert len(wanted) >= 1
    assert_levels(joined_levels(points, joins), wanted, above=4e-3, below=1e-12)
