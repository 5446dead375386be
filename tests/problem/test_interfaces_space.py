"""Two bodies in space that meet: patch tests on meshes that do not match, balance of forces, limits of one body."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from joint_scenes import away_from_affine, differences_by_side, seam, seam_scene
from mpi4py import MPI
from scenes import Table, quadratic_linear
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from hvi_fenicsx import InputError, Model, Solution, prepare, read_tables, solve
from hvi_fenicsx.certify import placed_forces
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.joined import PlacedBody, joined
from hvi_fenicsx.problem.facet_overlaps import overlaps
from hvi_fenicsx.problem.facets import Facets
from hvi_fenicsx.workflow import finish

Array = npt.NDArray[np.float64]
E, NU = 2.0e11, 0.3
MATERIAL = {"model": "three_dimensional", "youngs_modulus": E, "poisson_ratio": NU}
CONTACT = {"contact": {"gap": 0.0}}
TURNED = Rotation.from_euler("xyz", [20.0, -35.0, 50.0], degrees=True).as_matrix()
STRAIGHT = np.eye(3)
NORMALS = {"left": (-1, 0, 0), "right": (1, 0, 0), "front": (0, -1, 0), "back": (0, 1, 0), "bottom": (0, 0, -1)}
NORMALS["top"] = (0, 0, 1)
Plan = tuple[tuple[float, float], tuple[float, float]]
WHOLE: Plan = ((0.0, 0.0), (1.0, 1.0))


def stacked(boundary: Table, between: Table, upper: Plan = WHOLE, **solver: Any) -> Model:
    """A block on a block of 1 x 1 x 0.5, cut otherwise; upper: the corner of its base, and the base's size."""
    low = {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [4, 3, 2]}
    high = {"shape": "box", "size": [*upper[1], 0.4], "cells": [3, 4, 2], "origin": [*upper[0], 0.5]}
    return seam_scene(low, high, MATERIAL, boundary, between, **solver)


def placed(scene: Model, rotation: Array) -> Domain:
    """The bodies of a scene, turned together about the origin."""
    bodies: Any = scene.domain
    found = []
    for name, body in bodies.bodies.items():
        one = body.placed(name, body.build(MPI.COMM_WORLD, 3))
        found.append(PlacedBody(name=name, domain=one.domain, origin=rotation @ one.origin, rotation=rotation))
    return joined(MPI.COMM_WORLD, found)


def solved(scene: Model, rotation: Array = STRAIGHT) -> Solution:
    return finish(prepare(scene, domain=placed(scene, rotation)), estimating=False)


def pulled(rotation: Array, stress: Array) -> Table:
    """The tractions of a uniform stress (in the blocks' own axes) on all outer sides."""
    sides = [f"lower.{side}" for side in NORMALS if side != "top"] + [f"upper.{s}" for s in NORMALS if s != "bottom"]
    forces = {side: rotation @ stress @ np.array(NORMALS[side.split(".")[1]]) for side in sides}
    return {s.replace(".", "_"): {"on": s, "traction": list(map(float, t))} for s, t in forces.items()}


AT = pytest.mark.parametrize(
    ("rotation", "degree"),
    [
        pytest.param(STRAIGHT, 1, marks=pytest.mark.long),
        pytest.param(TURNED, 1),
        pytest.param(TURNED, 2, marks=pytest.mark.long),
    ],
)


@AT
def test_uniform_pressure_crosses_meshes_that_do_not_match(rotation: Array, degree: int) -> None:
    found = solved(stacked(pulled(rotation, np.diag([0.0, 0.0, -1e6])), CONTACT, degree=degree), rotation)
    assert found.exit_code == 0
    assert seam(found).pressure * found.problem.scales.stress == pytest.approx(-1e6, rel=1e-10)
    assert away_from_affine(found) < 1e-10


