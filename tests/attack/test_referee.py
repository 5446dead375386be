"""The referee itself: it accepts what is right, and finds what is made wrong on purpose."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from attack import attack
from judge import CONTRADICTS, MISSED, UNDECIDED, blurred, judge
from program import Answer
from referee.assembly import assemble
from referee.coordinates import Floor
from referee.equilibria import find
from referee.laws import exact_law, law_of
from referee.meshes import block
from referee.minimality import examine
from referee.programmes import verdict
from referee.solution import Check

STEEL = {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29}
WEAK = {"law": "quadratic_linear", "gamma1": 1e6, "gamma2": 5e5, "delta": 9e-6}


def scene(
    push: float = 1e6, friction: dict[str, Any] | None = None, cells: int = 2, wall: bool = True
) -> dict[str, Any]:
    """A square on a floor, pulled at the right."""
    boundary: dict[str, Any] = {
        "pull": {"on": "right", "traction": [push, 0.0]},
        "press": {"on": "top", "traction": [0.0, -1e6]},
        "floor": {"on": "bottom", "contact": {"gap": 0.0}} | ({"friction": friction} if friction else {}),
    }
    if wall:
        boundary["wall"] = {"on": "left", "displacement": [0.0, "free"]}
    domain = {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]}
    return {"domain": domain, "material": STEEL, "boundary": boundary, "solver": {}}


def answer_of(table: dict[str, Any], u: np.ndarray, **changes: Any) -> Answer:
    """An answer of the program with this displacement."""
    mesh = block(table["domain"]["size"], table["domain"]["cells"])
    problem = assemble(table, mesh)
    certificate = {"second_order": "local minimiser"}
    answer = Answer(0, "certified", "held", certificate=certificate, energy=problem.energy(u), points=mesh.points, u=u)
    return replace(answer, **changes)


def closed_form(points: np.ndarray) -> np.ndarray:
    """The model problem without friction: a homogeneous stress."""
    strain = (1e6 + 0.29 * 1e6) / 2.15e11
    return np.column_stack([strain * points[:, 0], -strain * points[:, 1]])


def test_the_closed_form_is_a_solution() -> None:
    table = scene()
    u = closed_form(block([1.0, 1.0], [2, 2]).points)
    assert judge(table, None, answer_of(table, u)).word == "agrees"
    assert answer_of(table, u).energy == pytest.approx(-6.0)


@pytest.mark.parametrize("vertex", range(9))
@pytest.mark.parametrize("component", [0, 1])
def test_a_moved_vertex_is_found(vertex: int, component: int) -> None:
    table = scene()
    u = closed_form(block([1.0, 1.0], [2, 2]).points)
    u[vertex, component] += 1e-4 * np.abs(u).max()
    assert judge(table, None, answer_of(table, u)).word == CONTRADICTS


@pytest.mark.parametrize(
    "claim",
    [
        {"state": "metastable"},
        {"energy": -5.9},
        {"factors": (2.0, np.inf)},
        {"certificate": {"second_order": "not a minimiser"}},
        {"margin": -0.1},
    ],
)
def test_a_false_claim_is_found(claim: dict[str, Any]) -> None:
    table = scene()
    u = closed_form(block([1.0, 1.0], [2, 2]).points)
    assert judge(table, None, answer_of(table, u, **claim)).word == CONTRADICTS


def test_a_refusal_wants_a_reason_in_the_scene() -> None:
    for words, wanted in (("prescribe displacements that differ", UNDECIDED), ("no path is known", CONTRADICTS)):
        assert judge(scene(), None, Answer(2, words)).word == wanted


def test_a_solution_that_is_not_found_is_missed() -> None:
    table = scene()
    u = closed_form(block([1.0, 1.0], [2, 2]).points)
    for moved in (0.0, 1e-2):
        assert judge(table, None, answer_of(table, u * (1 + moved), code=4, text="not certified")).word == MISSED


def test_states_have_their_closed_forms() -> None:
    """A free block pushed with P on a law of peak 1e6 and residual 5e5: held, metastable, escapes."""
    mesh = block([1.0, 1.0], [3, 3])
    for push, state in ((4e5, "held"), (6e5, "metastable"), (9.9e5, "metastable"), (1.01e6, "escapes")):
        table = scene(push, WEAK, cells=3, wall=False)
        table["boundary"]["press"]["traction"] = [0.0, -1e7]
        assert verdict(assemble(table, mesh)).state == state


def test_a_runaway_is_not_excused_by_large_balanced_loads() -> None:
    """Defects of rounding: a net push of 1 beside loads of 1e9, which a law with the peak 0.5 cannot hold."""
    law = {"law": "quadratic_linear", "gamma1": 0.5, "gamma2": 0.25, "delta": 1e-2}
    table = scene(-1e9, law, wall=False)
    table["boundary"]["push"] = {"on": "left", "traction": [1e9 + 1, 0.0]}
    problem = assemble(table, block([1.0, 1.0], [2, 2]))
    assert verdict(problem).state == "escapes"
    u = closed_form(problem.mesh.points) * -1e3
    u[:, 1] *= -0.29
    u[:, 0] -= 591.0
    assert any("as a whole" in line for line in Check(problem, u).wrongs())


def test_a_concave_kink_is_no_minimum_and_a_bound_makes_it_one() -> None:
    literal = {"law": "quadratic_linear_literal", "gamma1": 1e6, "gamma2": 5e5, "delta": 9e-6}
    table = scene(0.0)
    del table["boundary"]["floor"]["contact"]
    table["boundary"]["floor"] |= {"contact": {"gap": 0.0}, "adhesion": literal}
    problem = assemble(table, block([1.0, 1.0], [2, 2]))
    u = np.column_stack([0.29 * problem.mesh.points[:, 0], -problem.mesh.points[:, 1]]) * 1e6 / 2.15e11
    check = Check(problem, u)
    assert not check.wrongs()
    assert examine(check, Floor(problem)).minimiser is True


@pytest.mark.parametrize(("number", "state"), [(994, "escapes"), (384, "metastable")])
def test_what_was_contradicted_by_its_faults_agrees(number: int, state: str, tmp_path: Path) -> None:
    """A peak at which one body ties (994); an uneven floor at a corner of another part and a guide (384)."""
    _, answer, verdict = attack(20261203, number, tmp_path, 30.0)
    assert answer.state == state
    assert verdict.word == "agrees"


@pytest.mark.parametrize(("moved", "excused"), [(0.0, True), (3e-4, False)])
def test_rounding_excuses_no_more_than_its_bound(moved: float, excused: bool) -> None:
    """Far from its place a body's tractions are lost in rounding; what is wrong beyond this bound is no solution."""
    problem = assemble(scene(0.0, wall=False), block([1.0, 1.0], [2, 2]))
    stretch = 1e6 / 2.15e11
    u = problem.mesh.points * [0.29 * stretch, -stretch] - [10.0, 0.0]
    u[4] += moved * stretch
    assert blurred(Check(problem, u)) == excused


