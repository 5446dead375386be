"""What accuracy costs: errors against closed forms and independent norms, plans, fronts, and a folder that resumes."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import signal
import subprocess
import time
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from runs import command, hvi, write_scene
from scenes import model, quadratic_linear, two_blocks

from hvi_fenicsx import InputError, Scene, Solution, compat, prepare, solve
from hvi_fenicsx.commands.arguments import parser
from hvi_fenicsx.mesh import refinement
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.grid_transfer import NestedGridTransfer
from hvi_fenicsx.mesh.shapes import Rectangle
from hvi_fenicsx.results import gathering
from hvi_fenicsx.studies import axes, cost, interpolation, meshes, plan, scene_tables, sentences, table, thresholds
from hvi_fenicsx.studies.certainty import Certainty, certainty
from hvi_fenicsx.studies.error_norms import ERROR_NORMS, error_norm, errors
from hvi_fenicsx.studies.reference_solution import ReferenceSolution, TransferredSolution
from hvi_fenicsx.studies.setting import Setting
from hvi_fenicsx.studies.solution_fields import PartFields, SolutionFields, fields, width
from hvi_fenicsx.studies.stiffness import stiffness
from hvi_fenicsx.typing import Array, Integers

LAW = quadratic_linear(1.0e6)


def scene(cells: int = 4, **keys: Any) -> Scene:
    return Scene.model_validate(model(cells, **keys))


def taken(found: Scene | Solution) -> SolutionFields:
    solution = solve(found, MPI.COMM_SELF) if isinstance(found, Scene) else found
    arrays = gathering.solution_arrays(solution)
    assert arrays is not None
    return fields(arrays)


@pytest.fixture(scope="module")
def reference() -> ReferenceSolution:
    solution = solve(scene(8, friction=LAW), MPI.COMM_SELF)
    matrix, found = stiffness(solution), taken(solution)
    assert matrix is not None
    return ReferenceSolution(found, matrix)


@pytest.mark.parametrize("shape", ["rectangle", "box"])
def test_interpolation_between_nested_meshes_is_the_ladders_prolongation(shape: str) -> None:

    size, cells = ([1.0, 2.0], [4, 6]) if shape == "rectangle" else ([1.0, 2.0, 0.5], [4, 6, 2])
    table_of = model(4)
    table_of["domain"] = {"shape": shape, "size": size, "cells": cells}
    if shape == "box":
        table_of = {
            "domain": table_of["domain"],
            "material": {"model": "three_dimensional", "youngs_modulus": 1.0, "poisson_ratio": 0.3},
            "boundary": {"low": {"on": "bottom", "displacement": [0.0] * 3}},
        }
    fine = Scene.model_validate(table_of)
    coarse = fine.with_domain(cells=tuple(n // 2 for n in cells))
    from dolfinx import fem

    spaces = [
        fem.functionspace(s.domain.build(MPI.COMM_SELF, s.dimension).mesh, ("Lagrange", 1, (s.dimension,)))
        for s in (fine, coarse)
    ]
    step = NestedGridTransfer(size, coarse.domain.cells).prolongation(*spaces)
    d = fine.dimension
    points = [s.tabulate_dof_coordinates()[:, :d] for s in spaces]
    target, source = (
        SolutionFields(x, s.dofmap.list.astype(np.int64), np.zeros_like(x), {})
        for x, s in zip(points, spaces, strict=True)
    )
    way = interpolation.bodies(source, target)
    values = np.random.default_rng(1).normal(size=points[1].shape)
    coarse_vector, fine_vector = step.createVecs()
    coarse_vector.array[:] = values.ravel()
    step.mult(coarse_vector, fine_vector)
    np.testing.assert_allclose(way @ values, fine_vector.array.reshape(-1, d), atol=1e-12)


@pytest.mark.parametrize("shape", ["rectangle", "box"])
def test_where_two_bodies_meet_each_node_takes_the_field_of_its_own(shape: str) -> None:
    def mesh_of(n: int) -> SolutionFields:
        d = {"rectangle": 2, "box": 3}[shape]
        elasticity = {"rectangle": "plane_strain", "box": "three_dimensional"}[shape]
        across = [n] * (d - 1)
        table = two_blocks(shape, [1.0] * (d - 1), [[*across, n], [*(2 * k for k in across), n]], elasticity)
        table["domain"]["upper"]["origin"][0] = 0.0
        problem = prepare(Scene.model_validate(table), MPI.COMM_SELF).problem
        cells, points = problem.space.dofmap.list.astype(np.int64), problem.points[:, :d]
        u = 1.0 + points
        u[np.unique(cells[points[cells].mean(axis=1)[:, -1] > 0.5])] *= -2.0
        return SolutionFields(points, cells, u, {})

    source, target = mesh_of(2), mesh_of(4)
    assert len(np.unique(source.points, axis=0)) < len(source.points)
    np.testing.assert_allclose(interpolation.bodies(source, target) @ source.u, target.u, atol=1e-12)


def test_a_surface_in_space_is_interpolated_linearly_and_its_facets_are_found() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1.0], [0, 1, 1]])
    facets = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 4, 5]])
    nothing = np.zeros(len(corners))
    part = PartFields(
        facets=facets,
        quadratic=np.empty((0, 6), dtype=np.int64),
        points=corners,
        weights=nothing,
        normals=corners,
        slip=corners,
        friction=corners,
        pressure=nothing,
        contact=nothing,
        drops=np.empty(0),
        bounded=True,
    )
    points = np.array([[0.3, 0.1, 0.0], [0.2, 0.7, 0.0], [0.0, 0.6, 0.2], [0.0, 0.1, 0.9]])
    np.testing.assert_allclose(interpolation.surface(part, points).linear @ corners, points, atol=1e-14)


def test_the_closed_form_is_met_on_every_mesh() -> None:
    """Without friction P1 holds the solution: all errors are rounding, whatever the mesh."""
    solution = solve(scene(8), MPI.COMM_SELF)
    matrix, found = stiffness(solution), taken(solution)
    assert matrix is not None
    exact = ReferenceSolution(found, matrix)
    found_errors = errors(exact, exact.transfer(taken(scene(4))))
    known = {name: value for name, value in found_errors.items() if value is not None}
    assert set(known) == {"energy_norm", "u_t_l2", "u_t_max", "pressure_l1", "pressure_l2", "contact_set", "resultant"}
    assert max(known.values()) < 1e-9


def test_every_norm_measures_a_known_difference(reference: ReferenceSolution) -> None:
    """All fields one per cent larger: one per cent in every norm; and a rigid motion has no energy."""
    here = reference.fields
    parts = {
        name: replace(p, slip=1.01 * p.slip, friction=1.01 * p.friction, pressure=1.01 * p.pressure)
        for name, p in here.parts.items()
    }
    found = errors(reference, reference.transfer(replace(here, u=1.01 * here.u, parts=parts)))
    assert found.pop("contact_set") == 0.0
    assert found.pop("friction_max") == pytest.approx(0.01)
    assert all(value == pytest.approx(0.01, rel=1e-9) for value in found.values()), found
    turned = here.u + 1e-6 * np.column_stack([1.0 - here.points[:, 1], here.points[:, 0]])
    assert errors(reference, reference.transfer(replace(here, u=turned)))["energy_norm"] < 1e-6  # type: ignore[operator]


def test_the_energy_norm_is_that_of_the_closed_form() -> None:
    """Of the model problem without friction: a(u, u) = <g, u>, and the energy is -6 J/m, so a(u, u) = 12 J/m."""
    solution = solve(scene(4), MPI.COMM_SELF)
    matrix, found = stiffness(solution), taken(solution)
    assert matrix is not None
    scales = solution.problem.scales
    u = found.u.ravel() / scales.displacement
    assert u @ (matrix @ u) * scales.energy == pytest.approx(12.0, rel=1e-9)


def test_near_a_drop_of_the_law_the_largest_error_leaves_vertices_out(reference: ReferenceSolution) -> None:
    here, (name, part) = reference.fields, next(iter(reference.fields.parts.items()))
    slips = np.where(part.points[:, 0] < 0.5, 1.0, 3.0)[:, None] * [1.0, 0.0]
    dropped = ReferenceSolution(
        replace(here, parts={name: replace(part, slip=slips, drops=np.full((len(slips), 1), 2.0))}), reference.stiffness
    )
    near = dropped.near_jump(name, dropped.own)
    jump = 0.5 - 1 / 16  # the slip passes the drop between the vertices at 3/8 and 1/2
    np.testing.assert_array_equal(near, np.abs(part.points[:, 0] - jump) <= 2 / 8)
    assert dropped.left_out(dropped.own) == pytest.approx(float(part.weights[near].sum()))


def turning_disk(size: float) -> Scene:
    """A disk that a torque turns against springs all round: the slip is the same everywhere."""
    spring = {"law": "linear_spring", "stiffness": 1e9}
    return Scene.model_validate(
        {
            "domain": {"shape": "disk", "radius": 1.0, "mesh_size": size},
            "material": {"model": "plane_strain", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
            "body": {"force": ["-1e3*(y - 1)", "1e3*x"]},
            "boundary": {
                "rim": {"on": ["lower_arc", "upper_arc"], "contact": {"lower": 0.0, "upper": 0.0}, "friction": spring}
            },
        }
    )


def test_slips_of_a_curved_part_are_compared_as_vectors() -> None:
    """Its tangents turn their sign four times: between two such nodes a slip along them passes zero."""
    fine = solve(turning_disk(0.1), MPI.COMM_SELF)
    matrix, known = stiffness(fine), taken(fine)
    assert matrix is not None
    exact = ReferenceSolution(known, matrix)
    found = errors(exact, exact.transfer(taken(turning_disk(0.24))))
    for name in ("u_t_l2", "u_t_max", "friction_l1", "friction_l2", "friction_max"):
        error = found[name]
        assert error is not None
        assert error < 0.03, name
    assert exact.left_out(exact.own) == 0.0


@pytest.mark.parametrize("order", [0.7, 1.0, 1.6])
def test_the_references_own_error_follows_from_the_coarser_levels(order: float) -> None:
    """Errors C hᵖ, additive; in the energy norm their squares are."""
    h, c = 0.1, 3.0
    truth = c * h**order
    below = [dict.fromkeys(ERROR_NORMS, c * (n * h) ** order - truth) for n in (2, 4)]
    for at_level, n in zip(below, (2, 4), strict=True):
        at_level["energy_norm"] = math.sqrt((c * (n * h) ** order) ** 2 - truth**2)
    for found in certainty(below).values():
        assert found.error == pytest.approx(truth)
        assert found.order == pytest.approx(order)


def test_a_point_is_repeated_until_its_median_is_steady() -> None:
    def run(seconds: float) -> dict[str, float]:
        return dict.fromkeys(cost.PHASES, seconds / len(cost.PHASES))

    steady, ragged = [run(1.0)] * 3, [run(s) for s in (1.0, 2.0, 3.0)]
    assert not cost.wanted(steady, run(1.0), 9)
    assert cost.wanted(ragged, run(1.0), 9)
    assert not cost.wanted(ragged, run(1.0), 3)
    assert not cost.wanted([], run(30.0), 9)  # a long run is not repeated
    assert not cost.wanted([run(8.0)] * 2, run(8.0), 9)
    # of normal values the median's standard error is 1.2533 σ/√n
    values = np.random.default_rng(3).normal(10.0, 0.5, 4001)
    assert cost.spread(list(values)) == pytest.approx(1.2533 * 0.05 / math.sqrt(4001), rel=0.1)


def test_an_unknown_quantity_is_refused_with_those_there_are() -> None:
    (one,) = rows_of([(1.0, 0.1)])
    with pytest.raises(InputError, match=r'unknown quantity "energy_nrom"; did you mean "energy_norm".*u_t_l2'):
        one.error("energy_nrom")


def rows_of(pairs: list[tuple[float, float]]) -> list[table.Row]:
    record = {"converged": True, "reason": "certified", "exit_code": 0, "dofs": 1}
    certain = dict.fromkeys(ERROR_NORMS, Certainty(1e-4, None))
    return [
        table.row(
            str(i),
            Setting(scene(4)),
            {**record, "cost": {"seconds": s, "spread": None, "runs": 1, "phases": None}},
            certain,
            errors=dict.fromkeys(ERROR_NORMS, e),
        )
        for i, (s, e) in enumerate(pairs)
    ]


def test_the_front_holds_what_nothing_cheaper_is_as_accurate_as() -> None:
    draws = np.random.default_rng(5).uniform(-3, 0, (40, 2))
    pairs = [(10.0**s, 10.0**e) for s, e in draws]
    rows, certain = rows_of(pairs), dict.fromkeys(ERROR_NORMS, Certainty(1e-4, None))
    found = table.front(rows, "energy_norm", certain)
    gain = thresholds.DEFAULT.gain
    better = [not any(s < t and e < r / gain for s, e in pairs) for t, r in pairs]
    assert {int(r.point) for r in found} <= {i for i, good in enumerate(better) if good}
    assert all(a.errors["energy_norm"] > b.errors["energy_norm"] for a, b in pairwise(found))  # type: ignore[index, operator]
    assert min(e for _, e in pairs) == pytest.approx(found[-1].errors["energy_norm"], rel=0.06)  # type: ignore[index]


def test_a_sentence_names_the_cheapest_setting_for_each_accuracy() -> None:
    rows = rows_of([(0.1, 0.05), (0.2, 0.004), (0.3, 0.006), (0.4, 0.002)])
    certain = dict.fromkeys(ERROR_NORMS, Certainty(1e-4, None))
    words = sentences.targets(rows, "energy_norm", certain)
    assert "10 % for 0.1 s" in words
    assert "1 % for 0.2 s" in words
    assert "0.1 % is not reached here: the best is 0.2 % for 0.4 s" in words
    unsure = dict.fromkeys(ERROR_NORMS, Certainty(0.02, None))
    assert "1 % cannot be claimed: the reference itself is uncertain by 2 %" in sentences.targets(
        rows, "u_t_l2", unsure
    )


def test_an_order_is_told_from_errors_that_the_reference_resolves() -> None:
    """On the finest mesh half of the error is the reference's: what remains falls too fast."""
    rows = [
        replace(r, h=h) for h, r in zip((0.4, 0.2, 0.1), rows_of([(0.1, 0.04), (0.2, 0.02), (0.3, 0.005)]), strict=True)
    ]
    unsure = dict.fromkeys(ERROR_NORMS, Certainty(0.005, None))
    assert sentences.order(rows, rows[0], "u_t_l2", unsure) == pytest.approx(1.0)
    assert sentences.order(rows, rows[0], "u_t_l2", dict.fromkeys(ERROR_NORMS, Certainty(1e-4, None))) == pytest.approx(
        2.0
    )


