"""Laws against definitions: difference quotients, min{}, sampled extremes, the split, plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvi_fenicsx import laws
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.laws.base import ScaledLaw, Superpotential, extremes

GAMMA1, GAMMA2, DELTA = 1.0e3, 0.5e3, 9.0e-6
MODEL = laws.QuadraticLinear(GAMMA1, GAMMA2, DELTA)
LITERAL = laws.QuadraticLinearLiteral(GAMMA1, GAMMA2, DELTA)


@dataclass(frozen=True)
class Rational(laws.WeakeningLaw):
    """Traction falling like 1/(1 + z)²."""

    name = "rational_of_the_tests"

    def shape(self, z: Any) -> Any:
        return z * z / (1 + z), 1 - (1 + z) ** -2, 2 * (1 + z) ** -3


@dataclass(frozen=True)
class Cohesive(laws.SampledLaw):
    """A parabola, then an exponential tail from half the height: one jump."""

    name = "cohesive_of_the_tests"
    one_sided = True
    strength: float
    opening: float

    def traction(self, x: Any) -> Any:
        z = x / self.opening
        return self.strength * np.where(z < 1, z * (2 - z), 0.5 * np.exp(1 - z))

    def ends(self) -> tuple[float, ...]:
        return self.opening, 30 * self.opening


UPS_AND_DOWNS = ((0.0, 2.0), (1e-6, 5.0), (1e-6, -3.0), (2e-6, -4.0), (3e-6, 1.0), (3e-6, 6.0), (5e-6, 0.5))
LAWS: dict[str, Superpotential] = {
    "model": MODEL,
    "literal": LITERAL,
    "literal, weak": laws.QuadraticLinearLiteral(1.0e3, 0.1e3, DELTA),
    "tresca": laws.Tresca(300.0),
    "spring": laws.LinearSpring(1e8),
    "sawtooth": laws.Sawtooth(1e3, 200.0, 2e-6, 5),
    "exponential": laws.Exponential(1e3, 300.0, 5e-6),
    "rational": Rational(1e3, 0.0, 5e-6),
    "cohesive": Cohesive(1e6, 1e-5),
    "graph": laws.Graph(UPS_AND_DOWNS),
    "one-sided": laws.Graph(UPS_AND_DOWNS, one_sided=True),
    "scaled": ScaledLaw(laws.Graph(UPS_AND_DOWNS), 3e-6, 7.0),
}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())


@st.composite
def graphs(draw: st.DrawFn) -> laws.Graph:
    """Random polylines of order 1 in both directions, with jumps up and down, also at zero."""
    tractions = st.integers(-40, 40).map(lambda k: k / 8)
    points = [(0.0, draw(tractions))]
    for x in np.cumsum(draw(st.lists(st.integers(1, 16), min_size=1, max_size=6))) / 8:
        points.append((float(x), draw(tractions)))
        if draw(st.booleans()):
            points.append((float(x), draw(tractions)))
    points.append((points[-1][0] + 1.0, 1.0))
    return laws.Graph(tuple(points), draw(st.booleans()))


def around(law: Superpotential) -> np.ndarray:
    """Displacements on both sides, on every kink, close to the kinks and far out."""
    spread = law.length_scale * np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 61), np.linspace(0.05, 8.3, 83)])
    near = law.kinks[:, None] + 1e-3 * law.length_scale * np.array([-1.0, 0.0, 1.0])
    return np.unique(np.concatenate([spread, -spread, near.ravel()]))


def off_kinks(law: Superpotential, x: np.ndarray, gap: float) -> np.ndarray:
    """The points at least `gap` away from every kink and break of slope."""
    corners = law.graph.breaks if isinstance(law, laws.PolylineLaw) else law.kinks
    if isinstance(law, ScaledLaw):
        corners = law.law.graph.breaks / law.length  # type: ignore[attr-defined]
    return x[np.all(np.abs(x[:, None] - corners) > gap, axis=1)] if corners.size else x


@each_law
def test_traction_is_the_derivative_of_the_energy(law: Superpotential) -> None:
    h = 1e-5 * law.length_scale
    x = off_kinks(law, around(law), 2 * h)
    quotient = (law.value(x + h) - law.value(x - h)) / (2 * h)
    rounding = 1e-15 * np.abs(law.value(x)).max() / h
    np.testing.assert_allclose(law.right(x), quotient, rtol=1e-6, atol=1e-6 * law.traction_scale + rounding)
    assert law.value(np.zeros(1))[0] == 0.0


@each_law
def test_interval_is_the_hull_of_the_one_sided_difference_quotients(law: Superpotential) -> None:
    h = 1e-6 * law.length_scale
    x = law.kinks
    lo, hi = law.interval(x)
    behind = (law.value(x) - law.value(x - h)) / h
    ahead = (law.value(x + h) - law.value(x)) / h
    tolerance = 1e-5 * max(law.traction_scale, law.peak.plus if np.isfinite(law.peak.plus) else 0)
    np.testing.assert_allclose(lo, np.minimum(behind, ahead), atol=tolerance)
    np.testing.assert_allclose(hi, np.maximum(behind, ahead), atol=tolerance)
    assert np.all(hi > lo)


@each_law
def test_split_is_convex_minus_convex(law: Superpotential) -> None:
    x = around(law)
    h, g = law.convex, law.concave
    size = np.abs(h.value(x)) + np.abs(g.value(x)) + law.energy_scale
    assert np.all(np.abs(h.value(x) - g.value(x) - law.value(x)) <= 1e-13 * size)
    for part in (h, g):
        slopes = np.column_stack([part.left(x), part.right(x)]).ravel()
        assert np.all(np.diff(slopes) >= -1e-12 * (np.abs(slopes[1:]) + law.traction_scale))
        assert np.all(part.second(x) >= 0.0)
        assert np.all(part.jumps > 0.0)
        step = np.diff(part.value(x))
        slack = 1e-13 * (np.abs(part.value(x)).max() + law.energy_scale)
        assert np.all(step >= part.right(x[:-1]) * np.diff(x) - slack)
        assert np.all(step <= part.left(x[1:]) * np.diff(x) + slack)


@each_law
def test_growth_and_peak(law: Superpotential) -> None:
    x = around(law)
    lo, hi = law.interval(x)
    for bound, sampled in ((law.peak.plus, hi.max()), (law.peak.minus, (-lo).max())):
        assert sampled <= bound * (1 + 1e-12) + 1e-12 * law.traction_scale
        assert np.isinf(bound) or sampled >= bound - 0.02 * law.traction_scale
    far = 1e12 * law.length_scale
    for side, growth in ((1.0, law.growth.plus), (-1.0, law.growth.minus)):
        rate = law.value(np.array([side * far]))[0] / far
        assert rate == pytest.approx(growth, rel=1e-6, abs=1e-6 * law.traction_scale) or np.isinf(growth)


@each_law
@pytest.mark.parametrize("length", [1.0, 1e-6])
def test_the_growth_constant_of_the_paper(law: Superpotential, length: float) -> None:
    scaled = law.scaled(length, 1.0)
    x = np.unique(np.append(around(scaled), 1e9 * np.array([-1, 1.0])))
    lo, hi = scaled.interval(x)
    off = x != 0
    opposed = np.where(x > 0, -lo, hi)[off].max()
    assert opposed <= scaled.c4 + 1e-12 * scaled.traction_scale
    assert max(opposed, 0.0) >= 0.95 * scaled.c4


@each_law
def test_the_bounds_for_unknown_laws_agree_with_the_closed_forms(law: Superpotential) -> None:
    if np.isinf(law.peak.plus):
        return
    peak, c4 = extremes(law)
    for exact, bound in (
        (law.peak.minus, peak.minus),
        (law.peak.plus, peak.plus),
        (law.c4, c4),
    ):
        assert exact * (1 - 1e-12) <= bound + 1e-12 * law.traction_scale
        assert bound <= exact + 3e-6 * max(law.traction_scale, exact)


@each_law
def test_scaled_is_the_same_law_in_other_units(law: Superpotential) -> None:
    length, traction = 3.7e-6, 41.0
    scaled, x = law.scaled(length, traction), around(law)
    x = off_kinks(law, x, 1e-6 * law.length_scale)
    np.testing.assert_allclose(
        scaled.value(x / length) * length * traction, law.value(x), rtol=1e-9, atol=1e-12 * law.energy_scale
    )
    np.testing.assert_allclose(
        scaled.right(x / length) * traction, law.right(x), rtol=1e-9, atol=1e-12 * law.traction_scale
    )
    for ours, theirs in ((scaled.convex, law.convex), (scaled.concave, law.concave)):
        np.testing.assert_allclose(ours.second(x / length) * traction / length, theirs.second(x), rtol=1e-9)
        np.testing.assert_allclose(ours.kinks * length, theirs.kinks, rtol=1e-12)
        np.testing.assert_allclose(ours.jumps * traction, theirs.jumps, rtol=1e-9)
    assert scaled.energy_scale * length * traction == pytest.approx(law.energy_scale)
    assert scaled.length_scale * length == pytest.approx(law.length_scale)
    assert scaled.peak.plus * traction == pytest.approx(law.peak.plus)
    assert scaled.growth.minus * traction == pytest.approx(law.growth.minus)
    assert scaled.even == law.even
    np.testing.assert_array_equal(scaled.branch(x / length), law.branch(x))
    lo, hi = scaled.interval(scaled.kinks)
    assert np.all(hi > lo)


def test_model_law_is_the_papers_minimum() -> None:
    x = np.linspace(-4 * DELTA, 4 * DELTA, 4001)
    expected = np.minimum(GAMMA1 / (2 * DELTA) * x**2, GAMMA2 * np.abs(x))
    np.testing.assert_allclose(MODEL.value(x), expected, rtol=1e-12, atol=1e-18)
    assert MODEL.energy_scale == pytest.approx(GAMMA2 * DELTA)
    assert MODEL.length_scale == DELTA
    np.testing.assert_array_equal(MODEL.branch(np.array([-2, -1, -0.5, 0, 0.5, 1, 2]) * DELTA), [1, -1, 0, 0, 0, -1, 1])
    assert MODEL.convex.kinks.size == 0
    np.testing.assert_array_equal(MODEL.concave.kinks, [-DELTA, DELTA])
    np.testing.assert_allclose(MODEL.convex.right(x), GAMMA1 / DELTA * np.clip(x, -DELTA, DELTA), rtol=1e-12)


@pytest.mark.parametrize("gamma2", [0.05e3, 0.5e3, 3e3])
def test_literal_law_is_the_papers_minimum_on_the_whole_line(gamma2: float) -> None:
    law = laws.QuadraticLinearLiteral(GAMMA1, gamma2, DELTA)
    x = np.linspace(-12 * DELTA, 12 * DELTA, 4001)
    expected = np.minimum(GAMMA1 / (2 * DELTA) * x**2, gamma2 * x)
    np.testing.assert_allclose(law.value(x), expected, rtol=1e-12, atol=1e-12 * law.energy_scale)
    assert np.all(law.right(x[x < 0]) == gamma2)
    assert not law.even
    assert (law.growth.minus, law.growth.plus) == (-gamma2, gamma2)
    assert (law.peak.minus, law.peak.plus) == (0.0, 2 * gamma2)
    np.testing.assert_allclose(law.concave.kinks, [0.0, 2 * DELTA * gamma2 / GAMMA1])


def test_graph_reproduces_the_model_law_and_the_sawtooth_with_one_drop() -> None:
    graph = laws.create("graph", {"points": [[0, 0], [9e-6, 1e3], [9e-6, 0.5e3]]})
    tooth = laws.Sawtooth(GAMMA1, GAMMA2, DELTA, 1)
    x = around(MODEL)
    for law in (graph, tooth):
        np.testing.assert_array_equal(law.value(x), MODEL.value(x))
        np.testing.assert_array_equal(law.interval(x), MODEL.interval(x))
        assert law.energy_scale == MODEL.energy_scale


def test_exponential_law_is_its_formula() -> None:
    law = laws.Exponential(1e3, 300.0, 5e-6)
    x = np.array([-1e-5, -1e-7, 1e-7, 1e-5])
    np.testing.assert_allclose(law.right(x), np.sign(x) * (300 + 700 * np.exp(-np.abs(x) / 5e-6)), rtol=1e-12)
    np.testing.assert_array_equal(law.interval(np.zeros(1)), [[-1000.0], [1000.0]])
    assert law.branch(np.array([0.0, 1e-9]))[0] == -1


def test_sampled_law_meets_its_function_and_keeps_its_jump() -> None:
    law = Cohesive(1e6, 1e-5)
    np.testing.assert_array_equal(law.kinks, [1e-5])
    np.testing.assert_allclose(law.interval(law.kinks), [[0.5e6], [1e6]], rtol=1e-9)
    x = np.linspace(1e-8, 3e-4, 5000)
    curvature = np.where(x < 1e-5, 2e6 / 1e-10, 0.5e6 / 1e-10)
    width = np.where(x < 1e-5, 1e-5, 29e-5) / 200
    error = np.abs(law.right(x) - law.traction(x))[x != 1e-5]
    assert np.all(error <= (curvature * width**2 / 8)[x != 1e-5] * 1.001 + 1e-3)
    assert np.all(law.value(-x) == 0.0)
    np.testing.assert_array_equal(law.branch(np.array([-1.0, 5e-6, 1e-5, 2e-5, 1.0])), [0, 0, -1, 1, 2])


@given(graphs(), st.lists(st.floats(-20, 20), min_size=1, max_size=20))
def test_random_graphs(law: laws.Graph, displacements: list[float]) -> None:
    """The graph read directly (np.interp), integrated by the trapezoidal rule, split, bounded."""
    x = np.unique(np.concatenate([displacements, law.graph.breaks]))
    table = np.array(law.points)
    inside = x[(x > 0) & ~np.isin(x, table[:, 0])]
    np.testing.assert_allclose(law.right(inside), np.interp(inside, *table.T), rtol=1e-12, atol=1e-12)
    steps = 0.5 * (law.right(x[:-1]) + law.left(x[1:])) * np.diff(x)
    np.testing.assert_allclose(np.diff(law.value(x)), steps, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(law.convex.value(x) - law.concave.value(x), law.value(x), atol=1e-10)
    for part in (law.convex, law.concave):
        slopes = np.column_stack([part.left(x), part.right(x)]).ravel()
        assert np.all(np.diff(slopes) >= -1e-11)
    hi = law.interval(x)[1]
    assert hi.max() <= law.peak.plus + 1e-12
    assert law.peak.plus in {*hi, law.growth.plus, -law.growth.minus}
    assert law.even or law.one_sided


def test_names_and_parameters_from_plain_data() -> None:
    assert set(laws.available()) >= {
        "quadratic_linear",
        "quadratic_linear_literal",
        "tresca",
        "linear_spring",
        "graph",
        "exponential",
        "sawtooth",
        "cohesive_of_the_tests",
    }
    law = laws.create("quadratic_linear", {"gamma1": 1000, "gamma2": np.float64(500), "delta": 9e-6})
    assert law == MODEL
    assert laws.create("cohesive_of_the_tests", {"strength": 1, "opening": 1e-5}) == Cohesive(1.0, 1e-5)
    graph = laws.create("graph", {"points": np.array([[0, 0], [1, 2]]), "one_sided": True})
    assert graph == laws.Graph(((0.0, 0.0), (1.0, 2.0)), True)


@pytest.mark.parametrize(
    ("name", "parameters", "said"),
    [
        ("quadratic_linera", {}, "did you mean 'quadratic_linear'"),
        ("nothing", {}, "available: .*tresca"),
        ("coulomb", {}, "no derivative of an energy"),
        ("tresca", {"yield_tracton": 1.0}, "did you mean 'yield_traction'.*takes yield_traction"),
        ("tresca", {}, "yield_traction missing"),
        ("tresca", {"yield_traction": "3"}, "valid number"),
        ("tresca", {"yield_traction": True}, "valid number"),
        ("tresca", {"yield_traction": float("nan")}, "finite"),
        ("tresca", {"yield_traction": float("inf")}, "finite"),
        ("tresca", {"yield_traction": 10**400}, "number"),
        ("tresca", {"yield_traction": -1.0}, "must be > 0"),
        ("tresca", {"yield_traction": object()}, "plain data"),
        ("quadratic_linear", {"gamma1": 1e3, "gamma2": 4e2, "delta": 1.0}, 'law = "graph", points = '),
        (
            "exponential",
            {"peak_traction": 1.0, "residual_traction": 2.0, "delta": 1.0},
            "residual_traction <= peak",
        ),
        ("sawtooth", {"peak_traction": 1.0, "residual_traction": 0.0, "delta": 1.0, "drops": 2.5}, "integer"),
        ("sawtooth", {"peak_traction": 1.0, "residual_traction": 0.0, "delta": 1.0, "drops": 0}, "from 1 to 1000"),
        ("graph", {"points": []}, "first point"),
        ("graph", {"points": [[1e-6, 2.0]]}, "first point"),
        ("graph", {"points": [[0, 0], [1, 2, 3]]}, r"points\[1\]"),
        ("graph", {"points": [[0, 0], [2, 1], [1, 1]]}, "order the points"),
        ("graph", {"points": [[0, 0], [1, 1], [1, 3], [1, 2]]}, "three points"),
        ("graph", {"points": [[0, 1], [0, 3], [1, 2]]}, "starts at"),
        ("graph", {"points": [[0, 0], [1, 0]]}, "leave the law away"),
        ("graph", {"points": [[0, 0], [1e-320, 1]]}, "too steep"),
        ("graph", {"points": [[0, 0], [1, 2]], "one_sided": 1}, "one_sided"),
    ],
)
def test_refusals(name: str, parameters: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        laws.create(name, parameters)


@pytest.mark.parametrize(
    ("numbers", "said"),
    [((-1.0, 2.0), "energy_ratio = -1.0 must be > 0"), ((2.0, 0.5), "exponent = 0.5 must be at least 1")],
)
def test_a_criterion_of_mixed_mode_is_refused_as_what_it_is(numbers: tuple[float, float], said: str) -> None:
    with pytest.raises(InputError, match=f"^mixity 'power_law': {said}"):
        laws.PowerLaw(*numbers)
