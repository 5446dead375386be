"""Each effect by itself against closed forms and manufactured solutions, and what must not be combined.

An effect that is a factor off still converges and still looks right in a picture; so each is held to numbers that do
not come from this program.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sympy
from runs import ROOT
from scenes import STEEL, E, P, Q, Table, block, displacement, far, model, points, quadratic_linear, solved

from hvi_fenicsx import InputError, prepare, read_scene, read_tables, solve

Array = npt.NDArray[np.float64]
ALPHA, HEAT = 1.2e-5, 50.0
ISOTROPIC = {"youngs_modulus": 2.0e11, "poisson_ratio": 0.3}
MODULI, RATIOS, SHEAR = [1.0e11, 1.0e10, 3.0e10], [0.3, 0.2, 0.25], [5.0e9, 6.0e9, 7.0e9]
SKEW = [[4.0e11, 1.0e11, 3.0e10], [1.0e11, 3.0e11, 2.0e10], [3.0e10, 2.0e10, 1.0e11]]
MATERIALS: dict[str, Table] = {
    "isotropic plane stress": {"model": "plane_stress", **ISOTROPIC},
    "isotropic plane strain": {"model": "plane_strain", **ISOTROPIC},
    "nearly incompressible": {"model": "plane_strain", "youngs_modulus": 1.0e7, "poisson_ratio": 0.499},
    "isotropic 3D": {"model": "three_dimensional", **ISOTROPIC},
    "orthotropic plane stress": {
        **{"elasticity": "orthotropic", "model": "plane_stress"},
        **{"youngs_moduli": MODULI[:2], "poisson_ratios": RATIOS[:1], "shear_moduli": SHEAR[:1]},
    },
    "orthotropic plane strain": {
        **{"elasticity": "orthotropic", "model": "plane_strain"},
        **{"youngs_moduli": MODULI, "poisson_ratios": RATIOS, "shear_moduli": SHEAR[:1]},
    },
    "orthotropic 3D": {
        **{"elasticity": "orthotropic", "model": "three_dimensional"},
        **{"youngs_moduli": MODULI, "poisson_ratios": RATIOS, "shear_moduli": SHEAR},
    },
    "tensor": {"elasticity": "tensor", "model": "plane_stress", "matrix": SKEW},
}
every_material = pytest.mark.parametrize("name", MATERIALS)


def compliance() -> Array:
    """Strains from stresses of the orthotropic material in Voigt's order, (6, 6), written out."""
    (e1, e2, e3), (n12, n13, n23), (g12, g13, g23) = MODULI, RATIOS, SHEAR
    s = np.diag([1 / e1, 1 / e2, 1 / e3, 1 / g23, 1 / g13, 1 / g12])
    s[0, 1], s[0, 2], s[1, 2] = -n12 / e1, -n13 / e1, -n23 / e2
    return np.asarray(s + np.triu(s, 1).T)


def stiffness(name: str) -> Array:
    """C of a material, from its compliance: plane stress drops stresses, plane strain drops strains."""
    plane = [0, 1, 5]
    if name == "tensor":
        return np.array(SKEW)
    if name.startswith("orthotropic"):
        s = compliance()
    else:
        e, nu = (float(MATERIALS[name][k]) for k in ("youngs_modulus", "poisson_ratio"))
        s = np.diag([1 / e] * 3 + [2 * (1 + nu) / e] * 3)
        s[:3, :3] -= nu / e * (1 - np.eye(3))
    if name.endswith("3D"):
        return np.asarray(np.linalg.inv(s))
    if name.endswith("plane stress"):
        return np.asarray(np.linalg.inv(s[np.ix_(plane, plane)]))
    return np.asarray(np.linalg.inv(s)[np.ix_(plane, plane)])


def solid(name: str) -> bool:
    return name.endswith("3D")


def body(name: str, cells: int = 3, **material: Any) -> Table:
    """A unit square or cube of a material, nothing on it."""
    d = 3 if solid(name) else 2
    domain = {"shape": "box" if d == 3 else "rectangle", "size": [1.0] * d, "cells": [cells] * d}
    return {"domain": domain, "material": {**MATERIALS[name], **material}, "boundary": {}}


def all_sides(name: str) -> list[str]:
    return ["left", "right", "bottom", "top", *(["front", "back"] if solid(name) else [])]