def test_methods_that_refuse_the_scene_did_not_fail() -> None:
    own, other = rows_of([(0.1, 0.04), (0.2, 0.04)])
    refused = replace(other, method="tao", converged=False, exit_code=2, seconds=None)
    words = [*sentences.methods([own, refused], own), *sentences.failures([own, refused])]
    assert words == ["Methods, at the scene's own setting: auto 0.1 s; tao not for this scene."]


def test_adaptive_meshes_are_set_beside_the_uniform_one_that_does_as_well() -> None:
    rows = rows_of([(0.1, 0.05), (0.2, 0.009), (0.5, 0.008)])
    rows = [replace(rows[0], dofs=50), replace(rows[1], dofs=900), replace(rows[2], dofs=90, mesh="adaptive to 1 %")]
    certain = dict.fromkeys(ERROR_NORMS, Certainty(1e-4, None))
    (words,) = sentences.adaptive_meshes(rows, certain)
    assert "0.8 % with 90 unknowns (0.5 s)" in words
    assert "more unknowns than any" in words
    (words,) = sentences.adaptive_meshes([rows[0], replace(rows[1], errors=rows[2].errors), rows[2]], certain)
    assert "a uniform mesh needs 900 unknowns (0.2 s) for 0.8 %" in words
    (words,) = sentences.adaptive_meshes(rows, dict.fromkeys(ERROR_NORMS, Certainty(0.02, None)))
    assert "2 % with 90 unknowns" in words


