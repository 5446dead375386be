"""Laws at vertices, a row each: against the law itself, the definition of memory, and integrals of the tables."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx import laws
from hvi_fenicsx.laws import Superpotential, VertexLaws
from hvi_fenicsx.laws.smoothing import QUADRATIC
from hvi_fenicsx.typing import Array

DROPS = laws.Graph(((0.0, 0.0), (1.0, 2.0), (1.0, 0.5), (3.0, 0.0)))
LAWS = [
    DROPS,
    laws.QuadraticLinear(2.0, 1.0, 1.0),
    laws.Tresca(1.0),
    laws.Graph(((0.0, 0.0), (1.0, 2.0), (3.0, 0.0)), one_sided=True),
    laws.QuadraticLinearLiteral(2.0, 1.0, 1.0),
    QUADRATIC.relative(laws.QuadraticLinear(2.0, 1.0, 1.0), 0.1),
    laws.Exponential(2.0, 0.5, 1.0),
]


def _rows(law: Superpotential, m: int = 60) -> tuple[VertexLaws, np.random.Generator]:
    rng = np.random.default_rng(3)
    factors = rng.choice([-1.5, -1.0, 1.0, 0.5], m)
    return VertexLaws(law=law, factors=factors, weights=rng.random(m) + 0.1), rng


def _on_graphs(rows: VertexLaws, what: str, x: Array, *sides: str) -> Array:
    """What the graph of each vertex has at its coordinate."""
    found = [getattr(rows.graph(i), what)(x[i : i + 1], *sides) for i in range(len(x))]
    return np.concatenate(found)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_without_memory_the_traction_is_the_derivative_of_the_law(law: Superpotential) -> None:
    rows, rng = _rows(law)
    x, step = rng.normal(size=60), 1e-6
    rate = (rows.recoverable(x + step, x) - rows.recoverable(x - step, x)) / (2.0 * step) / rows.weights
    assert rows.limits(x)[0] == pytest.approx(rate, abs=1e-5)
    if law.graph is not None:
        assert _on_graphs(rows, "traction", x, "right") == pytest.approx(rows.limits(x)[1], abs=1e-13)
        assert _on_graphs(rows, "primitive", x) == pytest.approx(law.value(rows.factors * x) - law.value(np.zeros(1)))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_bond_unloads_along_the_secant_and_goes_on_along_its_law(law: Superpotential) -> None:
    rows, rng = _rows(law)
    far = rng.choice([-1.0, 1.0], 60) * (0.5 + rng.random(60))
    left, right = rows.limits(far)
    turned = left + rng.random(60) * (right - left)
    been = rows.with_memory.remembering(far, turned)
    places = np.outer([0.25, 0.75, 1.25], far)
    assert been.limits(places)[0][:2] == pytest.approx(np.outer([0.25, 0.75], turned))
    assert been.limits(places)[1][2] == pytest.approx(rows.limits(1.25 * far)[1])
    ends = _on_graphs(been, "traction", far, "left"), _on_graphs(been, "traction", far, "right")
    assert np.all((np.minimum(*ends) <= turned + 1e-12) & (turned <= np.maximum(*ends) + 1e-12))
    assert _on_graphs(been, "primitive", far) == pytest.approx(0.5 * turned * far)


def test_what_is_lost_is_the_area_between_law_and_secant() -> None:
    rows = VertexLaws(law=DROPS, factors=np.array([1.0]), weights=np.array([2.0])).with_memory
    far, traction = np.array([2.0]), np.array([0.25])
    area = 1.0 + 0.5 * (0.5 + 0.25)
    assert rows.dissipated(far, traction) == pytest.approx(2.0 * (area - 0.25))
    assert rows.remembering(far, traction).dissipated(np.zeros(1), np.zeros(1)) == pytest.approx(2.0 * (area - 0.25))
    spring = VertexLaws(law=laws.LinearSpring(3.0), factors=np.ones(1), weights=np.ones(1))
    assert spring.with_memory.memory is None
