"""A state after unloading along its graphs: by hand, a spring of 1 beside a bond on its secant."""

from __future__ import annotations

import numpy as np
import pytest
from condensed import bonds, graph, problem

from hvi_fenicsx.laws import Superpotential
from hvi_fenicsx.laws.smoothing import create
from hvi_fenicsx.paths.distances import StateOnGraphs
from hvi_fenicsx.paths.follower import Follower
from hvi_fenicsx.paths.state import PathOptions

PLATEAU = graph([(0, 0), (1, 1), (9, 1)])


@pytest.mark.parametrize("law", [PLATEAU, create("chks", PLATEAU, epsilon=1e-3)])
def test_a_small_load_is_carried_along_the_secant_up_to_its_end(law: Superpotential) -> None:
    given = problem(1.0, 1.0, bonds(law, 0))
    *_, state = Follower(given, PathOptions(programme=(3.0, 2.0), remember=(0,))).states()
    assert state.memory is not None
    _, largest, _, traction = state.memory[0]
    secant = traction / largest
    assert secant == pytest.approx(0.5, rel=1e-2)
    graphs = StateOnGraphs(given, (0,), state)
    assert graphs.x == pytest.approx(state.x, rel=1e-14)
    graphs.take(np.array([0.3]))
    assert graphs.x == pytest.approx(state.x + 0.3 / (1.0 + secant), rel=1e-12)
    assert graphs.force == pytest.approx(secant * graphs.x, rel=1e-12)
    graphs.take(np.array([2.0]))
    assert graphs.x == pytest.approx([largest], rel=1e-12)
    graphs.take(3.5 - graphs.x - graphs.force)
    assert graphs.x + law.right(graphs.x) == pytest.approx([3.5], rel=1e-3)
