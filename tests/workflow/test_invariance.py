"""The same physics in other units, at other loads, turned and mirrored: one nondimensional solution.

Displacements are 1e-6 m and moduli 1e11 N/m²: any absolute tolerance hidden anywhere shows as a difference here.
"""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import numpy.typing as npt
import pytest
from scenes import P, Q, Table, displacement, energy, far, model, ordered, points, quadratic_linear, solved

from hvi_fenicsx import Solution

Array = npt.NDArray[np.float64]
SAWTOOTH = {"law": "graph", "points": [[0, 0], [4e-6, 8e5], [4e-6, 3e5], [9e-6, 9e5], [9e-6, 2e5]]}
SCENES: dict[str, Table] = {
    "lift-off": model(6, 6e6, Q, quadratic_linear(3e6)),
    "drop": model(6, 3e6, Q, quadratic_linear(1e6)),
    "paper": model(6, P, Q, quadratic_linear(1e3), smoothing="paper", epsilon_absolute=0.1),
    "smoothed": model(6, 6e6, Q, quadratic_linear(3e6), smoothing="quadratic", epsilon=0.01),
    "sawtooth": model(6, 3e6, Q, SAWTOOTH),
    "gap": model(6, 3e6, Q, {"law": "tresca", "yield_traction": 7e5, "reference_slip": 1e-6}, gap=2e-6),
    "lift-off, degree 2": model(6, 6e6, Q, quadratic_linear(3e6), degree=2),
    "drop, degree 2": model(6, 3e6, Q, quadratic_linear(1e6), degree=2),
}
LENGTHS = {"delta", "reference_slip", "gap"}
STRESSES = {"gamma1", "gamma2", "yield_traction", "youngs_modulus", "traction"}


def converted(value: Any, length: float, stress: float, deflection: float, key: str = "") -> Any:
    """A scene with body lengths, stresses and displacements multiplied by factors."""
    factors = {"size": length, "displacement": deflection, "epsilon_absolute": stress * deflection}
    factors |= dict.fromkeys(LENGTHS, deflection) | dict.fromkeys(STRESSES, stress)
    if key == "points":
        return [[x * deflection, t * stress] for x, t in value]
    if isinstance(value, dict):
        return {k: converted(v, length, stress, deflection, k) for k, v in value.items()}
    if isinstance(value, list):
        return [converted(v, length, stress, deflection, key) for v in value]
    return value * factors[key] if isinstance(value, float) and key in factors else value


def nondimensional(found: Solution) -> Array:
    assert found.exit_code == 0
    assert found.solve_result is not None
    return np.asarray(found.solve_result.u.x.array)


def assert_same(one: Table, other: Table, energy_factor: float) -> None:
    a, b = solved(one), solved(other)
    assert far(nondimensional(b), nondimensional(a)) < 1e-9
    assert energy(b) == pytest.approx(energy_factor * energy(a), rel=1e-9)


UNITS = {"micrometre-MPa": (1e6, 1e-6), "km-GPa": (1e-3, 1e-9)}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", SCENES)
def test_units_do_not_matter(name: str, units: str) -> None:
    length, stress = UNITS[units]
    other = converted(copy.deepcopy(SCENES[name]), length, stress, length)
    assert_same(SCENES[name], other, stress * length**2)


@pytest.mark.parametrize("name", SCENES)
def test_stiffer_bodies_under_larger_loads_move_alike(name: str) -> None:
    assert_same(SCENES[name], converted(copy.deepcopy(SCENES[name]), 1.0, 1e6, 1.0), 1e6)


@pytest.mark.parametrize("name", SCENES)
def test_larger_loads_and_slips_on_the_same_steel_scale(name: str) -> None:
    """Loads, law and slips by one factor, the modulus left: u goes with it, the energy with its square."""
    other = converted(copy.deepcopy(SCENES[name]), 1.0, 1e-6, 1e-6)
    other["material"] = SCENES[name]["material"]
    assert_same(SCENES[name], other, 1e-12)


# The right-diagonal mesh is its own image under a half turn and under x ↔ y: the floor may be any side.
TURNS: dict[str, tuple[dict[str, str], Array]] = {
    "half turn": (
        {"left": "right", "right": "left", "bottom": "top", "top": "bottom"},
        np.array([[-1.0, 0.0], [0.0, -1.0]]),
    ),
    "x and y exchanged": (
        {"left": "bottom", "right": "top", "bottom": "left", "top": "right"},
        np.array([[0.0, 1.0], [1.0, 0.0]]),
    ),
}


def turned_vector(values: list[Any], turn: Array) -> list[Any]:
    found = []
    for row in turn:
        (i,) = np.flatnonzero(row)
        found.append("free" if values[i] == "free" else float(values[i] * row[i]))
    return found


