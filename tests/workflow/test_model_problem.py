"""Closed forms of linear elasticity on a floor: what a run must reproduce to rounding before anything else is believed.

Constant stress is exact in P1 on every mesh, so without friction the paper's model problem has known displacements,
energy and contact pressure, in all its variants: side, plane strain, gap, expression, the floor turned into any side.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scenes import NU, STEEL, E, P, Q, Table, displacement, energy, far, model, points, solved

from hvi_fenicsx import Solution

Array = npt.NDArray[np.float64]
STRETCH, SINK = (P + NU * Q) / E, (Q + NU * P) / E
FLOOR = {"contact": {"gap": 0.0}}


def pressure(solution: Solution) -> Array:
    """σ_n on the floor, N/m²."""
    assert solution.examination is not None
    return np.asarray(solution.examination.states[0].pressure * solution.problem.scales.stress)


def assert_uniform(solution: Solution, wanted: Array, joules: float, contact: float = -Q) -> None:
    assert solution.exit_code == 0
    for component in range(wanted.shape[1]):
        assert far(displacement(solution)[:, component], wanted[:, component]) < 1e-9
    assert energy(solution) == pytest.approx(joules, rel=1e-9)
    assert pressure(solution) == pytest.approx(contact, rel=1e-8)


def exact(solution: Solution, origin: tuple[float, float] = (0.0, 0.0)) -> Array:
    """u1 = 6.0e-6 x, u2 = -6.0e-6 y of physics.md, measured from where the body is held."""
    x = points(solution) - origin
    return np.column_stack([STRETCH * x[:, 0], -SINK * x[:, 1]])


@pytest.mark.parametrize("linear_solver", ["lu", "gamg"])
@pytest.mark.parametrize("cells", [1, 2, 5, 16, 40])
def test_the_frictionless_model_problem_is_exact_on_every_mesh(cells: int, linear_solver: str) -> None:
    found = solved(model(cells, linear_solver=linear_solver, tolerance=1e-11))
    assert_uniform(found, exact(found), -6.0)


def test_plane_strain_has_the_moduli_of_plane_strain() -> None:
    table = model()
    table["material"]["model"] = "plane_strain"
    stiff, poisson = E / (1 - NU**2), NU / (1 - NU)
    found = solved(table)
    x = points(found)
    stretch, sink = (P + poisson * Q) / stiff, (Q + poisson * P) / stiff
    assert_uniform(found, np.column_stack([stretch * x[:, 0], -sink * x[:, 1]]), -(P * stretch + Q * sink) / 2)


def test_a_long_body_of_many_sizes_has_the_energy_of_its_sides() -> None:
    table = model()
    table["domain"] |= {"size": [3.0, 0.02], "cells": [7, 3]}
    found = solved(table)
    assert_uniform(found, exact(found), -(P * STRETCH + Q * SINK) * 3.0 * 0.02 / 2)


@pytest.mark.parametrize("gap", [1.0e-6, 0.02, -3.0e-6, "2e-6 + 0*x"])
def test_a_body_above_its_floor_comes_down_on_it(gap: Any) -> None:
    """Nothing but the floor stops the fall, and the load's work is that of the fall more."""
    fall = gap if isinstance(gap, float) else 2e-6
    found = solved(model(gap=gap))
    assert_uniform(found, exact(found) - [0.0, fall], -6.0 - Q * fall)
    assert found.examination is not None
    assert np.all(found.examination.states[0].contact)


def test_an_inclined_gap_lets_the_body_rest_on_its_nearest_end_only() -> None:
    """Statics: the wall bears no vertical force, so the floor bears Q; a rigid body would touch at one end."""
    found = solved(model(8, pull=0.0, gap="1e-3*x"))
    assert found.examination is not None
    state = found.examination.states[0]
    force = state.surface.weights * state.pressure
    assert found.exit_code == 0
    assert np.sum(force) == pytest.approx(-1.0, rel=1e-9)
    touching = state.surface.points[state.contact, 0]
    assert 0 < len(touching) < 9
    assert np.max(touching) < np.min(state.surface.points[~state.contact, 0])


SIDES = {
    "bottom": ("left", 0, "right", [P, 0.0], "top", [0.0, -Q]),
    "top": ("left", 0, "right", [P, 0.0], "bottom", [0.0, Q]),
    "left": ("bottom", 1, "top", [0.0, P], "right", [-Q, 0.0]),
    "right": ("top", 1, "bottom", [0.0, -P], "left", [Q, 0.0]),
}