def test_the_share_of_epsilon_is_that_of_its_distance_from_the_exact_law() -> None:
    own, exact = rows_of([(0.1, 0.5), (0.1, 0.01)])
    own = replace(own, smoothing="paper", epsilon=1.0, epsilon_part=dict.fromkeys(ERROR_NORMS, 0.49))
    assert sentences.share_of_epsilon(own, exact, "friction_l1") == pytest.approx(0.98)
    assert "nearly all of it ε" in sentences.own_setting(own, exact, "friction_l1")


def test_a_plan_is_the_product_of_its_axes_with_the_exact_law_on_every_mesh() -> None:
    made = plan.make(scene(4, friction=LAW), [axes.read("mesh=2,8"), axes.read("epsilon=1,exact")])
    found = {(s.scene.domain.cells[0], s.scene.solver.epsilon) for s in made.points}  # type: ignore[union-attr]
    assert found == {(2, 1.0), (2, None), (8, 1.0), (8, None), (4, None)}
    assert [s.scene.domain.cells[0] for s in made.reference] == [32, 16, 8]  # type: ignore[union-attr]
    assert all(s.scene.solver.smoothing is None for s in made.reference)


def test_help_names_every_axis(capsys: pytest.CaptureFixture[str]) -> None:
    """Help is instant: it must not load the axes to tell them."""
    with pytest.raises(SystemExit):
        parser().parse_args(["study", "--help"])
    told = " ".join(capsys.readouterr().out.split()).partition("for each VALUE of ")[2].partition(";")[0]
    assert set(re.split(r", | or ", told)) == {name for name, kind in axes.Axis.registry.items() if is_own(kind)}