def rollers(name: str) -> Table:
    """Symmetry: each lower side held in its normal direction."""
    sides = ["left", "front", "bottom"] if solid(name) else ["left", "bottom"]
    held = [[0.0 if i == j else "free" for j in range(len(sides))] for i in range(len(sides))]
    return {side: {"on": side, "displacement": u} for side, u in zip(sides, held, strict=True)}


# --- elasticity


@every_material
def test_patch_a_linear_field_is_exact_and_has_its_energy(name: str) -> None:
    d = 3 if solid(name) else 2
    gradient = np.array([[3.0, 1.0, -0.5], [0.7, -2.0, 0.4], [0.2, 0.9, 1.5]])[:d, :d] * 1e-4
    table = body(name)
    formulas = [" + ".join(f"({g!r})*{x}" for g, x in zip(row, "xyz", strict=False)) for row in gradient.tolist()]
    table["boundary"]["all"] = {"on": all_sides(name), "displacement": formulas}
    found = solved(table)
    assert far(displacement(found), points(found) @ gradient.T) < 1e-10
    pairs = [(0, 0), (1, 1), (0, 1)] if d == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    strain = np.array([gradient[i, j] if i == j else gradient[i, j] + gradient[j, i] for i, j in pairs])
    internal = found.problem.scales.energy * energy_of(found)
    assert internal == pytest.approx(0.5 * strain @ stiffness(name) @ strain, rel=1e-9)


def energy_of(solution: Any) -> float:
    """½ u·A u, nondimensional, from the reactions."""
    forces, u = solution.examination.forces, solution.solve_result.u.x.array
    return 0.5 * float(u @ forces.reaction.ravel())


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("orthotropic plane stress", [1 / MODULI[0], -RATIOS[0] / MODULI[0]]),
        (
            "orthotropic plane strain",
            [
                1 / MODULI[0] - (RATIOS[1] / MODULI[0]) ** 2 * MODULI[2],
                -RATIOS[0] / MODULI[0] - RATIOS[1] * RATIOS[2] / MODULI[0] / MODULI[1] * MODULI[2],
            ],
        ),
        ("orthotropic 3D", [1 / MODULI[0], -RATIOS[0] / MODULI[0], -RATIOS[1] / MODULI[0]]),
    ],
)
def test_a_bar_of_wood_pulled_along_its_grain(name: str, wanted: list[float]) -> None:
    table = body(name)
    table["boundary"] = rollers(name) | {"pull": {"on": "right", "traction": [P, *[0.0] * (len(wanted) - 1)]}}
    found = solved(table)
    assert far(displacement(found), points(found) * np.array(wanted) * P) < 1e-10


def manufactured(name: str) -> tuple[Table, Callable[[Array], Array]]:
    """A scene whose solution is a sine field, with thermal strain that varies too; force by SymPy."""
    d = 3 if solid(name) else 2
    x = sympy.symbols("x y z")[:d]
    u = [sympy.sin(2 * x[0] + i) * sympy.cos(x[1] - i) * (1 + x[-1]) * sympy.Float(1e-4) for i in range(d)]
    heat = 40 * sympy.exp(x[0]) * x[1]
    pairs = [(0, 0), (1, 1), (0, 1)] if d == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    e = [u[i].diff(x[i]) if i == j else u[i].diff(x[j]) + u[j].diff(x[i]) for i, j in pairs]
    held = [(ALPHA if i == j else 0.0) * heat for i, j in pairs]
    c = stiffness(name)
    s = {p: sum(c[k, m] * (e[m] - held[m]) for m in range(len(pairs))) for k, p in enumerate(pairs)}
    force = [-sum(s[min(i, j), max(i, j)].diff(x[j]) for j in range(d)) for i in range(d)]
    table = body(name, thermal_expansion=ALPHA)
    table["body"] = {"force": [str(f) for f in force], "temperature": str(heat)}
    table["boundary"]["all"] = {"on": all_sides(name), "displacement": [str(f) for f in u]}
    return table, lambda p: np.array([sympy.lambdify(x, f, "numpy")(*p.T) for f in u]).T


@pytest.mark.parametrize("name", ["isotropic plane stress", "orthotropic plane stress", "orthotropic 3D", "tensor"])
def test_a_manufactured_solution_is_met_at_second_order(name: str) -> None:
    table, exact = manufactured(name)
    errors = []
    for cells in (6, 12) if solid(name) else (8, 16, 32):
        table["domain"]["cells"] = [cells] * len(table["domain"]["cells"])
        found = solved(table)
        errors.append(float(np.sqrt(np.mean((displacement(found) - exact(points(found))) ** 2))) / 1e-4)
    assert errors[-1] < 2e-2
    assert np.log2(errors[-2] / errors[-1]) > (1.7 if solid(name) else 1.85)


