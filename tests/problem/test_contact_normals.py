"""One decision on normals: near an axis, solve, certificate and existence take the true one; meshes may be uneven."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import make
from mpi4py import MPI
from scenes import STEEL, P, Q, Table, block, displacement, model, points, quadratic_linear, solved

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.geometry import tangents
from hvi_fenicsx.problem.contact_surface import Surface, decide

SLOPES = [2e-9, 5e-5, 1e-2]
"""Between and on both sides of the angles at which normals were once rounded to an axis."""


def on_slope(slope: float, scene: Table, at: float = 1.0) -> Table:
    """The scene with a plane through (at, 0), slanted by a slope, for its floor."""
    scene["boundary"]["floor"]["contact"] = {"obstacle": {"point": [at, 0.0], "normal": [-slope, 1.0]}}
    return scene


def distance(solution: Any, slope: float, at: float = 1.0) -> Any:
    """The distance of the displaced bottom to the plane, to first order as the contact condition has it, m."""
    x, u = points(solution), displacement(solution)
    bottom = x[:, 1] < 1e-9
    return (x[bottom] + u[bottom] - [at, 0.0]) @ np.array([-slope, 1.0]) / np.hypot(slope, 1.0)


@pytest.mark.parametrize("slope", SLOPES)
def test_without_friction_a_body_slides_down_any_slope(slope: float) -> None:
    scene = on_slope(slope, block(2, push=0.0))
    del scene["boundary"]["pull"]
    found = prepare(read_tables(scene)).solvability
    assert found.state == "escapes"
    assert found.margin == pytest.approx(-slope, rel=1e-6)


@pytest.mark.parametrize("slope", SLOPES)
def test_friction_carries_the_weight_along_the_slope_and_contact_what_is_across(slope: float) -> None:
    found = solved(on_slope(slope, block(2, push=-0.1 * P, friction=quadratic_linear(2 * P))))
    assert (found.exit_code, found.solvability.state) == (0, "held")
    (state,) = found.examination.states
    weights, length = state.surface.weights, np.hypot(1.0, slope)
    along, across = (-0.1 - slope) / length, (1.0 - 0.1 * slope) / length  # of the load, in units of P = Q
    assert weights @ -state.pressure == pytest.approx(across, rel=1e-9)
    assert weights @ state.friction[:, 0] == pytest.approx(along, rel=1e-9)
    assert np.min(distance(found, slope)) == pytest.approx(0.0, abs=1e-20 + 1e-14 * slope)


def test_an_obstacle_slightly_off_the_axis_is_certified() -> None:
    scene = on_slope(5e-5, block(4, friction=quadratic_linear(P)))
    del scene["boundary"]["pull"]
    scene["boundary"]["press"]["traction"] = [0.2 * P, -Q]
    assert solved(scene).exit_code == 0


def test_where_a_wall_prescribes_a_component_contact_is_still_that_of_the_true_plane() -> None:
    scene = on_slope(-9e-5, model(4), at=0.0)
    scene["boundary"]["wall"]["displacement"] = [1e-6, "free"]
    found = solved(scene)
    assert (found.exit_code, [w for w in found.warnings if "coarse" not in w]) == (0, [])
    at_wall = np.argmin(np.abs(points(found)[points(found)[:, 1] < 1e-9, 0]))
    assert distance(found, -9e-5, at=0.0)[at_wall] == pytest.approx(0.0, abs=1e-19)


UNEVEN = """
import random
random.seed(1)
square(0.25)
mesh.generate(2)
for side, axis in (("bottom", 1), ("left", 0)):
    a, b, c, d = SIDES[side]
    for dim, tag in gmsh.model.getEntitiesInBoundingBox(a - 1e-6, b - 1e-6, -1e-6, c + 1e-6, d + 1e-6, 1e-6):
        tags, points, _ = mesh.getNodes(dim, tag)
        for i, node in enumerate(tags):
            x = list(points[3 * i : 3 * i + 3])
            x[axis] += random.uniform(-1, 1) * {amplitude}
            mesh.setNode(node, x, [])
"""
UNEVEN_BOX = """
import random
random.seed(1)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
occ.addBox(0, 0, 0, 1, 1, 1)
occ.synchronize()
for name, axis, at in (("left", 0, 0), ("right", 0, 1), ("bottom", 2, 0), ("top", 2, 1)):
    low, high = [-1e-6] * 3, [1 + 1e-6] * 3
    low[axis], high[axis] = at - 1e-6, at + 1e-6
    found = gmsh.model.getEntitiesInBoundingBox(*low, *high, 2)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in found], name=name)
