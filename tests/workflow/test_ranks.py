"""One, two and three ranks must tell the same: parallel faults (ghosts, shared vertices, sums) show nowhere else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from runs import contact, run_all, summary
from scenes import Table, block, model, quadratic_linear

RANKS = (1, 2, 3)
PAPER = quadratic_linear(1.0e3)
SCENES: dict[str, Table] = {
    "paper": model(16, friction=PAPER, smoothing="paper", epsilon_absolute=0.1),
    "exact": model(16, friction=PAPER),
    "lift-off": model(13, 6e6, 1e6, quadratic_linear(3e6)),
    "gamg": model(24, 6e6, 1e6, quadratic_linear(3e6), linear_solver="gamg"),
    "tresca": model(10, 3e6, 1e6, {"law": "tresca", "yield_traction": 5e5}),
    "fewer-cells-than-ranks": model(1, friction=quadratic_linear(1e6)),
    "metastable": block(6, 0.6e6, 1e6, quadratic_linear(1e6)),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with NAME-RANKS for all scenes."""
    folder = tmp_path_factory.mktemp("ranks")
    for table in SCENES.values():
        table["solver"]["tolerance"] = 1e-12
    for ranks in RANKS:
        run_all(folder, SCENES, ranks)
    return folder


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", SCENES)
def test_several_ranks_tell_what_one_tells(name: str, ranks: int, results: Path) -> None:
    one, other = results / f"{name}-1", results / f"{name}-{ranks}"
    assert summary(other)["ranks"] == ranks
    assert summary(other)["energy"] == pytest.approx(summary(one)["energy"], rel=1e-10)
    assert same_summary(summary(one), summary(other))
    assert_same_table(contact(one), contact(other))


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", SCENES)
def test_each_of_them_is_certified(name: str, ranks: int, results: Path) -> None:
    """The law of the paper's own data is a thousandth of the load: there rounding leaves 1e-11 of its traction."""
    record = summary(results / f"{name}-{ranks}")
    certificate, weak = record["certificate"], name in ("paper", "exact")
    assert record["exit_code"] == 0
    assert (certificate["rounding"] or 0.0) < (1e-10 if weak else 1e-11)
    for entry in ("equilibrium", "penetration", "tension", "complementarity", "inclusion"):
        assert certificate[entry] <= max(1e-12, certificate["rounding"] or 0.0), entry


def same_summary(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """What is no matter of rounding or time."""
    keys = ("scene", "dofs", "reason", "exit_code", "method", "effects")
    contacts = all(one["contact"][key] == other["contact"][key] for key in ("vertices", "active"))
    states = one["solvability"]["state"] == other["solvability"]["state"]
    return all(one[key] == other[key] for key in keys) and contacts and states


def assert_same_table(one: Any, other: Any) -> None:
    """Each column to 1e-8 of its largest absolute value."""
    assert one.dtype.names == other.dtype.names
    assert np.array_equal(one["part"], other["part"])
    for column in one.dtype.names[1:]:
        a, b = np.asarray(one[column], dtype=float), np.asarray(other[column], dtype=float)
        assert np.array_equal(np.isnan(a), np.isnan(b)), column
        assert np.all(np.abs(a - b)[~np.isnan(a)] <= 1e-8 * np.nanmax(np.abs(a), initial=0.0)), column


def same_sides(one: Path, other: Path) -> bool:
    """Which vertices lie on which boundary table; coordinates may differ in the last digit."""
    mine, theirs = (np.loadtxt(f / "boundary.csv", delimiter=",", skiprows=1, usecols=(1, 2)) for f in (one, other))
    names = [[line.split(",")[0] for line in (f / "boundary.csv").read_text().splitlines()] for f in (one, other)]
    return names[0] == names[1] and bool(np.allclose(mine, theirs, rtol=0, atol=1e-12))