def is_own(axis: type[axes.Axis]) -> bool:
    return axis.__module__ == axes.__name__


def test_combinations_that_are_no_scene_are_left_out() -> None:
    made = plan.make(
        scene(4, friction=LAW), [axes.read(a) for a in ("method=auto,branch", "smoothing=chks", "epsilon=1")]
    )
    assert {(s.scene.solver.method, s.scene.solver.smoothing) for s in made.points} == {
        ("auto", None),
        ("auto", "chks"),
    }
    assert "solves the law without smoothing" in made.left_out[0]


def test_an_axis_is_one_class(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(axes.Axis, "registry", dict(axes.Axis.registry))

    class MaxIterations(axes.Axis):
        name = "max_iterations"

        def apply(self, tables: dict[str, Any], value: str, beside: object) -> dict[str, Any]:
            return scene_tables.with_solver(tables, max_iterations=int(value))

    made = plan.make(scene(4, friction=LAW), [axes.read("max_iterations=7,9")])
    assert {s.scene.solver.max_iterations for s in made.points} >= {7, 9}


def test_an_error_norm_is_one_function(reference: ReferenceSolution, monkeypatch: pytest.MonkeyPatch) -> None:
    for key in list(ERROR_NORMS):
        monkeypatch.delitem(ERROR_NORMS, key)

    @error_norm("u_max", description="displacement, largest", name="u (largest)")
    def largest(reference: ReferenceSolution, found: TransferredSolution, other: TransferredSolution) -> float:
        return float(np.abs(found.u - other.u).max() / np.abs(reference.own.u).max())

    here = reference.fields
    assert errors(reference, reference.transfer(replace(here, u=1.5 * here.u))) == {"u_max": pytest.approx(0.5)}
    del ERROR_NORMS["u_max"]  # monkeypatch would put it back


@pytest.mark.parametrize(("mesh_size", "below"), [(0.02, None), (0.02, 2e-3), (0.01, 2e-3)])
@pytest.mark.parametrize("shape", ["disk", "half_disk"])
def test_the_unknowns_of_a_graded_mesh_are_foreseen(shape: str, mesh_size: float, below: float | None) -> None:
    """What a plan may afford is decided on them; a mesh fine at one point only is not fine everywhere."""
    table = {"shape": shape, "radius": 0.1, "mesh_size": mesh_size, **({"mesh_size_below": below} if below else {})}
    made = Scene.model_validate({**model(4, 1e6), "domain": table, "boundary": {}})
    body = made.domain.build(MPI.COMM_SELF, 2)
    true = 2 * body.mesh.topology.index_map(0).size_global
    assert 0.6 < Setting(made).unknowns / true < 1.4


@pytest.mark.parametrize("shape", ["rectangle", "box"])
def test_the_mesh_width_halves_where_a_mesh_is_refined(shape: str) -> None:
    """Whatever the angles of its cells: an order in h is a slope over it."""
    size = (1.0, 0.3, 0.7)[: 2 if shape == "rectangle" else 3]
    body = scene_of(shape, size).build(MPI.COMM_SELF, len(size))
    widths = [width(*cells_of(b)) for b in (body, refinement.uniform(body).domain)]
    assert widths[1] == pytest.approx(widths[0] / 2, rel=1e-9)


def scene_of(shape: str, size: tuple[float, ...]) -> Any:
    table = {"shape": shape, "size": size, "cells": [3] * len(size)}
    steel = {
        "model": "plane_stress" if len(size) == 2 else "three_dimensional",
        "youngs_modulus": 1.0,
        "poisson_ratio": 0.3,
    }
    return Scene.model_validate({"domain": table, "material": steel, "boundary": {}}).domain


def cells_of(body: Domain) -> tuple[Array, Integers]:
    return body.mesh.geometry.x[:, : body.dimension], compat.geometry_dofmap(body.mesh).astype(np.int64)


def test_adaptive_meshes_are_added_and_the_reference_stays_finer_than_the_scenes_own_mesh() -> None:
    made = plan.make(scene(8, friction=LAW), [axes.read("mesh=4"), axes.read("accuracy=0.1,0.05")])
    assert [s.accuracy for s in made.points if s.accuracy] == [0.1, 0.05]
    assert {s.scene.domain.cells[0] for s in made.points if not s.accuracy} == {4, 8}  # type: ignore[union-attr]
    assert made.reference[0].scene.domain.cells[0] == 32  # type: ignore[union-attr]
    assert made.reference[0].accuracy is None


def test_a_plan_of_the_programs_own_varies_what_the_scene_has() -> None:
    with_law = plan.make(scene(8, friction=LAW), []).points
    without = plan.make(scene(8), []).points
    assert {s.scene.solver.smoothing for s in with_law} == {None, "quadratic", "chks", "log_exp", "paper"}
    assert {s.scene.solver.smoothing for s in without} == {None}
    for points in (with_law, without):
        assert {s.scene.domain.cells[0] for s in points} == {2, 4, 8, 16}  # type: ignore[union-attr]
        assert {"auto", "tao", "snes_vi"} <= {s.scene.solver.method for s in points}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["mash=1"], "did you mean 'mesh'"),
        (["mesh="], "needs values"),
        (["epsilon=-1"], "above 0"),
        (["method=newton"], "allowed"),
        (["mesh=0"], "number of cells"),
        (["mesh=8", "mesh=16"], "twice"),
        (["epsilon=1", "epsilon_absolute=1"], "leave one"),
        (["smoothing=chks"], "epsilon"),
    ],
)
def test_a_bad_plan_says_how_to_mend_it(given: list[str], words: str) -> None:
    with pytest.raises(InputError) as error:
        plan.make(scene(4, friction=LAW), [axes.read(text) for text in given])
    assert words in str(error.value).replace('"', "'")