gmsh.model.addPhysicalGroup(3, [1], name="body")
mesh.generate(3)
tags, points, _ = mesh.getNodes()
for i, node in enumerate(tags):
    x = list(points[3 * i : 3 * i + 3])
    if x[2] < 1e-9:
        x[2] += random.uniform(-1, 1) * {amplitude}
        mesh.setNode(node, x, [])
"""
WALLS: dict[str, Table] = {
    "no wall": {},
    "prescribed": {"wall": {"on": "left", "displacement": [0.0, "free"]}},
    "contact": {"wall": {"on": "left", "contact": {"gap": 0.0}}},
}


def on_uneven(path: Path, wall: Table, dimension: int = 2) -> Table:
    """A block on friction, pressed down and pushed to the left, with or without a wall there."""
    push, press = [[-0.2 * P, 0.0, 0.0], [0.0, 0.0, -Q]] if dimension == 3 else [[-0.2 * P, 0.0], [0.0, -Q]]
    floor = {"on": "bottom", "contact": {"gap": 0.0}, "friction": quadratic_linear(2 * P)}
    return {
        "domain": {"shape": "file", "file": str(path)},
        "material": STEEL | ({"model": "three_dimensional"} if dimension == 3 else {}),
        "boundary": {
            "press": {"on": "top", "traction": press},
            "push": {"on": "right", "traction": push},
            "floor": floor,
            **wall,
        },
    }


@pytest.mark.parametrize("wall", WALLS)
@pytest.mark.parametrize("amplitude", [5e-6, 1e-4])
def test_a_mesh_file_with_an_uneven_floor_is_certified(tmp_path: Path, amplitude: float, wall: str) -> None:
    path = make(tmp_path / "uneven.msh", UNEVEN.format(amplitude=amplitude))
    found = solved(on_uneven(path, WALLS[wall]))
    assert (found.exit_code, found.solvability.state) == (0, "held")
    assert any("boundary.floor.contact: the part is nearly flat" in warning for warning in found.warnings)
    held = sum(
        state.surface.weights @ (-state.pressure[:, None] * state.surface.normals) for state in found.examination.states
    )
    assert -held[1] == pytest.approx(Q / found.problem.scales.stress, rel=1e-3)


def test_in_space_too(tmp_path: Path) -> None:
    path = make(tmp_path / "uneven.msh", UNEVEN_BOX.format(amplitude=1e-4))
    table = {part: effect | {"displacement": [0.0, "free", "free"]} for part, effect in WALLS["prescribed"].items()}
    assert solved(on_uneven(path, table, dimension=3)).exit_code == 0


def part(name: str, normal: tuple[float, ...], uneven: float, alone: int) -> Surface:
    """A part of two vertices: number 0, which both parts have, and one of its own, where the normal is turned."""
    n = np.array([normal, np.add(normal, [uneven * normal[1], -uneven * normal[0]])])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return Surface(
        part=name,
        facets=np.array([0], np.int32),
        blocks=np.array([0, alone], np.int32),
        points=np.array([[0.5, 0.0, 0.0], [0.4, 0.0, 0.0]]),
        normals=n,
        measured=n,
        tangents=tangents(n),
        weights=np.array([0.1, 0.1]),
    )


def decided(
    one: tuple[float, ...], other: tuple[float, ...], uneven: tuple[str, ...] = (), fixed: tuple[int, ...] = ()
) -> Any:
    """The normals of the parts "one" and "other" at the vertex that they share."""
    normals = {"one": one, "other": other}
    parts = {name: part(name, n, 1e-3 if name in uneven else 0.0, i) for i, (name, n) in enumerate(normals.items(), 1)}
    found = decide(MPI.COMM_SELF, parts, {}, np.array(fixed, np.int32), 1.0)
    return tuple(found[name].normals[0] for name in parts)


@pytest.mark.parametrize(
    ("one", "other", "uneven", "fixed", "words"),
    [
        ((3e-3, -1.0), (-1.0, 0.0), (), (), "boundary.one"),
        ((1e-6, -1.0), (-1.0, 0.0), (), (), "5.7e-07°"),
        ((0.05, -1.0), (-1.0, 0.0), ("one",), (), "obstacle"),
        ((0.3, -1.0), (0.3, -1.0), (), (0,), "u_x"),
    ],
)
def test_other_directions_cannot_meet(
    one: tuple[float, ...], other: tuple[float, ...], uneven: tuple[str, ...], fixed: tuple[int, ...], words: str
) -> None:
    with pytest.raises(InputError, match="must be orthogonal or equal") as caught:
        decided(one, other, uneven, fixed)
    assert words in str(caught.value)
