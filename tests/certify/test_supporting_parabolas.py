"""By how much laws are below their tangents: against samples; and what follows of the lowest energy: enumeration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from enumeration import Floor, polyline
from scenes import Table, model

from hvi_fenicsx import read_scene, read_tables
from hvi_fenicsx.certify.uniqueness import needed_falls
from hvi_fenicsx.workflow import Solution, finish, prepare

DROP = ((0.0, 0.0), (9e-6, 3e6), (9e-6, 1.5e6))
TEETH = ((0.0, 0.0), (4e-6, 8e5), (4e-6, 3e5), (9e-6, 9e5), (9e-6, 2e5))
SOFTENING = ((0.0, 0.0), (2e-6, 9e5), (1.1e-5, 0.0))
DEMO = Path(__file__).resolve().parents[2] / "demos" / "jureczka_ochal.toml"
GRAPHS = {"drop": DROP, "teeth": TEETH, "softening": SOFTENING}


def found(table: Table) -> Solution:
    return finish(prepare(read_tables(table)), estimating=False)


def law_of(name: str) -> Table:
    return {"law": "graph", "points": [list(p) for p in GRAPHS[name]]}


@pytest.mark.parametrize("name", GRAPHS)
def test_the_least_curvature_is_that_of_samples(name: str) -> None:
    solution = found(model(4, 1e6, 1e6, law_of(name)))
    assert solution.examination is not None
    state = solution.examination.states[0].laws[0]
    law, size = state.term.law, len(state.argument)
    x = np.random.default_rng(1).uniform(-2.0, 2.0, size) * float(law.breaks.max())
    traction = law.right(x)
    falls = needed_falls(replace(state, argument=x, traction=traction, hidden=np.zeros(size, bool)))
    assert falls is not None
    y = np.append(law.breaks, float(law.breaks.max()) * np.linspace(-40.0, 40.0, 400_001))
    for at, t, fall in zip(x, traction, falls, strict=True):
        apart = np.abs(y - at) > 1e-6
        deficit = law.value(np.array([at])) + t * (y - at) - law.value(y)
        wanted = max(0.0, np.max(2.0 * deficit[apart] / (y - at)[apart] ** 2))
        assert fall == pytest.approx(wanted, rel=1e-4, abs=1e-9 * np.abs(law.right(y)).max())


@pytest.mark.parametrize("name", GRAPHS)
def test_what_is_called_lowest_is_so_by_enumeration(name: str) -> None:
    seen = set()
    for pull, press in ((2e5, 1e6), (1e6, 1e6), (3e6, 1e6), (6e6, 1e6), (-4e6, 3e5)):
        lowest = Floor(2, pull, press, polyline(GRAPHS[name])).stationary()[0].energy
        for start in ("unbroken", "broken"):
            one = found(model(2, pull, press, law_of(name), start=start))
            assert one.converged
            assert one.uniqueness is not None
            assert one.examination is not None
            energy = one.examination.energy * one.problem.scales.energy
            least = energy <= lowest + 1e-9 * abs(lowest)
            assert least or one.uniqueness.state == "unknown"
            seen.add((least, one.uniqueness.state))
    assert any(state != "unknown" for _, state in seen)


def test_of_two_states_of_a_published_problem_the_lower_one_is_known_to_be_the_lowest() -> None:
    said = {}
    for start in ("unbroken", "broken"):
        scene = read_scene(DEMO, ["domain.cells=[16,8]", f'solver.start="{start}"'])
        only = finish(prepare(scene), estimating=False).uniqueness
        assert only is not None
        said[start] = only.state
    assert said == {"unbroken": "unknown", "broken": "lowest"}