@AT
def test_uniform_shear_crosses_a_glued_seam(rotation: Array, degree: int) -> None:
    stress = 1e6 * np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.5], [1.0, 0.5, 0.0]])
    found = solved(stacked(pulled(rotation, stress), {"tied": True}, degree=degree), rotation)
    state = seam(found)
    traction = np.einsum("mk,mkd->md", state.friction, state.surface.tangents) * found.problem.scales.stress
    assert traction == pytest.approx(np.tile(rotation @ [1e6, 0.5e6, 0.0], (len(traction), 1)), rel=1e-10, abs=1e-4)
    assert away_from_affine(found) < 1e-10


PLANS: list[Plan] = [WHOLE, ((0.13, 0.21), (0.5, 0.6)), ((-0.31, -0.2), (1.7, 1.5)), ((0.41, 0.37), (1.1, 0.4))]


@pytest.mark.parametrize(("plan", "degree"), [*((plan, 1) for plan in PLANS), (PLANS[1], 2), (PLANS[3], 2)])
def test_affine_fields_open_nothing_and_a_pressure_loads_both_sides_alike(plan: Plan, degree: int) -> None:
    scene = stacked({"base": {"on": "lower.bottom", "displacement": [0.0, 0.0, 0.0]}}, CONTACT, plan, degree=degree)
    problem = prepare(scene, domain=placed(scene, TURNED)).problem
    x, surface = problem.points, problem.surfaces[0]
    matrix = np.random.default_rng(1).normal(size=(3, 3))
    for field in (np.ones_like(x), x @ (matrix - matrix.T), x @ matrix):
        opened = problem.relative(np.ascontiguousarray(field).ravel())
        assert np.abs(surface.values(opened)).max() < 1e-12
    forces = np.zeros((len(x), 3))
    forces[surface.blocks] = surface.weights[:, None] * surface.normals
    acting = problem.on_bodies(forces)
    low, high = np.maximum(plan[0], 0.0), np.minimum(np.add(*plan), 1.0)
    area = np.prod(high - low) / problem.scales.length**2
    names = [body.name for body in problem.bodies.single()]
    centre = TURNED @ [*((low + high) / 2), 0.5]
    for sign, name in ((-1.0, 'body "lower"'), (1.0, 'body "upper"')):
        mine = problem.bodies.members == names.index(name)
        total = acting[mine].sum(axis=0)
        assert total == pytest.approx(-sign * area * (TURNED @ [0.0, 0.0, 1.0]), rel=1e-12, abs=1e-14)
        moment = np.cross(x[mine], acting[mine]).sum(axis=0)
        assert moment == pytest.approx(np.cross(centre, total), abs=1e-13)


def pushed(push: float, **between: Any) -> Model:
    boundary = {
        "base": {"on": "lower.bottom", "displacement": [0.0, 0.0, 0.0]},
        "press": {"on": "upper.top", "traction": [0.0, 0.0, -1e6]},
        "push": {"on": "upper.left", "traction": [push, 0.0, 0.0]},
    }
    return stacked(boundary, {**CONTACT, **between}, ((0.2, 0.1), (0.6, 0.8)))


