"""Smoothings: the promised bounds and decays, limits for ε → 0, zero slip, no overflow, the paper's own S."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvi_fenicsx import laws
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.laws.base import ScaledLaw, Superpotential
from hvi_fenicsx.laws.smoothing import (
    QUADRATIC,
    Chks,
    LogExp,
    PaperSmoothedLaw,
    PlusFunction,
    create,
)

GAMMA1, GAMMA2, DELTA = 1.0e3, 0.5e3, 9.0e-6
MODEL = laws.QuadraticLinear(GAMMA1, GAMMA2, DELTA)
LAWS: dict[str, Superpotential] = {
    "model": MODEL,
    "literal": laws.QuadraticLinearLiteral(GAMMA1, GAMMA2, DELTA),
    "tresca": laws.Tresca(300.0),
    "spring": laws.LinearSpring(1e8),
    "sawtooth": laws.Sawtooth(1e3, 200.0, 2e-6, 5),
    "exponential": laws.Exponential(1e3, 300.0, 5e-6),
    "graph": laws.Graph(((0.0, 2.0), (1e-6, 5.0), (1e-6, -3.0), (2e-6, -4.0), (3e-6, 1.0), (3e-6, 6.0), (5e-6, 0.5))),
    "one-sided": laws.Graph(((0.0, 0.0), (1e-6, 5.0), (1e-6, 1.0), (2e-6, 1.0), (2e-6, 4.0)), one_sided=True),
    "scaled": ScaledLaw(MODEL, 3e-6, 7.0),
}
PLUS_FUNCTIONS: dict[str, PlusFunction] = {plus.name: plus for plus in (QUADRATIC, Chks(), LogExp())}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
each_plus = pytest.mark.parametrize("plus", PLUS_FUNCTIONS.values(), ids=PLUS_FUNCTIONS.keys())
each_epsilon = pytest.mark.parametrize("epsilon", [1e-12, 1e-6, 1e-2, 1.0, 1e3])


def around(law: Superpotential, width: float = 1e-3) -> np.ndarray:
    """Displacements on both sides, on every kink, at `width` length scales from them, and far out."""
    spread = law.length_scale * np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 61), np.linspace(0.05, 8.3, 83)])
    near = law.kinks[:, None] + width * law.length_scale * np.linspace(-1.0, 1.0, 41)
    return np.unique(np.concatenate([spread, -spread, near.ravel()]))


def literal_plus(name: str, t: float, e: float) -> float:
    """The three formulas as printed in the literature."""
    if name == "quadratic":
        return 0.0 if t <= -e / 2 else t if t >= e / 2 else (t + e / 2) ** 2 / (2 * e)
    if name == "chks":
        return (t + math.sqrt(t * t + 4 * e * e)) / 2
    return e * math.log(1 + math.exp(t / e))


def profiles(plus: PlusFunction, t: float, e: float) -> tuple[float, float]:
    """D and D'' of the plus function, where that is max(t, 0) + e D(|t|/e)."""
    with np.errstate(over="ignore"):
        found, _, second = plus.profile(np.abs(np.array([t])) / e)
    return float(found[0]), float(second[0])


@each_plus
@given(t=st.floats(-20, 20), e=st.floats(0.05, 20))
def test_plus_functions_are_their_formulas(plus: PlusFunction, t: float, e: float) -> None:
    x, h = np.array([t]), 1e-4 * e
    exact = literal_plus(plus.name, t, e)
    assert max(t, 0.0) + e * profiles(plus, t, e)[0] == pytest.approx(exact, rel=1e-12, abs=1e-12)
    slope = (literal_plus(plus.name, t + h, e) - literal_plus(plus.name, t - h, e)) / (2 * h)
    assert plus.derivative(x, e)[0] == pytest.approx(slope, abs=1e-4)
    if abs(abs(t) - e / 2) > 2 * h:
        curvature = (plus.derivative(x + h, e) - plus.derivative(x - h, e))[0] / (2 * h)
        assert profiles(plus, t, e)[1] == pytest.approx(curvature * e, abs=1e-6)


@each_plus
@given(t=st.floats(-1e300, 1e300), e=st.floats(1e-12, 1e3))
def test_error_and_decay_of_the_plus_functions(plus: PlusFunction, t: float, e: float) -> None:
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        error = max(t, 0.0) + e * profiles(plus, t, e)[0] - max(t, 0.0)
        slope = plus.derivative(np.array([t]), e)[0]
        assert np.isfinite(profiles(plus, t, e)[1] / e)
    rounding = 1e-15 * abs(t)
    assert -rounding <= error <= profiles(plus, 0.0, e)[0] * e * (1 + 1e-12) + rounding
    assert 0.0 <= slope <= 1.0
    z = abs(t) / e
    decay = {
        "quadratic": 0.0 if z >= 0.5 else 1.0,
        "chks": 1 / max(z, 1.0),
        "log_exp": math.exp(-min(z, 700)),
    }
    assert error <= decay[plus.name] * e * (1 + 1e-12) + rounding


@given(
    st.sampled_from(list(LAWS.values())),
    st.sampled_from(list(PLUS_FUNCTIONS.values())),
    st.floats(-12, 3),
    st.floats(-1e3, 1e3),
)
def test_error_bound_at_random(law: Superpotential, plus: PlusFunction, exponent: float, place: float) -> None:
    smooth = plus.relative(law, 10.0**exponent)
    x = np.append(place * law.length_scale, law.kinks + place * 10.0**exponent * law.length_scale)
    error = np.abs(smooth.value(x) - law.value(x))
    bound = profiles(plus, 0.0, 1.0)[0] * smooth.epsilon_absolute * max(law.convex.kinks.size, law.concave.kinks.size)
    assert np.all(error <= bound * (1 + 1e-12) + 1e-15 * np.abs(law.value(x)))


@each_law
@each_plus
@pytest.mark.parametrize("epsilon", [1e-2, 1.0, 1e3])
def test_derivatives_of_the_smoothed_law(law: Superpotential, plus: PlusFunction, epsilon: float) -> None:
    smooth = plus.relative(law, epsilon)
    h = 1e-6 * law.length_scale
    x = around(law)
    x = x[np.abs(x) < 10 * law.length_scale]
    quotient = (smooth.value(x + h) - smooth.value(x - h)) / (2 * h)
    rounding = 1e-15 * np.abs(smooth.value(x)).max() / h
    np.testing.assert_allclose(smooth.right(x), quotient, atol=1e-3 * law.traction_scale + rounding)
    np.testing.assert_array_equal(smooth.left(x), smooth.right(x))
    assert smooth.kinks.size == 0


@each_law
@each_plus
@each_epsilon
def test_split_of_the_smoothed_law(law: Superpotential, plus: PlusFunction, epsilon: float) -> None:
    smooth = plus.relative(law, epsilon)
    x = np.union1d(around(law), around(law, epsilon))
    h, g = smooth.convex, smooth.concave
    size = np.abs(h.value(x)) + np.abs(g.value(x)) + law.energy_scale
    assert np.all(np.abs(h.value(x) - g.value(x) - smooth.value(x)) <= 1e-13 * size)
    for part in (h, g):
        slope = part.right(x)
        assert np.all(np.diff(slope) >= -1e-12 * (np.abs(slope[1:]) + law.traction_scale))
        assert np.all(part.second(x) >= 0.0)
        assert part.kinks.size == 0


@each_law
@each_plus
def test_gradients_tend_into_the_subdifferential(law: Superpotential, plus: PlusFunction) -> None:
    """Near a kink, where x moves with ε, into the kink's interval; elsewhere to the derivative."""
    for place in law.kinks:
        gaps = []
        for epsilon in (1e-2, 1e-4, 1e-6, 1e-8):
            smooth = plus.relative(law, epsilon)
            x = place + epsilon * law.length_scale * np.linspace(-2, 2, 41)
            (lo,), (hi,) = law.interval(np.array([place]))
            gaps.append(np.maximum(np.maximum(lo - smooth.right(x), smooth.right(x) - hi), 0.0).max())
        assert gaps[-1] <= 1e-5 * law.peak.plus
        assert gaps[-1] <= gaps[0] + 1e-12 * law.peak.plus
    x = around(law)
    x = x[np.all(np.abs(x[:, None] - law.kinks) > 1e-4 * law.length_scale, axis=1)] if law.kinks.size else x
    smooth = plus.relative(law, 1e-9)
    assert law.distance(x, smooth.right(x)).max() <= 1e-6 * law.traction_scale


