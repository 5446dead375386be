"""Laws far weaker than loads in balance: they change the energy by less than its rounding error."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import E, Table, model, quadratic_linear, solved

PULL = 3e8


def squeezed(net: float, **solver: str) -> Table:
    """A square pressed together, without Poisson's effect, that hangs at its top: its slips are far beyond the drop."""
    table = model(3, **solver)
    table["material"]["poisson_ratio"] = 0.0
    table["boundary"] = {
        "left": {"on": "left", "traction": [PULL + net, 0.0]},
        "right": {"on": "right", "traction": [-PULL, 0.0]},
        "top": {"on": "top", "contact": {"gap": 0.0}, "friction": quadratic_linear(2e6, 2.8e-5)},
        "floor": {"on": "bottom", "contact": {"gap": 9e-7}},
    }
    return table


@pytest.mark.parametrize("linear_solver", ["lu", "gamg"])
def test_a_tiny_net_push_moves_the_body_until_one_vertex_sticks(linear_solver: str) -> None:
    """Left and right the drops are passed; friction there is the same on both sides, so one vertex has to carry all."""
    found = solved(squeezed(0.3, linear_solver=linear_solver))
    assert found.exit_code == 0
    assert found.examination is not None
    (top,) = (s for s in found.examination.states if s.laws)
    assert np.sum(top.friction[:, 0] * top.surface.weights) * PULL == pytest.approx(0.3, rel=1e-4)
    slips = np.sort(np.abs(top.slip[:, 0])) * found.problem.scales.displacement
    assert slips[0] < 2.8e-5 < 0.1 * PULL / E < slips[1]