@pytest.mark.long
def test_both_sides_carry_opposite_forces() -> None:
    found = solved(pushed(3e5, friction=quadratic_linear(1e6, 1e-6)))
    assert found.exit_code == 0
    assert found.forces is not None
    forces = found.forces.resultants(found.problem.domain.mesh.comm)
    unit = found.problem.scales.force
    assert forces["seam"] * unit == pytest.approx([-3e5 * 0.8 * 0.4, 0.0, 1e6 * 0.6 * 0.8], rel=1e-10, abs=1e-4)
    assert forces["seam"] + forces[f"seam{placed_forces.SECOND}"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_bodies_that_overlap_or_do_not_meet_are_refused() -> None:
    for origin, words in (([0.2, 0.1, 0.3], "it overlaps the body"), ([1.2, 0.1, 0.5], "do not face each other")):
        table = pushed(3e5).tables()
        table["domain"]["upper"]["origin"] = origin
        with pytest.raises(InputError, match=words):
            prepare(read_tables(table))


def triangulated(size: tuple[float, float], height: float, seed: int, up: float) -> Facets:
    """Triangles of random points of a rectangle."""
    inner = np.random.default_rng(seed).uniform(size=(40, 2))
    plane = np.vstack([inner, [[0, 0], [1, 0], [0, 1], [1, 1]]]) * size
    vertices = np.asarray(Delaunay(plane).simplices, dtype=np.int64)
    corners = np.concatenate([plane, np.full((len(plane), 1), height)], axis=1)[vertices]
    return Facets(nodes=vertices, points=corners, normals=np.tile([0.0, 0.0, up], (len(vertices), 1)))


def test_triangles_are_intersected_exactly() -> None:
    first, second = triangulated((1.0, 1.0), 0.0, 1, -1.0), triangulated((0.7, 1.3), -0.2, 2, 1.0)
    found = overlaps(first, second)
    points = found.points(1)
    x = np.einsum("pk,pki->pi", points.on_first, first.corners[points.first])
    other = np.einsum("pk,pki->pi", points.on_second, second.corners[points.second])
    assert np.abs(x[:, :2] - other[:, :2]).max() < 1e-12
    assert points.weights.sum() == pytest.approx(0.7, rel=1e-12)
    assert points.weights @ x[:, 0] ** 2 == pytest.approx(0.7**3 / 3, rel=1e-12)
    assert points.weights @ (x[:, 0] * x[:, 1]) == pytest.approx(0.7**2 / 4, rel=1e-12)
    assert np.array_equal(found.covered, first.corners[:, :, 0] <= 0.7)


def test_what_lies_behind_a_nearer_facet_is_not_met() -> None:
    first, near = triangulated((1.0, 1.0), 0.0, 1, -1.0), triangulated((1.0, 1.0), -0.1, 2, 1.0)
    far = triangulated((1.0, 1.0), -0.3, 3, 1.0)
    both = Facets(**{k: np.concatenate([getattr(far, k), getattr(near, k)]) for k in ("nodes", "points", "normals")})
    found = overlaps(first, both)
    assert found.second.min() >= len(far.nodes)
    assert found.areas.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.long
def test_exchanging_the_sides_changes_less_with_finer_meshes() -> None:
    """Energies, so at least the second order over two refinements."""
    boundary = {
        "base": {"on": "lower.bottom", "displacement": [0.0, 0.0, 0.0]},
        "press": {"on": "upper.top", "traction": [0.0, 0.0, "-1e6*(2.4 - 2.6*x)"]},
        "push": {"on": "upper.left", "traction": [4e5, 0.0, 0.0]},
    }
    scene = stacked(boundary, {**CONTACT, "friction": quadratic_linear(1e6, 1e-6)})
    differences = differences_by_side(scene.tables(), (1, 4))
    assert differences[0] / differences[1] > 16.0


@pytest.mark.long
def test_three_blocks_in_a_row_pass_a_pressure_on() -> None:
    """The middle one is in two interfaces; no two meshes match."""
    box = {"shape": "box", "size": [1.0, 1.0, 0.3]}
    cells = {"low": [4, 3, 2], "mid": [3, 4, 2], "top": [2, 3, 1]}
    boundary = {
        "base": {"on": "low.bottom", "displacement": ["free", "free", 0.0]},
        "press": {"on": "top.top", "traction": [0.0, 0.0, -1e6]},
    }
    interface = {
        "a": {"between": ["mid.bottom", "low.top"], **CONTACT},
        "b": {"between": ["mid.top", "top.bottom"], **CONTACT},
    }
    domain = {n: {**box, "cells": c, "origin": [0.0, 0.0, 0.3 * i]} for i, (n, c) in enumerate(cells.items())}
    table = {"domain": domain, "material": MATERIAL, "boundary": boundary, "interface": interface}
    found = solve(read_tables(table))
    assert found.exit_code == 0
    assert found.examination is not None
    assert len(found.examination.states) == 2
    for state in found.examination.states:
        assert state.pressure * found.problem.scales.stress == pytest.approx(-1e6, rel=1e-8)