@each_law
@each_plus
@each_epsilon
def test_bounds_of_the_smoothed_law_hold(law: Superpotential, plus: PlusFunction, epsilon: float) -> None:
    smooth = plus.relative(law, epsilon).scaled(law.length_scale, 1.0)
    x = np.union1d(around(smooth), around(smooth, epsilon))
    slope, slack = smooth.right(x), 1e-9 * smooth.traction_scale
    assert smooth.growth == law.scaled(law.length_scale, 1.0).growth
    assert slope.max() <= smooth.peak.plus + slack
    assert -slope.min() <= smooth.peak.minus + slack
    assert np.all(-slope * x <= smooth.c4 * np.abs(x) + slack * np.abs(x))
    if np.isfinite(smooth.peak.plus):
        assert smooth.peak.plus <= max(slope.max(), smooth.growth.plus) * 1.05 + slack


def papers_s(x: float, epsilon: float) -> float:
    """S of section 5.2, letter by letter, with g read as g2 and γ2 x as γ2 |x|."""
    g1, g2 = -GAMMA1 / (2 * DELTA) * x**2, -GAMMA2 * abs(x)
    if g2 - g1 <= -epsilon / 2:
        return g1
    if g2 - g1 >= epsilon / 2:
        return g2
    return 1 / (2 * epsilon) * (g2 - g1) ** 2 + 0.5 * (g2 + g1) + epsilon / 8


