"""Convex envelopes on arrays, against those that are found arc by arc."""

from __future__ import annotations

import numpy as np
import pytest
from plain_envelope import envelope

from hvi_fenicsx import laws
from hvi_fenicsx.equilibrium_search.arcs import ArcTable, Chain, arcs_of, chain, energy
from hvi_fenicsx.equilibrium_search.envelopes import envelopes
from hvi_fenicsx.equilibrium_search.law_graphs import law_graph
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.laws.traction_graph import TractionGraph

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
LAWS = {
    "chks": registered()["chks"]().relative(MODEL, 0.05),
    "narrow chks": registered()["chks"]().relative(MODEL, 0.002),
    "teeth": registered()["log_exp"]().relative(laws.Sawtooth(3.0, 1.0, 0.5, 3), 0.02),
    "paper": registered()["paper"]().relative(MODEL, 0.1),
    "exponential": laws.Exponential(2.0, 0.5, 1.0),
    "smoothed exponential": registered()["chks"]().relative(laws.Exponential(2.0, 0.5, 1.0), 0.01),
}


def random_graph(random: np.random.Generator) -> TractionGraph:
    """A polyline with jumps both ways, flat pieces and falls, on both sides of zero."""
    points = [(0.0, 0.0)]
    for x in np.sort(random.uniform(0.0, 3.0, 8)):
        points += [(float(x), float(t)) for t in np.round(random.normal(0.0, 2.0, random.integers(1, 3)), 1)]
    return TractionGraph.from_points(points, one_sided=bool(random.random() < 0.3))


def compared(one: Chain, low: float, high: float, added: float) -> None:
    """The two envelopes have the same values and ends, and the tractions of the new one do not fall."""
    table = ArcTable.of([one])
    rows = envelopes(table, np.array([low]), np.array([high]), np.array([added]))[0]
    plain = envelope(one, low, high, added)
    assert rows[0, 0] == low
    assert rows[-1, 1] == high
    np.testing.assert_array_equal(rows[1:, 0], rows[:-1, 1])
    size = 1.0 + max(abs(a.at(x)) for a in plain for x in (a.low, a.high))
    for x in np.unique(np.concatenate([np.linspace(low, high, 101), rows[:, 0], [a.low for a in plain]])):
        assert energy(arcs_of(rows), x) == pytest.approx(energy(plain, x), abs=1e-12 * size)
    rates = (rows[:, 4:5] + rows[:, 5:] * (rows[:, :2] - rows[:, 2:3])).ravel()
    assert np.min(np.diff(rates), initial=0.0) >= -1e-8 * (1.0 + np.abs(rates).max())


@pytest.mark.parametrize("seed", range(150))
def test_envelopes_of_polylines_are_those_found_arc_by_arc(seed: int) -> None:
    random = np.random.default_rng(seed)
    one = chain(random_graph(random), random.uniform(0.3, 2.0), random.choice([-1.0, 1.0]))
    joints = [a.high for a in one[:-1]]
    low, high = np.sort(random.choice([*joints, *random.uniform(-4.0, 4.0, 8)], 2, replace=False))
    compared(one, float(low), float(high), random.uniform(0.0, 3.0) * random.integers(0, 2))


@pytest.mark.parametrize("name", LAWS)
def test_envelopes_of_curved_laws_are_those_found_arc_by_arc(name: str) -> None:
    random, law = np.random.default_rng(0), LAWS[name]
    one = chain(law_graph(law, 1e6, 1e-5 * law.energy_scale).graph, 0.7, -1.0)
    joints = [a.high for a in one[:-1]]
    for _ in range(25):
        low, high = np.sort([random.choice(joints), random.uniform(-4.0, 4.0) * 10.0 ** random.integers(-3, 4)])
        compared(one, float(low), float(high), random.uniform(0.0, 3.0) * random.integers(0, 2))


def test_an_interval_that_is_a_point_has_the_energy_there() -> None:
    one = chain(law_graph(LAWS["teeth"], 1e6, 1e-3).graph, 0.7, 1.0)
    for x in (0.3, one[3].high):
        (arc,) = arcs_of(envelopes(ArcTable.of([one]), np.array([x]), np.array([x]), np.array([0.4]))[0])
        assert (arc.low, arc.high) == (x, x)
        assert arc.at(x) == pytest.approx(energy(one, x) + 0.2 * x * x, rel=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_a_law_is_its_convex_part_less_another_convex_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    laws = [chain(random_graph(random), 1.0, sign) for sign in (1.0, -1.0, 1.0)]
    rising = ArcTable.of(laws).convex_part
    x = np.sort(random.uniform(-4.0, 4.0, 200))
    for i, law in enumerate(laws):
        convex = arcs_of(rising.rows(i))
        h = np.array([energy(convex, y) for y in x])
        g = h - np.array([energy(law, y) for y in x])
        assert energy(convex, 0.0) == pytest.approx(energy(law, 0.0), abs=1e-13)
        for values in (h, g):
            assert np.min(np.diff(np.diff(values) / np.diff(x))) >= -1e-9
