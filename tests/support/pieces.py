"""Laws that change from place to place, and the same as pieces with laws of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import Table

import hvi_fenicsx as hvi

TENSILE: Table = {"law": "graph", "points": [[0, 0], [2e-6, 4e5], [9e-6, 1e5]]}
LIFTED: Table = {"on": "top", "traction": [0.0, "1e6*(2*x - 0.9)"]}


def solved(table: Table, **options: Any) -> hvi.Solution:
    """The solution without its estimate, which has converged."""
    found = hvi.solve(hvi.read_tables(table), **{"estimate": False, **options})
    assert found.converged
    return found


def assert_equal(one: hvi.Solution, two: hvi.Solution, parts: tuple[str, str], inside: slice = slice(None)) -> None:
    """Two solutions with the same energy, displacement, and tractions on a part of each, the second the shorter."""
    assert one.energy == pytest.approx(two.energy, rel=1e-9)
    np.testing.assert_allclose(one.u.x.array, two.u.x.array, atol=1e-9 * abs(two.u.x.array).max())
    for column in ("friction", "pressure"):
        whole, left = (getattr(s.contact[p], column)[inside] for s, p in zip((one, two), parts, strict=True))
        np.testing.assert_allclose(whole[: len(left)], left, rtol=1e-6, atol=1e-6 * abs(left).max())


def assert_same_equilibria(one: hvi.Model, two: hvi.Model) -> None:
    """All equilibria of two scenes, more than one, with the same energies."""
    first, second = hvi.equilibria(one), hvi.equilibria(two)
    assert first.complete
    assert len(first.solutions) == len(second.solutions) > 1
    assert [s.energy for s in first.solutions] == pytest.approx([s.energy for s in second.solutions], rel=1e-9)
