"""Errors of a study against closed forms and known differences, at both degrees, on nested and other meshes."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from scenes import Table, model, quadratic_linear, two_blocks

from hvi_fenicsx import Solution, prepare, read_tables
from hvi_fenicsx.problem import spaces
from hvi_fenicsx.report.solution_arrays import SolutionArrays
from hvi_fenicsx.results import gathering
from hvi_fenicsx.study.errors import NORMS, ReferenceSolution, stiffness
from hvi_fenicsx.study.table import certainty
from hvi_fenicsx.workflow import finish

LAW = quadratic_linear(1.0e6)


def solved(table: Table) -> Solution:
    return finish(prepare(read_tables(table), MPI.COMM_SELF), estimating=False)


@functools.cache
def with_law(dimension: int, cells: int, degree: int = 1) -> Solution:
    return solved(model(cells, friction=LAW, degree=degree) if dimension == 2 else in_space(cells, degree))


def in_space(cells: int, degree: int) -> Table:
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [cells] * 3},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
        "boundary": {
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": LAW},
            "press": {"on": "top", "traction": [1e5, 0.0, "-1e6*(1 + x)"]},
        },
        "solver": {"degree": degree},
    }


def taken(solution: Solution) -> SolutionArrays:
    arrays = gathering.solution_arrays(solution)
    assert arrays is not None
    return arrays


def reference_of(solution: Solution) -> ReferenceSolution:
    matrix = stiffness(solution)
    assert matrix is not None
    return ReferenceSolution(taken(solution), matrix, solution.scene.body.interfaces)


def errors(reference: ReferenceSolution, found: SolutionArrays) -> dict[str, float]:
    told = reference.errors(reference.transfer(found))
    return {name: value for name, value in told.items() if value is not None}


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_energy_of_nodal_values_is_that_of_the_form(dimension: int) -> None:
    """In space coefficients of midpoints are no values."""
    solution = with_law(dimension, 2, 2)
    problem, reference = solution.problem, reference_of(solution)
    field = fem.Function(problem.space)
    field.x.array[:] = np.random.default_rng(3).normal(size=field.x.array.size)
    values = spaces.values(problem.space, field.x.array)
    product = problem.bulk.matrix() * field.x.petsc_vec
    assert reference.energy(values) ** 2 == pytest.approx(float(product.dot(field.x.petsc_vec)), rel=1e-12)


def test_degree_2_is_nearer_in_all_that_converges() -> None:
    """The same nodes at both degrees; and the reference's own error is zero."""
    reference = reference_of(with_law(2, 16, 2))
    one, two = (errors(reference, taken(with_law(2, 8 // p, p))) for p in (1, 2))
    for key in ("energy_norm", "u_t_l2", "u_t_max", "friction_l1"):
        assert two[key] < 0.6 * one[key], key
    assert max(value for value in reference.errors(reference.own).values() if value is not None) == 0.0


def test_the_closed_form_is_met_on_every_mesh() -> None:
    """Without friction P1 holds the solution: all errors are rounding, whatever the mesh."""
    known = errors(reference_of(solved(model(8))), taken(solved(model(4))))
    assert set(known) == {"energy_norm", "u_t_l2", "u_t_max", "pressure_l1", "pressure_l2", "contact_set", "resultant"}
    assert max(known.values()) < 1e-9


def test_every_norm_measures_a_known_difference() -> None:
    """All fields one per cent larger: one per cent in every norm; and a rigid motion has no energy."""
    solution = with_law(2, 8)
    reference, here = reference_of(solution), taken(solution)
    assert here.displacement is not None
    grown = {"u_t1", "friction_t1", "sigma_n"}
    parts = {
        name: replace(p, columns={k: v * (1.01 if k in grown else 1.0) for k, v in p.columns.items()})
        for name, p in here.parts.items()
    }
    found = errors(reference, replace(here, displacement=1.01 * here.displacement, parts=parts))
    assert found.pop("contact_set") == 0.0
    assert all(value == pytest.approx(0.01, rel=1e-9) for value in found.values()), found
    turned = here.displacement + 1e-6 * np.column_stack([1.0 - here.points[:, 1], here.points[:, 0]])
    assert errors(reference, replace(here, displacement=turned))["energy_norm"] < 1e-6


def test_the_contact_set_is_the_area_where_one_is_closed() -> None:
    """Half of the floor open in the other solution: half of the closed area is wrong."""
    solution = solved(model(8))
    here, reference = taken(solution), reference_of(solution)
    ((name, part),) = here.parts.items()
    opened = {**part.columns, "contact": part.columns["contact"] * (part.columns["x"] > 0.5)}
    wrong = part.weight[(part.columns["x"] <= 0.5) & (part.columns["contact"] > 0)].sum()
    found = errors(reference, replace(here, parts={name: replace(part, columns=opened)}))
    assert found["contact_set"] == pytest.approx(wrong / part.weight[part.columns["contact"] > 0].sum())


def test_the_energy_norm_is_that_of_the_closed_form() -> None:
    """Of the model problem without friction: a(u, u) = <g, u>, and the energy is -6 J/m, so a(u, u) = 12 J/m."""
    solution = solved(model(4))
    displacement, scales = taken(solution).displacement, solution.problem.scales
    assert displacement is not None
    energy = reference_of(solution).energy(displacement / scales.displacement)
    assert energy**2 * scales.energy == pytest.approx(12.0, rel=1e-9)


def test_the_slip_of_a_joint_is_that_of_one_body_beside_the_other() -> None:
    """As the contact table has it, where the meshes match."""
    table = two_blocks("rectangle", [1.0], [[4, 2], [4, 2]], "plane_strain")
    table["domain"]["upper"]["origin"][0] = 0.0
    solution = solved(table)
    reference, arrays = reference_of(solution), taken(solution)
    told = np.concatenate([part.columns["u_t1"] for part in arrays.parts.values()])
    assert np.abs(told).max() > 0.0
    along = np.linalg.norm(reference.own.slip, axis=1)
    np.testing.assert_allclose(along, np.abs(told), atol=1e-9 * np.abs(told).max())


@pytest.mark.parametrize("order", [0.7, 1.0, 1.6])
def test_the_references_own_error_follows_from_the_coarser_levels(order: float) -> None:
    """Errors C hᵖ, additive; in the energy norm their squares are."""
    h, c = 0.1, 3.0
    truth = c * h**order
    below = [dict.fromkeys(NORMS, c * (n * h) ** order - truth) for n in (2, 4)]
    for at_level, n in zip(below, (2, 4), strict=True):
        at_level["energy_norm"] = math.sqrt((c * (n * h) ** order) ** 2 - truth**2)
    for found in certainty(below).values():
        assert found.error == pytest.approx(truth)
        assert found.order == pytest.approx(order)
