"""Why: the stress is looked at first, and σ_33, thermal strain and averaged dilatation are easily forgotten in it.

Each case against a closed form; the whole field of a run on two ranks against that on one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import ufl
from dolfinx import fem
from scenes import Table, solved

from hvi_fenicsx import Solution, prepare, read_tables
from hvi_fenicsx.effects import Contribution
from hvi_fenicsx.problem import elastic_operator, stress
from hvi_fenicsx.problem.scaling import PlacedContribution
from hvi_fenicsx.problem.stress import stress_of_parts

Array = npt.NDArray[np.float64]
E, ALPHA, HEAT, PULL = 2.0e11, 1.2e-5, 40.0, 3.0e6
WOOD_E, WOOD_NU = (12e9, 0.9e9, 0.6e9), (0.4, 0.45, 0.35)
ISOTROPIC = [
    ("plane_stress", 0.3),
    ("plane_strain", 0.3),
    ("three_dimensional", 0.3),
    ("plane_strain", 0.499),
    ("three_dimensional", 0.499),
]
isotropic = pytest.mark.parametrize(("model", "nu"), ISOTROPIC)


def body(model: str, **material: Any) -> Table:
    d = 3 if model == "three_dimensional" else 2
    domain = {"shape": "box" if d == 3 else "rectangle", "size": [2.0, 1.0, 0.5][:d], "cells": [3, 2, 2][:d]}
    sides = ["left", "bottom", "front"] if d == 3 else ["left", "bottom"]
    axes = {"left": 0, "front": 1, "bottom": d - 1}
    held = {s: {"on": s, "displacement": [0.0 if i == axes[s] else "free" for i in range(d)]} for s in sides}
    return {"domain": domain, "material": {"model": model, **material}, "boundary": held}


def pulled(table: Table) -> Table:
    d = len(table["domain"]["size"])
    table["boundary"]["pull"] = {"on": "right", "traction": [PULL, *[0.0] * (d - 1)]}
    return table


def held(table: Table) -> Table:
    d = len(table["domain"]["size"])
    sides = ["left", "right", "bottom", "top", "front", "back"][: 2 * d]
    table["boundary"] = {"all": {"on": sides, "displacement": [0.0] * d}}
    return table


def wood(**more: Any) -> Table:
    shear = {"shear_moduli": [0.7e9], "elasticity": "orthotropic"}
    return body("plane_strain", youngs_moduli=list(WOOD_E), poisson_ratios=list(WOOD_NU), **shear, **more)


def stresses(solution: Solution) -> Array:
    assert solution.solve_result is not None
    return stress_of_parts(solution.problem.bulk, solution.solve_result.u)


def assert_uniform(found: Array, *diagonal: float) -> None:
    wanted = np.diag(diagonal)
    assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max()


@isotropic
def test_a_bar_that_is_pulled_has_the_stress_of_the_pull(model: str, nu: float) -> None:
    found = stresses(solved(pulled(body(model, youngs_modulus=E, poisson_ratio=nu))))
    across = nu * PULL if model == "plane_strain" else 0.0
    assert_uniform(found, PULL, 0.0, across)
    wanted = PULL * np.sqrt(1 - nu + nu**2) if model == "plane_strain" else PULL
    np.testing.assert_allclose(stress.von_mises(found), wanted, rtol=1e-8)


@isotropic
def test_a_heated_body_held_on_all_sides_is_pressed(model: str, nu: float) -> None:
    table = held(body(model, youngs_modulus=E, poisson_ratio=nu, thermal_expansion=ALPHA))
    found = stresses(solved(table | {"body": {"temperature": HEAT}}))
    if model == "plane_stress":
        assert_uniform(found, *[-E * ALPHA * HEAT / (1 - nu)] * 2, 0.0)
    else:
        assert_uniform(found, *[-E * ALPHA * HEAT / (1 - 2 * nu)] * 3)


@isotropic
def test_a_heated_body_that_is_free_is_pressed_across_the_plane_only(model: str, nu: float) -> None:
    table = body(model, youngs_modulus=E, poisson_ratio=nu, thermal_expansion=ALPHA)
    found = stresses(solved(table | {"body": {"temperature": HEAT}}))
    across = -E * ALPHA * HEAT if model == "plane_strain" else 0.0
    assert np.abs(found - np.diag([0.0, 0.0, across])).max() < 1e-8 * E * ALPHA * HEAT / (1 - 2 * nu)


def test_wood_in_plane_strain_is_held_across_by_its_own_compliance() -> None:
    pull = stresses(solved(pulled(wood())))
    assert_uniform(pull, PULL, 0.0, WOOD_NU[1] / WOOD_E[0] * WOOD_E[2] * PULL)
    heat = stresses(solved(wood(thermal_expansion=ALPHA) | {"body": {"temperature": HEAT}}))
    assert_uniform(heat, 0.0, 0.0, -WOOD_E[2] * ALPHA * HEAT)


def test_a_users_own_form_of_the_strain_belongs_to_the_stress() -> None:
    """Fibres along x beside the material; an elastic bed is no stress, and a force instead."""
    problem = prepare(read_tables(pulled(body("plane_stress", youngs_modulus=E, poisson_ratio=0.0)))).problem
    v, u = problem.bulk.form.arguments()
    fibres = Contribution(bilinear=(0.5 * ufl.grad(u)[0, 0] * ufl.grad(v)[0, 0] * ufl.dx,))
    bed = Contribution(bilinear=(2.0 * ufl.inner(u, v) * ufl.dx,))
    pull = next(placed.effect for placed in problem.contributions if placed.where == "pull")
    made = [*problem.contributions, *(PlacedContribution(None, pull, one) for one in (fibres, bed))]
    own = elastic_operator.make_bulk(problem.space, problem.scales, made, {})
    stretched = fem.Function(problem.space)
    stretched.interpolate(lambda x: np.stack([x[0], x[1]]))
    alone, both = (stress_of_parts(one, stretched) for one in (problem.bulk, own))
    unit = problem.scales.stress * problem.scales.length  # a form's integrals are over m², its gradients in 1/m
    np.testing.assert_allclose(both[:, 0, 0] - alone[:, 0, 0], 0.5 * unit, rtol=1e-10)
    np.testing.assert_allclose(both[:, 1, 1], alone[:, 1, 1], rtol=1e-10)
    np.testing.assert_allclose(own.foundation_force(stretched).sum(axis=0), [4.0, 2.0], rtol=1e-10)


def test_pure_shear_and_its_von_mises_stress() -> None:
    table = body("plane_stress", youngs_modulus=E, poisson_ratio=0.3)
    sheared = {"on": ["left", "right", "bottom", "top"], "displacement": ["1e-5*y", "1e-5*x"]}
    found = stresses(solved(table | {"boundary": {"all": sheared}}))
    shear = E / 2.6 * 2e-5
    np.testing.assert_allclose(found[:, 0, 1], shear, rtol=1e-9)
    np.testing.assert_allclose(stress.von_mises(found), np.sqrt(3) * shear, rtol=1e-9)
