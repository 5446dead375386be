"""A curved interface: two rings under pressure inside, against Lamé's closed form, and with the sides exchanged."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scenes import Table, solved

from hvi_fenicsx import Solution

E, NU, P = 2.0e11, 0.3, 1.0e6
INNER, BETWEEN, OUTER = 1.0, 2.0, 3.0
ENERGY = -(np.pi / 4) * P**2 / E * INNER**3 / (OUTER**2 - INNER**2) * ((1 - NU) + (1 + NU) * (OUTER / INNER) ** 2)
PRESSURE = P * INNER**2 / (OUTER**2 - INNER**2) * ((OUTER / BETWEEN) ** 2 - 1)


def ring(number: int, low: float, high: float, around: int, through: int) -> str:
    """A quarter of a ring in gmsh's words; sides of the names low, high, flat and upright with the number."""
    p = 100 * number
    return f"""
Point({p}) = {{0, 0, 0}};
Point({p + 1}) = {{{low}, 0, 0}};  Point({p + 2}) = {{{high}, 0, 0}};
Point({p + 3}) = {{0, {high}, 0}}; Point({p + 4}) = {{0, {low}, 0}};
Line({p + 1}) = {{{p + 1}, {p + 2}}}; Circle({p + 2}) = {{{p + 2}, {p}, {p + 3}}};
Line({p + 3}) = {{{p + 3}, {p + 4}}}; Circle({p + 4}) = {{{p + 4}, {p}, {p + 1}}};
Curve Loop({p}) = {{{p + 1}, {p + 2}, {p + 3}, {p + 4}}}; Plane Surface({p}) = {{{p}}};
Transfinite Curve {{{p + 1}, {p + 3}}} = {through + 1}; Transfinite Curve {{{p + 2}, {p + 4}}} = {around + 1};
Transfinite Surface {{{p}}};
Physical Curve("flat{number}") = {{{p + 1}}};    Physical Curve("high{number}") = {{{p + 2}}};
Physical Curve("upright{number}") = {{{p + 3}}}; Physical Curve("low{number}") = {{{p + 4}}};
Physical Surface("ring{number}") = {{{p}}};
"""


@cache
def rings(folder: Path, n: int, *, exchanged: bool = False) -> Solution:
    """Two rings whose meshes do not match, n cells around the inner one."""
    file = folder / f"rings{n}.geo"
    file.write_text(ring(1, INNER, BETWEEN, n, n // 2) + ring(2, BETWEEN, OUTER, n * 3 // 4, n // 2))
    sides = ["low2", "high1"] if exchanged else ["high1", "low2"]
    table: Table = {
        "domain": {"shape": "file", "file": str(file)},
        "material": {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": NU},
        "boundary": {
            "inside": {"on": "low1", "pressure": P},
            "flat": {"on": ["flat1", "flat2"], "displacement": ["free", 0.0]},
            "upright": {"on": ["upright1", "upright2"], "displacement": [0.0, "free"]},
        },
        "interface": {"seam": {"between": sides, "contact": {"gap": 0.0}}},
    }
    return solved(table)


def energy(found: Solution) -> float:
    assert found.exit_code == 0, found.reason
    assert found.examination is not None
    return found.examination.energy * found.problem.scales.energy


def pressures(found: Solution) -> tuple[float, float]:
    """The mean contact pressure off the ends of the interface, and its largest deviation from the closed form."""
    assert found.examination is not None
    (state,) = found.examination.states
    angle = np.arctan2(*state.surface.points[:, 1::-1].T)
    within = (angle > 0.3) & (angle < np.pi / 2 - 0.3)
    pressure = -state.pressure[within] * found.problem.scales.stress
    return float(pressure.mean()), float(np.abs(pressure - PRESSURE).max())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rings")


def test_errors_fall_at_the_order_of_the_mesh(folder: Path) -> None:
    """Energy: second order; so is the pressure of single vertices here, and all of them are closed."""
    coarse, fine = (rings(folder, n) for n in (16, 32))
    errors = [abs(energy(found) - ENERGY) for found in (coarse, fine)]
    assert errors[1] < 0.005 * abs(ENERGY)
    assert errors[0] / errors[1] > 3.4
    assert pressures(fine)[0] == pytest.approx(PRESSURE, rel=0.01)
    assert pressures(fine)[1] < 0.6 * pressures(coarse)[1]


def test_exchanging_the_sides_changes_less_with_each_mesh(folder: Path) -> None:
    differences = [abs(energy(rings(folder, n)) - energy(rings(folder, n, exchanged=True))) for n in (16, 32)]
    assert differences[1] < 1e-3 * abs(ENERGY)
    assert differences[0] / differences[1] > 3.0


def test_forces_on_both_sides_balance(folder: Path) -> None:
    found = rings(folder, 16)
    assert found.forces is not None
    forces = found.forces.resultants(found.problem.domain.mesh.comm)
    one, other = np.array(forces["seam"]), np.array(forces["seam.second"])
    assert np.abs(one + other).max() <= 1e-12 * np.abs(one).max()
