"""One, two and three ranks must tell the same: parallel faults (ghosts, shared vertices, sums) show nowhere else.

All that whole runs on several ranks are asked for is here, since starting MPI takes longer than most of these scenes.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import numpy.typing as npt
import pytest
from runs import RANKS, ROOT, contact, run_all, summary, table
from scenes import STEEL, Table, block, model, quadratic_linear, two_blocks

from hvi_fenicsx import read_scene

PAPER = quadratic_linear(1.0e3)
HELD_BELOW = model(4)
HELD_BELOW["boundary"]["floor"] = {"on": "bottom", "displacement": ["free", 0.0]}
CUBE: Table = {
    "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [2, 2, 2]},
    "material": STEEL | {"model": "three_dimensional"},
    "boundary": {
        "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
        "press": {"on": "top", "traction": ["1e6*x", 0.0, "-1e6*(1.2 - 1.8*x)"]},
        "floor": {"on": "bottom", "contact": {"gap": "1e-7*x*y"}, "friction": quadratic_linear(1e6)},
    },
    "solver": {"degree": 2},
}


RUBBER_BELOW = two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_strain")
"""Only one of two bodies is nearly incompressible."""
RUBBER_BELOW["material"] = {
    "lower": STEEL | {"model": "plane_strain", "poisson_ratio": 0.499, "region": "lower"},
    "upper": STEEL | {"model": "plane_strain", "region": "upper"},
}
SCENES: dict[str, Table] = {
    "paper": model(16, friction=PAPER, smoothing="paper", epsilon_absolute=0.1),
    "exact": model(16, friction=PAPER),
    "lift-off": model(
        13, 6e6, 1e6, quadratic_linear(2.5e6) | {"multiplier": "1 + 0.4*x", "length_multiplier": "1 + x/3"}
    ),
    "levels": model(56, 6e6, 1e6, quadratic_linear(3e6)),  # solved by multigrid, its coarser level on one rank
    "odd-levels": model(101, 6e6, 1e6, quadratic_linear(3e6)),  # a block whose cells cannot be halved
    "gamg": model(24, 6e6, 1e6, quadratic_linear(3e6), linear_solver="gamg"),
    "tresca": model(10, 3e6, 1e6, {"law": "tresca", "yield_traction": 5e5}),
    "fewer-cells-than-ranks": model(1, friction=quadratic_linear(1e6)),
    "metastable": block(6, 0.6e6, 1e6, quadratic_linear(1e6)),
    "of-a-mesh-file": model(4, 6e6, 1e6, quadratic_linear(3e6)),
    "linear": HELD_BELOW,
    "degree-2": model(6, 6e6, 1e6, quadratic_linear(3e6), degree=2),
    "degree-2-in-space": CUBE,
    "joined": two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_stress"),
    "joined-high": two_blocks("rectangle", [1.0], [[8, 12], [9, 12]], "plane_stress"),  # a rank without the seam
    "joined-degree-2": two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_stress", degree=2),
    "joined-rubber": RUBBER_BELOW,
    "joined-in-space": two_blocks("box", [1.0, 1.0], [[4, 3, 2], [3, 4, 2]], "three_dimensional"),
}
DEMOS: dict[str, list[str]] = {"hertz": [], "thermal_bar": [], "strong_law": ["domain.cells=[12, 12]"]}
"""A shape that gmsh meshes on rank 0, a heated bar of two materials, a field of stresses; at their own tolerances."""
LATE = {"exact", "tresca", "gamg", "metastable", "degree-2", "joined", "joined-degree-2", "thermal_bar"}
"""Scenes of the long tests: each has another like it among the fast ones."""


class Results:
    """Folders NAME-RANKS; all scenes of one number of ranks run when the first of them is asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.done = folder, set[tuple[int, bool]]()
        tables = {name: table | {"solver": {**table["solver"], "tolerance": 1e-12}} for name, table in SCENES.items()}
        file = meshes.make(folder / "square.msh", meshes.GOOD)
        tables["of-a-mesh-file"]["domain"] = {"shape": "file", "file": str(file)}
        for name, changes in DEMOS.items():
            tables[name] = read_scene(ROOT / "demos" / f"{name}.toml", changes).tables()
        self.tables = tables

    def of(self, name: str, ranks: int) -> Path:
        """The folder of one run."""
        late = name in LATE
        if (ranks, late) not in self.done:
            run_all(self.folder, {n: t for n, t in self.tables.items() if (n in LATE) == late}, ranks)
            self.done.add((ranks, late))
        return self.folder / f"{name}-{ranks}"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The runs of all scenes."""
    return Results(tmp_path_factory.mktemp("ranks"))


def scenes(names: Iterable[str]) -> list[Any]:
    """Names as parameters; some scenes run with the long tests only."""
    return [pytest.param(name, marks=pytest.mark.long if name in LATE else ()) for name in names]


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", scenes(SCENES))
def test_several_ranks_tell_what_one_tells(name: str, ranks: int, results: Results) -> None:
    one, other = results.of(name, 1), results.of(name, ranks)
    assert summary(other)["ranks"] == ranks
    assert summary(other)["energy"] == pytest.approx(summary(one)["energy"], rel=1e-10)
    assert same_summary(summary(one), summary(other))
    if (one / "contact.csv").exists():
        assert_same_table(contact(one), contact(other), 1e-10 if name.startswith("joined") else 1e-8)


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", scenes(SCENES))
def test_each_of_them_is_certified(name: str, ranks: int, results: Results) -> None:
    """The law of the paper's own data is a thousandth of the load: there rounding leaves 1e-11 of its traction."""
    record = summary(results.of(name, ranks))
    certificate, weak = record["certificate"], name in ("paper", "exact")
    assert record["exit_code"] == 0
    assert (certificate["rounding"] or 0.0) < (1e-10 if weak else 1e-11)
    for entry in ("equilibrium", "net_force", "penetration", "tension", "complementarity", "inclusion"):
        assert certificate[entry] <= max(1e-12, certificate["rounding"] or 0.0), entry


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", scenes(["lift-off", "tresca", "of-a-mesh-file", "joined", "joined-in-space"]))
def test_the_error_is_estimated_alike(name: str, ranks: int, results: Results) -> None:
    one, other = (summary(results.of(name, n))["estimate"] for n in (1, ranks))
    for entry in ("relative", "discretisation", "energy_norm"):
        assert other[entry] == pytest.approx(one[entry], rel=1e-10), entry


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", scenes(list(DEMOS)))
def test_several_ranks_find_what_one_finds(name: str, ranks: int, results: Results) -> None:
    one, other = (summary(results.of(name, n)) for n in (1, ranks))
    assert other["exit_code"] == 0
    assert other["energy"] == pytest.approx(one["energy"], rel=1e-9)
    assert same_summary(one, other)


