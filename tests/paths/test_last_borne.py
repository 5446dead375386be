"""Above the limit load the last state that is borne is shown; enumeration says where that limit is."""

from __future__ import annotations

import numpy as np
import pytest
from enumeration import Floor, polyline
from scenes import DELTA, P, block, displacement, far, points, quadratic_linear

import hvi_fenicsx as hvi
from hvi_fenicsx import read_tables
from hvi_fenicsx.api.solution import ModelSolution
from hvi_fenicsx.load_paths import following

ABOVE, STRENGTH, CELLS = 0.97 * P, 1e6, 3
PUSHED = block(CELLS, ABOVE, P, quadratic_linear(STRENGTH))


@pytest.fixture(scope="module", params=["auto", "branch"])
def last(request: pytest.FixtureRequest) -> ModelSolution:
    """``auto`` knows the state from the path that it has followed; otherwise the path is followed afterwards."""
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "auto":
            patch.setattr(following.PathRun, "follow", _must_not)
        return hvi.solve(read_tables(PUSHED | {"solver": {"method": request.param}}))


def _must_not(*_: object) -> None:
    raise AssertionError("the path is followed a second time")


def listed(factor: float) -> list[np.ndarray]:
    """All solutions at a factor of both loads, by nodes (n, 2), m."""
    graph = polyline([(0.0, 0.0), (DELTA, STRENGTH), (DELTA, STRENGTH / 2)])
    return [point.u for point in Floor(CELLS, factor * ABOVE, factor * P, graph, wall=False).stationary()]


def test_its_factor_is_where_the_list_of_solutions_ends(last: ModelSolution) -> None:
    assert last.last_borne is not None
    factor = last.last_borne.factor
    assert factor < 1.0
    assert not listed(factor * (1 + 1e-6))
    below = listed(factor * (1 - 1e-6))
    row = np.rint(points(last) * CELLS).astype(int) @ [1, CELLS + 1]
    assert min(far(displacement(last), u[row]) for u in below) < 1e-5


def test_its_state_is_certified_under_its_load_and_the_answer_stays_no(last: ModelSolution) -> None:
    assert last.last_borne is not None
    assert last.examination is not None
    assert last.examination.certificate.passed
    state = last.borne
    assert state.converged
    assert np.allclose(state.resultant("pull"), [last.last_borne.factor * ABOVE, 0.0], rtol=1e-12, atol=1e-3)
    assert np.allclose(state.resultant("floor"), -state.resultant("pull") - state.resultant("press"), atol=1e-3)
    assert not last.converged
    assert last.exit_code == 4
    assert last.certificate is not None
    assert not last.certificate.passed


FIELDS = ("u", "stress", "energy", "contact", "resultants")


@pytest.mark.parametrize("pull", [ABOVE, 3.0 * ABOVE], ids=["metastable", "escapes"])
def test_beyond_the_limit_no_field_is_that_of_another_load(pull: float) -> None:
    """One answer of a loop over loads in every state; a smaller load has its fields."""
    made = [hvi.solve(read_tables(block(CELLS, load, P, quadratic_linear(STRENGTH)))) for load in (0.5 * ABOVE, pull)]
    assert [one.converged for one in made] == [True, False]
    for name in FIELDS:
        getattr(made[0], name)
        with pytest.raises(hvi.InputError, match="nothing was solved"):
            getattr(made[1], name)


@pytest.mark.parametrize("method", ["auto", "branch"])
def test_moved_obstacles_are_scaled_as_on_a_path(method: str) -> None:
    """A plate that goes down presses the block in the place of a load."""
    table = block(CELLS, ABOVE, P, quadratic_linear(STRENGTH), method=method)
    plate = {"point": [0.0, 1.0], "normal": [0.0, -1.0], "displacement": [0.0, -1e-5]}
    table["boundary"]["press"] = {"on": "top", "contact": {"obstacle": plate}}
    scene = read_tables(table)
    found, path = hvi.solve(scene), hvi.follow(scene, memory=False)
    assert found.last_borne is not None
    assert found.examination is not None
    assert found.examination.certificate.passed
    assert found.last_borne.factor == pytest.approx(float(path.factors.max()), rel=1e-9)