# --- thermal strain


@every_material
def test_a_free_body_expands_without_stress(name: str) -> None:
    """Plane strain holds the thickness, so the plane expands more: by (1 + ν) α, wood by its compliance."""
    table = body(name, thermal_expansion=ALPHA) | {"boundary": rollers(name), "body": {"temperature": HEAT}}
    found = solved(table)
    factor = np.ones(points(found).shape[1])
    if name in ("isotropic plane strain", "nearly incompressible"):
        factor *= 1 + float(MATERIALS[name]["poisson_ratio"])
    if name == "orthotropic plane strain":
        s = compliance()
        factor -= s[:2, 2] / s[2, 2]
    assert far(displacement(found), points(found) * ALPHA * HEAT * factor) < 1e-10
    assert found.problem.scales.stress > 0


def test_a_held_bar_is_pressed_by_e_alpha_t() -> None:
    table = body("isotropic plane stress", thermal_expansion=ALPHA) | {"body": {"temperature": HEAT}}
    table["boundary"] = rollers("isotropic plane stress") | {"stop": {"on": "right", "contact": {"gap": 0.0}}}
    found = solved(table)
    assert found.examination is not None
    pressure = found.examination.states[0].pressure * found.problem.scales.stress
    np.testing.assert_allclose(pressure, -2.0e11 * ALPHA * HEAT, rtol=1e-9)


def test_two_materials_end_to_end_are_exact_where_their_widths_agree() -> None:
    """Without lateral contraction and with one α the plane field is that of the slender bar."""
    same = [f"material.{m}.{k}={v}" for m in ("aluminium", "steel") for k, v in BAR.items()]
    found = solve(read_scene(ROOT / "demos" / "thermal_bar.toml", same))
    assert found.examination is not None
    stress = (ALPHA * 60.0 - 0.5e-3) / (0.4 / 7e10 + 0.6 / 2.1e11)
    pressure = found.examination.states[0].pressure * found.problem.scales.stress
    np.testing.assert_allclose(pressure, -stress, rtol=1e-8)


BAR = {"poisson_ratio": 0.0, "thermal_expansion": ALPHA}


# --- loads, supports, shapes


@pytest.mark.parametrize(("effect", "load"), [("support", -Q), ("adhesion", Q)])
def test_a_spring_in_the_normal_direction_gives_by_load_over_stiffness(effect: str, load: float) -> None:
    stiff = 1.0e12
    table = block(4, 0.0, -load)
    table["boundary"]["wall"] = {"on": "left", "displacement": [0.0, "free"]}
    table["boundary"]["floor"] = {"on": "bottom", effect: {"law": "linear_spring", "stiffness": stiff}}
    found = solved(table)
    u, y = displacement(found)[:, 1], points(found)[:, 1]
    assert far(u, load / stiff + load / E * y) < 1e-9