def test_cells_that_do_not_come_out_whole_are_refused_with_those_that_do() -> None:
    tables = {"domain": Rectangle(size=(1.0, 1.0), cells=(150, 6))}
    with pytest.raises(InputError, match="possible: 75, 150, 300, 600"):
        meshes.at(tables, "60")
    assert meshes.refined(tables, Fraction(1, 2)) == {"domain": Rectangle(size=(1.0, 1.0), cells=(75, 3))}
    assert meshes.refined(tables, Fraction(1, 4)) is None


def test_a_scene_without_a_law_has_no_epsilon() -> None:
    with pytest.raises(InputError, match="no law"):
        plan.make(scene(4), [axes.read("epsilon=1")])


def data(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    return found


def test_a_study_leaves_numbers_and_pictures(studied: Path) -> None:
    found = data(studied / "out")
    lines = list(csv.DictReader((studied / "out" / "study.csv").open(encoding="utf-8")))
    assert len(lines) == len(found["points"]) == 3
    for line, point in zip(lines, found["points"], strict=True):
        assert point["converged"]
        assert float(line["error_energy_norm"]) == point["errors"]["energy_norm"]
        assert float(line["seconds"]) == pytest.approx(sum(point["phases"].values()))
        assert point["peak_memory_mb"] > 50
    assert found["own"] == found["exact"]
    assert [set(errors) for errors in found["reference"]["errors_of_coarser_meshes"]] == [set(ERROR_NORMS)] * 2
    assert set(found["quantities"]) == set(ERROR_NORMS)
    assert {p.name for p in (studied / "out").glob("*.png")} == {"work_precision.png", "error_epsilon.png", "time.png"}


def test_a_finished_study_is_refused_or_resumed_without_running_a_point(studied: Path) -> None:
    words = ("study", studied / "square.toml", "--axis", "epsilon=1,0.1", "--out", studied / "out", "--repeat", 1)
    refused = hvi(*words)
    assert refused.returncode == 2
    assert "--resume" in refused.stderr
    before = {p: p.stat().st_mtime_ns for p in (studied / "out" / "points").iterdir()}
    first = data(studied / "out")
    assert hvi(*words, "--resume").returncode == 0
    assert {p: p.stat().st_mtime_ns for p in (studied / "out" / "points").iterdir()} == before
    assert data(studied / "out") == first


@pytest.mark.long
def test_under_mpirun_the_points_run_on_its_ranks_and_the_errors_are_the_same(studied: Path) -> None:
    words = ("study", studied / "square.toml", "--axis", "epsilon=1,0.1", "--out", studied / "two", "--repeat", 1)
    done = hvi(*words, ranks=2)
    assert done.returncode == 0, done.stderr
    one, two = data(studied / "out"), data(studied / "two")
    assert two["ranks"] == 2
    for a, b in zip(one["points"], two["points"], strict=True):
        assert b["converged"]
        for name in ERROR_NORMS:
            assert a["errors"][name] == pytest.approx(b["errors"][name], rel=1e-5, abs=1e-8), name


def test_a_scene_without_a_solution_ends_a_study(tmp_path: Path) -> None:
    pulled = model(2)
    pulled["boundary"]["press"]["traction"] = [0.0, 1.0e6]
    done = hvi("study", write_scene(tmp_path / "up.toml", pulled), "--axis", "mesh=2", "--out", tmp_path / "out")
    assert done.returncode == 3
    assert "no solution exists" in done.stderr


@pytest.mark.long
def test_a_point_that_hangs_is_given_up_and_run_again_with_a_longer_limit(tmp_path: Path) -> None:
    """The reference, which may take five times the limit, is not even imported within a quarter of a second."""
    file = write_scene(tmp_path / "square.toml", model(2, friction=LAW))
    words = ("study", file, "--axis", "mesh=2", "--out", tmp_path / "out", "--repeat", 1)
    short = hvi(*words, "--limit", 0.05)
    assert short.returncode == 4
    assert "not finished after 0.25 s" in short.stderr
    kept = [p for p in (tmp_path / "out" / "points").iterdir() if p.suffix not in (".json", ".toml")]
    assert kept == []
    assert hvi(*words, "--resume").returncode == 0
    assert all(p["converged"] for p in data(tmp_path / "out")["points"])


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_study_keeps_its_points_and_goes_on(tmp_path: Path, number: int) -> None:
    file = write_scene(tmp_path / "square.toml", model(4, friction=LAW))
    words = ("study", file, "--axis", "epsilon=1,0.1,0.01,0.001", "--out", tmp_path / "out", "--repeat", 1)
    child = subprocess.Popen(command(*words), stderr=subprocess.PIPE, text=True, start_new_session=True)
    points = tmp_path / "out" / "points"
    deadline = time.monotonic() + 120
    while len(list(points.glob("*.json"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(child.pid, number)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "--resume goes on" in errors
    left = subprocess.run(["pgrep", "-f", str(points)], capture_output=True, text=True, check=False).stdout
    assert left == ""
    kept = {p: p.stat().st_mtime_ns for p in points.glob("*.json")}
    assert len(kept) >= 3
    names = {p.name.split(".")[0] for p in points.iterdir()}
    assert names == {p.stem for p in kept}  # of the point that was running nothing is left
    assert hvi(*words, "--resume").returncode == 0
    assert {p: p.stat().st_mtime_ns for p in kept} == kept
    assert len(data(tmp_path / "out")["points"]) == 5


@pytest.mark.long
def test_each_point_of_a_study_presses_its_obstacle_by_the_force(tmp_path: Path) -> None:
    """A column without lateral contraction is exact on each mesh: energy F² h/(2 E b), and nothing is off."""
    force, height, modulus = 2e4, 0.5, 1e9
    plate = {"point": [0.0, height + 1e-4], "normal": [0.0, -1.0], "force": [0.0, -force]}
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, height], "cells": [4, 2]},
        "material": {"model": "plane_strain", "youngs_modulus": modulus, "poisson_ratio": 0.0},
        "boundary": {
            "base": {"on": "bottom", "displacement": [0.0, 0.0]},
            "lid": {"on": "top", "contact": {"obstacle": plate}},
        },
    }
    file = write_scene(tmp_path / "column.toml", table)
    done = hvi("study", file, "--axis", "mesh=4,8", "--out", tmp_path / "out", "--repeat", 1)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "out" / "study.csv").open(encoding="utf-8")))
    assert len(rows) == 2
    for row in rows:
        assert row["reason"] == "certified"
        assert float(row["energy"]) == pytest.approx(force**2 * height / (2 * modulus), rel=1e-7)
        assert max(float(row[f"error_{name}"]) for name in ("energy_norm", "pressure_l2", "resultant")) < 1e-6
