"""A stiffness that is not formed against the same as an array: products, cells, exchanges, negative directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from runs import ROOT
from scenes import model

import hvi_fenicsx as hvi
from hvi_fenicsx import Model, prepare, read_tables
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.reduced.condensed_stiffness import CellColumns, CondensedStiffness, DenseStiffness
from hvi_fenicsx.reduced.factorised_stiffness import FactorisedStiffness

SPRING = {"law": "graph", "points": [[0, 0], [9e-6, 3e6], [9e-6, 1.5e6]]}


def both(table: Model) -> tuple[DenseStiffness, CondensedStiffness]:
    """S as an array and without, on the same unknowns."""
    system = prepare(table).system
    unformed = Condensation(system, None, 0).problem.elastic
    assert isinstance(unformed, FactorisedStiffness)
    formed = Condensation(system).problem.elastic
    assert isinstance(formed, DenseStiffness)
    return formed, unformed


def plane() -> Model:
    return read_tables(model(5, friction=SPRING))


def space() -> Model:
    return hvi.read_scene(ROOT / "demos" / "anchor_3d.toml", ["domain.cells=[2,3,2]"])


@pytest.mark.parametrize("scene", [plane, space])
def test_products_are_those_of_the_array(scene: Callable[[], Model]) -> None:
    formed, unformed = both(scene())
    n, size = len(formed.array), float(np.max(formed.diagonal))
    x = np.random.default_rng(0).standard_normal(n)
    for one, other in ((formed, unformed), (formed.raised(0.3), unformed.raised(0.3))):
        assert other @ x == pytest.approx(one @ x, abs=1e-12 * size)
        assert other.column(n // 2) == pytest.approx(one.column(n // 2), abs=1e-12 * size)
        assert other.array == pytest.approx(one.array, abs=1e-12 * size)
        assert np.all(other.diagonal >= one.diagonal * (1.0 - 1e-12))


def cell(n: int, seed: int, driver: int | None) -> CellColumns:
    """A third of the unknowns stands; some laws fall."""
    rng = np.random.default_rng(seed)
    rise = rng.choice([0.0, 0.0, 0.0, 0.0, 1.0, -1.0], n)
    slope = np.where(rise == 0.0, rng.uniform(-0.3, 0.5, n), 0.0)
    return CellColumns(slope=slope, rise=rise, driver=driver, factor=rng.standard_normal(n))


@pytest.mark.parametrize("driver", [None, 0, 3, 4])
def test_cells_are_inverted_and_their_columns_exchanged(driver: int | None) -> None:
    formed, unformed = both(plane())
    n = len(formed.array)
    columns = cell(n, 1, driver)
    moving = columns.rise == 0.0
    matrix = np.where(moving, formed.array, 0.0) + np.diag(np.where(moving, columns.slope, columns.rise))
    if driver is not None:
        matrix[:, driver] = columns.factor
    rng = np.random.default_rng(2)
    for stiffness in (formed, unformed):
        inverse, changed = stiffness.inverse(columns), matrix.copy()
        for place in (2, 5, 2):
            entering, right = rng.standard_normal((2, n))
            before = inverse.copy()
            inverse.exchange(inverse.solve(entering), place)
            changed[:, place] = entering
            assert changed @ inverse.solve(right) == pytest.approx(right, abs=1e-9)
            assert not np.allclose(before.solve(right), inverse.solve(right))
        inverse.swap(1, 4)
        assert (changed @ inverse.solve(right)[[0, 4, 2, 3, 1, *range(5, n)]]) == pytest.approx(right, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_negative_directions_are_those_of_the_eigenvalues(seed: int) -> None:
    formed, unformed = both(plane())
    columns = cell(len(formed.array), seed, None)
    moving, slope = columns.moving, 10.0 * columns.slope - 2.0
    free = np.flatnonzero(moving)
    values = np.linalg.eigvalsh(formed.array[np.ix_(free, free)] + np.diag(slope[free]))
    for stiffness in (formed, unformed):
        assert stiffness.negative_directions(moving, slope, 1e-12) == np.count_nonzero(values < 0.0)
        assert stiffness.negative_directions(moving, slope, 1e-12) > 0