@pytest.mark.parametrize("ranks", RANKS[1:])
def test_several_ranks_write_the_stress_of_one(ranks: int, results: Results) -> None:
    one, other = (stresses(results.of("strong_law", n)) for n in (1, ranks))
    assert np.ptp(one) > 0.1 * one.max()
    np.testing.assert_allclose(other, one, rtol=1e-6)


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", ["lift-off", "of-a-mesh-file", "fewer-cells-than-ranks"])
def test_several_ranks_write_the_forces_of_one(name: str, ranks: int, results: Results) -> None:
    one, other = results.of(name, 1), results.of(name, ranks)
    assert_same_table(table(one / "boundary.csv"), table(other / "boundary.csv"))
    forces, largest = summary(one)["resultants"], 6e6
    assert list(forces) == list(summary(other)["resultants"])
    for place, force in summary(other)["resultants"].items():
        assert force == pytest.approx(forces[place], abs=1e-9 * largest), place


def stresses(folder: Path) -> npt.NDArray[np.float64]:
    """Von Mises stresses by cell, as ParaView reads them, in an order that no numbering changes."""
    pyvista = pytest.importorskip("pyvista")
    body = pyvista.get_reader(folder / "displacement.pvd").read()[0]
    own = body.cell_data["vtkGhostType"] == 0 if "vtkGhostType" in body.cell_data else slice(None)
    middle = np.round(body.cell_centers().points[own], 9)
    return np.asarray(body.cell_data["von_mises"][own][np.lexsort(middle.T)])


def same_summary(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """What is no matter of rounding or time."""
    keys = ("scene", "dofs", "reason", "exit_code", "method", "effects")
    contacts = one["contact"] is other["contact"] is None or all(
        one["contact"][key] == other["contact"][key] for key in ("vertices", "active")
    )
    states = one["solvability"]["state"] == other["solvability"]["state"]
    return all(one[key] == other[key] for key in keys) and contacts and states


def assert_same_table(one: Any, other: Any, part: float = 1e-8) -> None:
    """Each column to a part of its largest absolute value."""
    assert one.dtype.names == other.dtype.names
    assert np.array_equal(one["part"], other["part"])
    for column in one.dtype.names[1:]:
        a, b = np.asarray(one[column], dtype=float), np.asarray(other[column], dtype=float)
        assert np.array_equal(np.isnan(a), np.isnan(b)), column
        assert np.all(np.abs(a - b)[~np.isnan(a)] <= part * np.nanmax(np.abs(a), initial=0.0)), column