PAPER_EPSILONS = (1e-8, 1e-5, 1e-3, 2.25e-3, 2.3e-3, 0.1, 10.0)


@pytest.mark.parametrize("epsilon", PAPER_EPSILONS)
def test_papers_smoothing_is_the_papers_formula(epsilon: float) -> None:
    law = PaperSmoothedLaw(MODEL, epsilon)
    x = np.linspace(-4 * DELTA, 4 * DELTA, 2001)
    expected = -np.array([papers_s(float(v), epsilon) for v in x])
    np.testing.assert_allclose(law.value(x), expected, rtol=1e-10, atol=1e-12 * law.energy_scale)
    assert np.all(np.abs(law.value(x) - MODEL.value(x)) <= epsilon / 8 * (1 + 1e-12) + 1e-16)
    h = 1e-6 * DELTA
    away = np.abs(x) > 2 * h
    tolerance = GAMMA1 * (1e-6 + h * GAMMA1 / epsilon)
    for part in (law, law.convex, law.concave):
        quotient = (part.value(x + h) - part.value(x - h)) / (2 * h)
        np.testing.assert_allclose(part.right(x)[away], quotient[away], atol=tolerance, rtol=1e-5)


def test_papers_own_data_return_250_at_zero_slip() -> None:
    law = PaperSmoothedLaw(MODEL, 0.1)
    np.testing.assert_allclose(law.right(np.array([0.0, 1e-12])), 250.0, rtol=1e-6)
    x = np.linspace(1e-9, 6e-6, 100)
    np.testing.assert_allclose(law.right(x), (GAMMA1 * x / DELTA + GAMMA2) / 2, rtol=0.05)


@pytest.mark.parametrize(
    ("kind", "given_epsilon", "said"),
    [
        ("quadratik", {"epsilon": 1.0}, "did you mean 'quadratic'"),
        ("none", {"epsilon": 1.0}, "available: chks"),
        ("chks", {}, "either epsilon"),
        ("chks", {"epsilon": 1.0, "epsilon_absolute": 1.0}, "either epsilon"),
        ("chks", {"epsilon": 0.0}, "> 0"),
        ("chks", {"epsilon": -1.0}, "> 0"),
        ("chks", {"epsilon_absolute": math.nan}, "finite"),
        ("chks", {"epsilon_absolute": math.inf}, "finite"),
        ("chks", {"epsilon": True}, "finite number"),
        ("chks", {"epsilon": "0.1"}, "finite number"),
    ],
)
def test_refusals(kind: str, given_epsilon: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        create(kind, MODEL, **given_epsilon)