SHAPES: dict[str, tuple[Table, float, list[str], list[str]]] = {
    "l_shape": ({"size": [2.0, 1.0], "cut": [1.0, 0.5], "mesh_size": 0.2}, 1.5, ["left"], ["bottom"]),
    "notched_strip": ({"size": [2.0, 1.0], "notch": [0.2, 0.5], "mesh_size": 0.2}, 1.95, ["right"], ["bottom"]),
    "disk": ({"radius": 0.5, "mesh_size": 0.05}, np.pi / 4, ["upper_arc"], ["lower_arc"]),
    "half_disk": ({"radius": 0.5, "mesh_size": 0.1, "mesh_size_below": 0.02}, np.pi / 8, ["top"], ["arc"]),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_floor_bears_the_weight_of_any_shape(shape: str) -> None:
    """So the area is right, the sides are where they are called to be, and the gap under an arc is measured."""
    words, area, held, floor = SHAPES[shape]
    obstacle = {"point": [0.0, 0.0], "normal": [0.0, 2.0]}
    found = solved(
        {
            "domain": {"shape": shape, **words},
            "material": STEEL,
            "body": {"force": [0.0, -8.0e4]},
            "boundary": {
                "held": {"on": held, "displacement": [0.0, "free"]},
                "floor": {"on": floor, "contact": {"obstacle": obstacle}},
            },
        }
    )
    assert found.exit_code == 0
    assert found.examination is not None
    state = found.examination.states[0]
    borne = -float(state.surface.weights @ state.pressure) * found.problem.scales.force
    assert borne == pytest.approx(8.0e4 * area, rel=1e-9 if shape in ("l_shape", "notched_strip") else 4e-3)


# --- what makes no sense


def changed(**tables: Any) -> Table:
    return model() | tables


def on_floor(**effects: Any) -> Table:
    table = model()
    table["boundary"]["floor"] = {"on": "bottom", **effects}
    return table


def wood(**words: Any) -> Table:
    return changed(material=MATERIALS["orthotropic plane stress"] | words)


SPRING = {"law": "linear_spring", "stiffness": 1e12}
LITERAL = {"law": "quadratic_linear_literal", "gamma1": 1e3, "gamma2": 5e2, "delta": 1e-6}
CUBE = {"shape": "box", "size": [1.0] * 3, "cells": [2] * 3}
REFUSED: dict[str, tuple[Table, str]] = {
    "heat without expansion": (changed(body={"temperature": 20.0}), "body.temperature does nothing"),
    "heat that is not finite": (
        changed(material={**STEEL, "thermal_expansion": ALPHA}, body={"temperature": "1/x"}),
        "is not finite everywhere",
    ),
    "two normal laws": (on_floor(adhesion=SPRING, support=SPRING), "state them as one law"),
    "contact where it is prescribed": (
        on_floor(contact={"gap": 0.0}, displacement=["free", 0.0]),
        "leave contact out",
    ),
    "load where it is prescribed": (on_floor(traction=[0.0, 1.0], displacement=["free", 0.0]), "does nothing"),
    "plane model in 3D": (changed(domain=CUBE, boundary={}), "use three_dimensional"),
    "solid model in 2D": (changed(material=MATERIALS["isotropic 3D"]), "use plane_stress or plane_strain"),
    "one-sided friction in 3D": (
        {
            **{"domain": CUBE, "material": MATERIALS["isotropic 3D"]},
            "boundary": {"floor": {"on": "bottom", "friction": LITERAL}},
        },
        "must be even",
    ),
    "too many moduli": (wood(youngs_moduli=MODULI), "youngs_moduli has 3 entries; plane_stress wants 2"),
    "impossible contraction": (wood(poisson_ratios=[3.5]), "not positive definite"),
    "moduli whose compliances are beyond all numbers": (
        wood(youngs_moduli=[1e-320, 1e-320], poisson_ratios=[0.3], shear_moduli=[1e-320]),
        "the elasticity is zero, or its numbers are too large or too far apart",
    ),
    "a lopsided tensor": (
        changed(material=MATERIALS["tensor"] | {"matrix": [[2.0, 1.0, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 1.0]]}),
        "not symmetric: C[1][2] = 1, not 0.5",
    ),
    "a tensor without shear": (
        changed(material=MATERIALS["tensor"] | {"matrix": [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0]]}),
        "not positive definite",
    ),
    "a tensor of the wrong size": (
        changed(material=MATERIALS["tensor"] | {"matrix": [[2.0, 1.0], [1.0, 2.0]]}),
        "3 rows of 3 numbers",
    ),
    "a cut that leaves nothing": (
        changed(domain={"shape": "l_shape", "size": [1.0, 1.0], "cut": [1.0, 0.5], "mesh_size": 0.1}),
        "must be smaller than size",
    ),
    "a side of another shape": (
        changed(domain={"shape": "disk", "radius": 1.0, "mesh_size": 0.1}),
        'unknown side "left"',
    ),
    "a region of a shape that has none": (
        changed(body={"region": "core", "force": [0.0, -1.0]}),
        "a rectangle has no regions",
    ),
    "two laws of friction": (
        changed(
            boundary={
                "a": {"on": "bottom", "friction": quadratic_linear(1e3)},
                "b": {"on": ["bottom", "top"], "friction": quadratic_linear(2e3)},
            }
        ),
        "shares facets with boundary.a",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_makes_no_sense_is_refused_with_a_reason(case: str) -> None:
    table, reason = REFUSED[case]
    with pytest.raises((InputError, ValueError)) as caught:
        prepare(read_tables(table))
    assert reason in str(caught.value)