def turned(table: Table, sides: dict[str, str] | None, turn: Array) -> Table:
    """The scene with its vectors, and for built-in shapes its sides, under an axis-parallel rotation or reflection."""
    other = copy.deepcopy(table)
    for part in other["boundary"].values():
        part["on"] = sides[part["on"]] if sides else part["on"]
        for key in {"traction", "displacement"} & part.keys():
            part[key] = turned_vector(part[key], turn)
    return other


def same_turned(one: Solution, other: Solution, turn: Array) -> float:
    """The difference of two solutions, the second one turned, each about its centre."""
    assert one.exit_code == other.exit_code == 0
    x, y = points(one), points(other)
    wanted = ordered((x - x.mean(axis=0)) @ turn.T + y.mean(axis=0), displacement(one) @ turn.T)
    return far(ordered(y, displacement(other)), wanted)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("name", SCENES)
def test_any_side_may_be_the_floor_with_friction(name: str, turn: str) -> None:
    sides, matrix = TURNS[turn]
    one, other = solved(SCENES[name]), solved(turned(SCENES[name], sides, matrix))
    assert same_turned(one, other, matrix) < 1e-9
    assert energy(other) == pytest.approx(energy(one), rel=1e-9)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return meshes.make(tmp_path_factory.mktemp("mesh") / "square.msh", meshes.GOOD)


def on_file(table: Table, file: Path) -> Table:
    return table | {"domain": {"shape": "file", "file": str(file)}}


IMAGES: dict[str, Array] = {
    "mirrored": np.array([[-1.0, 0.0], [0.0, 1.0]]),
    "three quarters": np.array([[0.0, 1.0], [-1.0, 0.0]]),
}


def image(file: Path, turn: Array, folder: Path) -> Path:
    (a, b), (c, d) = turn.tolist()
    return meshes.transformed(folder / "image.msh", file, [a, b, 0, 0.3, c, d, 0, -0.7, 0, 0, 1, 0])


@pytest.mark.parametrize(
    "kind", ["mirrored", *(pytest.param(k, marks=pytest.mark.long) for k in IMAGES if k != "mirrored")]
)
def test_a_mesh_may_be_turned_and_mirrored_with_its_scene(kind: str, mesh: Path, tmp_path: Path) -> None:
    for name in ("lift-off", "drop", "lift-off, degree 2"):
        one = solved(on_file(SCENES[name], mesh))
        file = image(mesh, IMAGES[kind], tmp_path)
        other = solved(on_file(turned(SCENES[name], None, IMAGES[kind]), file))
        assert far(_matched(other, one, IMAGES[kind]), displacement(one)) < 1e-9
        assert energy(other) == pytest.approx(energy(one), rel=1e-9)


def _matched(other: Solution, one: Solution, turn: Array) -> Array:
    """The second displacement, turned back, in the first one's numbering."""
    back = (points(other) - [0.3, -0.7]) @ turn
    distance = np.linalg.norm(points(one)[:, None] - back[None], axis=2)
    assert np.max(distance.min(axis=1)) < 1e-9
    return np.asarray((displacement(other) @ turn)[distance.argmin(axis=1)])


def test_a_floor_may_slant(mesh: Path, tmp_path: Path) -> None:
    """The wall is a slot without play there, since a support holds along the axes only."""
    c, s = np.cos(np.radians(200.0)), np.sin(np.radians(200.0))
    turn = np.array([[c, -s], [s, c]])
    table = copy.deepcopy(SCENES["lift-off"])
    table["boundary"]["wall"] = {"on": "left", "contact": {"lower": 0.0, "upper": 0.0}}
    upright, slanted = on_file(table, mesh), copy.deepcopy(on_file(table, image(mesh, turn, tmp_path)))
    for part in slanted["boundary"].values():
        if "traction" in part:
            part["traction"] = [float(v) for v in turn @ part["traction"]]
    one, other = solved(upright), solved(slanted)
    assert one.exit_code == other.exit_code == 0
    assert far(_matched(other, one, turn), displacement(one)) < 1e-9
    assert energy(other) == pytest.approx(energy(one), rel=1e-9)


def test_a_slot_without_play_is_a_support(mesh: Path) -> None:
    """The wall as a support, and as bilateral contact: one displacement, two ways into it."""
    table = copy.deepcopy(SCENES["drop"])
    table["boundary"]["wall"] = {"on": "left", "contact": {"lower": 0.0, "upper": 0.0}}
    assert far(displacement(solved(table)), displacement(solved(SCENES["drop"]))) < 1e-9