def turned(floor: str) -> Table:
    """The model problem with its floor at another side."""
    wall, axis, pulled, pull, pressed, press = SIDES[floor]
    held: list[Any] = ["free", "free"]
    held[axis] = 0.0
    table = model(3)
    table["boundary"] = {
        "wall": {"on": wall, "displacement": held},
        "pull": {"on": pulled, "traction": pull},
        "press": {"on": pressed, "traction": press},
        "floor": {"on": floor, **FLOOR},
    }
    return table


@pytest.mark.parametrize("floor", SIDES)
def test_any_side_may_be_the_floor(floor: str) -> None:
    """The far ends of the body stretch by P + νQ along the wall's normal and sink by Q + νP towards the floor."""
    axis = SIDES[floor][1]
    found = solved(turned(floor))
    origin = np.array([float("right" in (floor, SIDES[floor][0])), float("top" in (floor, SIDES[floor][0]))])
    rates = np.array([STRETCH, -SINK] if axis == 0 else [-SINK, STRETCH])
    assert_uniform(found, (points(found) - origin) * rates, -6.0)


def test_a_traction_may_be_a_formula_and_two_tables_may_share_a_side() -> None:
    """The floor bears the integral of -1e6 (1 + x) - 1e6 y² over the top, y being 1 there."""
    table = model(8)
    table["boundary"]["press"]["traction"] = [0.0, "-1e6*(1 + x)"]
    table["boundary"]["more"] = {"on": "top", "traction": [0.0, "-1e6*y**2"]}
    found = solved(table)
    assert found.exit_code == 0
    assert found.examination is not None
    weights = found.examination.states[0].surface.weights
    assert np.sum(weights * pressure(found)) == pytest.approx(-2.5e6, rel=1e-9)


def heavy(cells: int) -> Table:
    """A column between two smooth walls under its own weight f and the load Q."""
    table = model(cells)
    del table["boundary"]["pull"]
    table["boundary"]["wall"]["on"] = ["left", "right"]
    table["body"] = {"force": [0.0, -2.0 * Q]}
    return table


def test_own_weight_is_borne_by_the_floor_and_its_energy_converges_like_h_squared() -> None:
    """σ_y = -(Q + f (1 - y)), ε_y = (1 - ν²) σ_y / E: the energy is -½ ∫ σ_y ε_y = -13/6 (1 - ν²) Q² / E for f = 2Q."""
    wanted = -13 / 6 * (1 - NU**2) * Q**2 / E
    runs = [solved(heavy(cells)) for cells in (4, 8, 16)]
    for found in runs:
        assert found.examination is not None
        assert np.sum(found.examination.states[0].surface.weights * pressure(found)) == pytest.approx(
            -3.0 * Q, rel=1e-9
        )
    errors = [energy(found) / wanted - 1 for found in runs]
    assert all(e < 0 for e in errors)  # a conforming method has more energy than the exact solution
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def test_a_prescribed_displacement_alone_drives_the_body() -> None:
    """Pulled by 1e-5 m at the right, free above: σ_x = E 1e-5, u2 = -ν 1e-5 y, and the floor bears nothing."""
    table = model(3)
    table["boundary"] = {
        "wall": {"on": "left", "displacement": [0.0, "free"]},
        "pull": {"on": "right", "displacement": ["1e-5*x", "free"]},
        "floor": {"on": "bottom", "displacement": ["free", 0.0]},
    }
    found = solved(table)
    assert found.exit_code == 0
    assert far(displacement(found), points(found) * [1e-5, -NU * 1e-5]) < 1e-9
    assert energy(found) == pytest.approx(E * 1e-10 / 2, rel=1e-9)


def test_steel_is_not_all_there_is() -> None:
    """Displacements go with 1/E over fifteen orders of magnitude; ν = 0 has no lateral strain."""
    table = model(2)
    for modulus in (1.0e-3, 1.0e12):
        table["material"] = {**STEEL, "youngs_modulus": modulus, "poisson_ratio": 0.0}
        found = solved(table)
        assert far(displacement(found), points(found) * [P / modulus, -Q / modulus]) < 1e-9
