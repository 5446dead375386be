"""Bounds of a law's slopes on intervals: against samples, and on short intervals against the slope there."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx import laws
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.typing import Array

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
TEETH = laws.Sawtooth(3.0, 1.0, 0.5, 3)
LAWS = {
    "polyline": MODEL,
    "teeth": TEETH,
    "exponential": laws.Exponential(2.0, 0.5, 1.0),
    "other units": laws.Superpotential.scaled(laws.Exponential(2.0, 0.5, 1.0), 0.5, 3.0),
    "default units": laws.base.ScaledLaw(laws.Exponential(2.0, 0.5, 1.0), 0.5, 3.0),
    "chks": registered()["chks"]().relative(MODEL, 0.05),
    "log_exp": registered()["log_exp"]().relative(TEETH, 0.02),
    "quadratic": registered()["quadratic"]().relative(MODEL, 0.1),
    "paper": registered()["paper"]().relative(MODEL, 0.1),
    "paper, wide": registered()["paper"]().relative(MODEL, 0.9),
    "smoothed exponential": registered()["chks"]().relative(laws.Exponential(2.0, 0.5, 1.0), 0.02),
}


def slopes(law: laws.Superpotential, x: Array) -> Array:
    return law.convex.second(x) - law.concave.second(x)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_no_slope_is_outside_its_range(law: laws.Superpotential) -> None:
    random = np.random.default_rng(1)
    low = random.uniform(-4.0, 4.0, 400)
    high = low + 10.0 ** random.uniform(-4.0, 0.7, 400)
    least, most = law.slope_range(low, high)
    x = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, 301)
    found = slopes(law, x.ravel()).reshape(x.shape)
    size = 1e-12 * np.abs(found).max()
    assert np.all(found.min(axis=1) >= least - size)
    assert np.all(found.max(axis=1) <= most + size)
    assert np.mean(most - least <= 4.0 * np.ptp(found, axis=1) + 1e-9) > 0.5  # the range is not idle
