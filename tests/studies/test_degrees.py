"""Studies at degree 2: quadratic fields are compared exactly, energies are those of the form, plans vary the degree.

What is interpolated linearly, or measured in the wrong basis, would hide what degree 2 gains.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from runs import hvi, write_scene
from scenes import Table, model, quadratic_linear

from hvi_fenicsx import InputError, Scene, Solution
from hvi_fenicsx.problem import spaces
from hvi_fenicsx.results import gathering
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.studies import axes, interpolation, plan
from hvi_fenicsx.studies.error_norms import errors
from hvi_fenicsx.studies.reference_solution import ReferenceSolution
from hvi_fenicsx.studies.solution_fields import SolutionFields, fields
from hvi_fenicsx.studies.stiffness import stiffness
from hvi_fenicsx.typing import Array
from hvi_fenicsx.workflow import finish, prepare

LAW = quadratic_linear(1.0e6)


@functools.cache
def solved(dimension: int, cells: int, degree: int) -> Solution:
    table = model(cells, friction=LAW, degree=degree) if dimension == 2 else in_space(cells, degree)
    return finish(prepare(Scene.model_validate(table), MPI.COMM_SELF, Timer()))


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


def taken(solution: Solution) -> SolutionFields:
    arrays = gathering.solution_arrays(solution)
    assert arrays is not None
    return fields(arrays)


def quadratic(x: Array) -> Array:
    return 1.0 + x[:, 0] * (2.0 - x[:, -1]) + 3.0 * x[:, 0] ** 2 - x[:, 1] ** 2


@pytest.mark.parametrize("dimension", [2, 3])
def test_quadratic_fields_are_taken_to_finer_meshes_exactly(dimension: int) -> None:
    source, target = taken(solved(dimension, 2, 2)), taken(solved(dimension, 4, 1))
    assert source.cells.shape[1] == (6, 10)[dimension - 2]
    found = interpolation.bodies(source, target) @ quadratic(source.points)
    np.testing.assert_allclose(found, quadratic(target.points), atol=1e-12)
    (near,), (far,) = source.parts.values(), target.parts.values()
    along = interpolation.surface(near, far.points)
    np.testing.assert_allclose(along.of_degree @ quadratic(near.points), quadratic(far.points), atol=1e-12)
    np.testing.assert_allclose(along.linear @ near.points, far.points, atol=1e-12)
    assert len(near.facets) == (2, 4)[dimension - 2] * len(near.quadratic)


def test_a_facet_of_which_a_part_is_missing_is_linear_there() -> None:
    """As where a node of the facet is on another part."""
    arrays = gathering.solution_arrays(solved(2, 2, 2))
    assert arrays is not None
    (own,) = arrays.parts.values()
    cut = own.facets[np.isin(own.facets, own.vertices[own.columns["x"] > 0.1]).all(axis=1)]
    (found,) = fields(
        type(arrays)(**{**vars(arrays), "parts": {"floor": type(own)(**{**vars(own), "facets": cut})}})
    ).parts.values()
    assert (len(found.quadratic), len(found.facets)) == (1, 3)
    values = quadratic(found.points)
    at = np.array([[0.75 + 0.1, 0.0], [0.375, 0.0]])
    middle = [float(np.mean(values[np.isclose(found.points[:, 0], x)])) for x in (0.25, 0.5)]
    np.testing.assert_allclose(
        interpolation.surface(found, at).of_degree @ values, [quadratic(at)[0], np.mean(middle)], atol=1e-12
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_energy_of_nodal_values_is_that_of_the_form(dimension: int) -> None:
    """In space coefficients of midpoints are no values."""
    solution = solved(dimension, 2, 2)
    problem, matrix = solution.problem, stiffness(solution)
    assert matrix is not None
    field = fem.Function(problem.space)
    field.x.array[:] = np.random.default_rng(3).normal(size=field.x.array.size)
    values = spaces.values(problem.space, field.x.array).ravel()
    product = problem.bulk.matrix() * field.x.petsc_vec
    assert values @ (matrix @ values) == pytest.approx(float(product.dot(field.x.petsc_vec)), rel=1e-12)


def test_errors_of_both_degrees_are_measured_against_one_reference() -> None:
    """The same nodes at both degrees: degree 2 is nearer in all that converges, and the reference's error is zero."""
    solution = solved(2, 16, 2)
    matrix = stiffness(solution)
    assert matrix is not None
    reference = ReferenceSolution(taken(solution), matrix)
    found = [errors(reference, reference.transfer(taken(solved(2, 8 // p, p)))) for p in (1, 2)]
    for key in ("energy_norm", "u_t_l2", "u_t_max", "friction_l1"):
        one, two = (e[key] for e in found)
        assert one is not None
        assert two is not None
        assert two < 0.6 * one, key
    own = errors(reference, reference.own)
    assert max(value for value in own.values() if value is not None) == 0.0


def test_a_degree_is_varied_on_uniform_and_adaptive_meshes() -> None:
    made = plan.make(
        Scene.model_validate(model(4, friction=LAW)), [axes.read(a) for a in ("degree=1,2", "mesh=2,8", "accuracy=0.1")]
    )
    found = {(s.degree, s.mesh) for s in made.points}
    assert {p for p, mesh in found if mesh == "adaptive to 10 %"} == {1, 2}
    assert {(1, "2 × 2 cells"), (2, "8 × 8 cells"), (1, "4 × 4 cells")} <= found
    assert len(made.points) == len(found)
    assert [s.degree for s in made.reference] == [2, 2, 2]
    assert [s.unknowns for s in made.points] == sorted(s.unknowns for s in made.points)
    with pytest.raises(InputError, match="degree"):
        axes.read("degree=3")


def test_a_plan_of_the_programs_own_has_both_degrees() -> None:
    made = plan.make(Scene.model_validate(model(8, friction=LAW)), [])
    assert {s.mesh for s in made.points if s.degree == 2} >= {"8 × 8 cells", "adaptive to 10 %"}
    assert made.reference[0].degree == 2


@pytest.mark.long
def test_a_study_of_both_degrees_draws_both(tmp_path: Path) -> None:
    file = write_scene(tmp_path / "square.toml", model(4, friction=LAW))
    words = ("--axis", "mesh=2,4", "--axis", "degree=1,2", "--axis", "accuracy=0.05", "--repeat", 1)
    for ranks in (1, 2):
        done = hvi("study", file, *words, "--out", tmp_path / f"out{ranks}", "--np", ranks)
        assert done.returncode == 0, done.stderr
    one, two = (json.loads((tmp_path / f"out{n}" / "study.json").read_text(encoding="utf-8")) for n in (1, 2))
    assert all(p["converged"] for p in one["points"])
    assert {p["degree"] for p in one["points"] if p["mesh"].startswith("adaptive")} == {1, 2}
    assert any("at degree 2 falls as" in sentence for sentence in one["sentences"])
    for a, b in zip(one["points"], two["points"], strict=True):
        if not a["mesh"].startswith("adaptive"):
            assert a["errors"]["energy_norm"] == pytest.approx(b["errors"]["energy_norm"], rel=1e-5, abs=1e-8)
