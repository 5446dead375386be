"""What is called small is small beside the forces of the same body: no mesh, no other load, no other body hides it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from scenes import Table, block, displacement, model, points, quadratic_linear, solved

from hvi_fenicsx import read_tables, solve

BALANCED = 1.0e9
PEAK = 0.5
FLOORS: dict[str, Table] = {
    "linear": {"on": "bottom", "displacement": [0.0, 0.0]},
    "friction": {"on": "bottom", "contact": {"gap": 0.0}, "friction": quadratic_linear(1e6)},
}


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("solver", ["auto", "gamg", "lu"])
def test_a_body_that_is_moved_is_certified_on_fine_meshes(floor: str, solver: str) -> None:
    """The lifted load grows with the mesh, the reactions do not."""
    table = model(56, linear_solver=solver)
    table["boundary"] = {
        "top": {"on": "top", "displacement": [0.0, "-5e-6*(1 + sin(9*x))"]},
        "floor": FLOORS[floor],
    }
    found = solved(table)
    assert found.exit_code == 0
    assert found.examination is not None
    assert found.examination.certificate.rounding is None


def squeezed(net: float, law: Table, balanced: float = BALANCED, **solver: Any) -> Table:
    """A free block between two pulls that leave a small net push to the floor's friction."""
    table = block(4, -balanced, 10.0, law, **solver)
    table["boundary"]["push"] = {"on": "left", "traction": [balanced + net, 0.0]}
    return table


@pytest.mark.parametrize(
    ("balanced", "push", "solver"),
    [
        (1e9, 2.0, "auto"),
        pytest.param(1e8, 1.2, "gamg", marks=pytest.mark.long),
    ],
)
def test_a_small_net_push_beside_large_balanced_loads_is_never_lost(balanced: float, push: float, solver: str) -> None:
    """Nothing carries it: it is more than the friction's peak."""
    found = solved(squeezed(push * PEAK, quadratic_linear(PEAK, 1e-2), balanced, linear_solver=solver))
    assert found.exit_code != 0
    if found.certificate is not None and found.last_borne is None:
        assert found.certificate.net_force > 0.1


@pytest.mark.parametrize("solver", ["lu", "gamg"])
def test_a_small_net_push_that_friction_carries_is_certified(solver: str) -> None:
    found = solved(squeezed(0.4 * PEAK, quadratic_linear(PEAK, 1e-2), linear_solver=solver))
    assert found.exit_code == 0
    assert found.examination is not None
    friction = found.examination.states[0].friction[:, 0] * found.examination.states[0].surface.weights
    assert np.sum(friction) * BALANCED == pytest.approx(0.4 * PEAK, rel=1e-3)


@pytest.fixture(scope="module")
def two_squares(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return meshes.make(
        tmp_path_factory.mktemp("squares") / "two.msh", meshes.BLOCKS.format(size=0.2, dimension=2, named=True)
    )


def lifting(two_squares: Path, pull: float) -> Table:
    """Block a is clamped and pulled, block b lies on a floor and is pressed so that one end of it lifts."""
    table = model(4)
    table["domain"] = {"shape": "file", "file": str(two_squares)}
    table["boundary"] = {
        "clamp": {"on": "left_a", "displacement": [0.0, 0.0]},
        "pull": {"on": "top_a", "traction": [0.0, pull]},
        "guide": {"on": "right_b", "displacement": [0.0, "free"]},
        "press": {"on": "top_b", "traction": [0.0, "-1 + 1.8*(x - 2)"]},
        "floor": {"on": "bottom_b", "contact": {"gap": 0.0}},
    }
    return table


def test_another_bodys_stress_hides_no_tension(two_squares: Path) -> None:
    """Block b is the same beside a block that nothing pulls, to the accuracy that its own load asks for."""
    beside, alone = (solve(read_tables(lifting(two_squares, pull))) for pull in (1e8, 1.0))
    assert beside.exit_code == alone.exit_code == 0
    here = points(alone)[:, 0] > 1.5
    there = points(beside)[:, 0] > 1.5
    expected = displacement(alone)[here]
    assert np.max(np.abs(displacement(beside)[there] - expected)) < 1e-7 * np.max(np.abs(expected))
    for found in (beside, alone):
        assert found.examination is not None
        state = found.examination.states[0]
        assert 0 < np.count_nonzero(state.contact) < len(state.contact)


def test_a_body_that_has_come_off_meets_no_force_at_all() -> None:
    """A broken bond and a prescribed displacement: the body moves as a whole."""
    table = model(24, start="broken")
    table["boundary"] = {
        "top": {"on": "top", "displacement": [0.0, 1e-3]},
        "floor": {"on": "bottom", "adhesion": {"law": "graph", "points": [[0, 0], [9e-6, 1e6], [9e-6, 0]]}},
    }
    found = solved(table)
    assert found.exit_code == 0
    np.testing.assert_allclose(displacement(found)[:, 1], 1e-3, rtol=1e-12)


@pytest.mark.parametrize("law", [None, {"law": "linear_spring", "stiffness": 5.7e6}])
def test_a_body_that_nothing_drives_rests(law: Table | None) -> None:
    """All that moves it is rounding, which is small beside the law or the unit stress, not beside itself."""
    table = model(3, gap=1e-3)
    side = {"friction": law or {"law": "exponential", "peak_traction": 1e6, "residual_traction": 5e5, "delta": 1e-2}}
    table["boundary"] = {
        "top": {"on": "top", "displacement": ["free", 0.0]},
        "floor": table["boundary"]["floor"],
        "side": {"on": "right", **side},
    }
    found = solved(table)
    assert found.exit_code == 0
    assert np.max(np.abs(displacement(found))) < 1e-12