def test_at_a_corner_the_uneven_part_is_turned_whatever_the_order() -> None:
    mesh = block([1.0, 1.0], [2, 2])
    points = mesh.points + [0.0, 1e-3] * ((mesh.points[:, 1:] == 0.0) & (mesh.points[:, :1] == 0.5))
    uneven, corner = replace(mesh, points=points), 0
    table = scene()
    parts = [("floor", {"on": "bottom", "contact": {"gap": 0.0}}), ("side", {"on": "left", "contact": {"gap": 0.0}})]
    for order in (parts, parts[::-1]):
        table["boundary"] = dict(order)
        normals = [b.normal for b in assemble(table, uneven).bounds if b.vertex == corner]
        assert sorted(map(list, normals)) == [[-1.0, 0.0], [0.0, -1.0]]
    table["boundary"] = dict(parts[:1]) | {"wall": {"on": "left", "displacement": [0.0, "free"]}}
    (bound,) = [b for b in assemble(table, uneven).bounds if b.vertex == corner]
    assert bound.normal == pytest.approx(np.array([2e-3, -1.0]) / np.hypot(2e-3, 1.0))


@pytest.mark.parametrize(
    ("prescribed", "kept"),
    [(["free"] * 3, "yz"), (["free", 0.0, "free"], "yz"), (["free", "free", 0.0], "z"), ([0.0] * 3, "xyz")],
)
def test_contact_is_exact_in_prescribed_components_only(prescribed: list[Any], kept: str) -> None:
    """At a corner in space with a prescribed side and a second part an uneven floor is turned towards both."""
    mesh = block([1.0, 1.0, 1.0], [1, 1, 1])
    corner = int(np.flatnonzero((mesh.points == [0.0, 1.0, 0.0]).all(axis=1))[0])
    points = mesh.points.copy()
    points[corner, 2] = -0.01
    table = scene()
    table["material"] = STEEL | {"model": "three_dimensional"}
    table["boundary"] = {
        "floor": {"on": "bottom", "contact": {"gap": 1e-6}},
        "side": {"on": "left", "contact": {"gap": 1e-6}},
        "back": {"on": "back", "displacement": prescribed},
    }
    found = [b for b in assemble(table, replace(mesh, points=points)).bounds if b.vertex == corner]
    (floor,) = [b for b in found if b.normal[2] < -0.9]
    normal = np.array([0.01, -0.01, -1.0]) / np.sqrt(1.0002)
    row = normal * [axis in kept for axis in "xyz"]
    assert floor.normal / floor.upper == pytest.approx(row / 1e-6)


def test_the_search_finds_what_exists_and_nothing_else() -> None:
    rng = np.random.default_rng(0)
    mesh = block([1.0, 1.0], [2, 2])
    for push, exists in ((6e5, True), (1.2e6, False)):
        table = scene(push, WEAK, wall=False)
        table["boundary"]["press"]["traction"] = [0.0, -1e7]
        assert (find(assemble(table, mesh), rng) is not None) == exists


@pytest.mark.parametrize(
    "table",
    [
        WEAK,
        {"law": "quadratic_linear_literal", "gamma1": 3.0, "gamma2": 1.0, "delta": 1.0},
        {"law": "sawtooth", "peak_traction": 2.0, "residual_traction": 0.5, "delta": 0.3, "drops": 3},
        {"law": "exponential", "peak_traction": 2.0, "residual_traction": 0.5, "delta": 0.3},
        {"law": "graph", "points": [[0, 0], [0.5, 0], [1, 2], [1, 1], [2, -1]], "one_sided": True},
    ],
)
@pytest.mark.parametrize("smoothing", [None, "quadratic", "chks", "log_exp"])
def test_energies_are_integrals_of_tractions(table: dict[str, Any], smoothing: str | None) -> None:
    exact = exact_law(table)
    length = np.abs(exact.breaks).max() or 0.3
    solver = {"smoothing": smoothing, "epsilon_absolute": 0.05 * exact.scale * length} if smoothing else {}
    law = law_of(table, solver)
    x = np.linspace(-3 * length, 3 * length, 4_001)
    middle = (x[1:] + x[:-1]) / 2
    integral = np.cumsum(law.side(middle, "right") * np.diff(x))
    assert law.value(x[1:]) - law.value(x[:1]) == pytest.approx(integral, abs=2e-3 * exact.scale * length)
