"""Round sides that are meshed unevenly: a motion that the shape leaves free is exactly free, whatever the mesh.

The truth is that of circles, balls, cylinders and cones: normals, rotations about the axis, moments, clearances.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from scenes import Table, solved

from hvi_fenicsx import Solution, prepare, read_tables
from hvi_fenicsx.problem import facets

DAY = int(time.time()) // 86400
E, GAP, TAU, INNER, BETWEEN, OUTER = 2e11, -1e-4, 1e7, 0.2, 0.5, 1.0
MATERIAL = {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": 0.3}
RIM = {"on": "hub_out", "displacement": [0, 0]}
RING = """
c = newp; Point(c) = {{3, -2, 0}};
For i In {{0:3}}
  x = Cos(i * Pi / 2); y = Sin(i * Pi / 2);
  Point(c + 1 + i) = {{3 + {low} * x, -2 + {low} * y, 0, {size} * (1 + i / 3)}};
  Point(c + 5 + i) = {{3 + {high} * x, -2 + {high} * y, 0, {size} * (2 - i / 3)}};
EndFor
l = newl;
For i In {{0:7}}
  j = c + 1 + i - i % 4; Circle(l + i) = {{j + i % 4, c, j + (i + 1) % 4}};
EndFor
k = newcl; Curve Loop(k) = {{l:l + 3}}; Curve Loop(k + 1) = {{l + 4:l + 7}}; s = news; Plane Surface(s) = {{k + 1, k}};
Physical Surface("{name}") = {{s}}; Physical Curve("{name}_in") = {{l:l + 3}};
Physical Curve("{name}_out") = {{l + 4:l + 7}};
"""
ROD = """
rod, block, hole = (occ.addCylinder(0, 0, 0, 0, 0, 0.6, r) for r in (0.5, 1.0, 0.5))
(_, block), = occ.cut([(3, block)], [(3, hole)])[0]
occ.synchronize()
for volume, name, size in ((rod, "rod", 0.17), (block, "block", 0.2)):
    mesh.setSize(gmsh.model.getBoundary([(3, volume)], recursive=True), size)
    gmsh.model.addPhysicalGroup(3, [volume], name=name)
    for _, tag in gmsh.model.getBoundary([(3, volume)], oriented=False):
        _, _, low, wide, _, high = gmsh.model.getBoundingBox(2, tag)
        side = "_low" if high < 0.01 else "_high" if low > 0.59 else "_seat" if wide < 0.6 else "_rim"
        gmsh.model.addPhysicalGroup(2, [tag], name=name + side)
mesh.generate(3)
"""


def rings(folder: Path, seed: int, between: Table, degree: int = 1, wide: float = BETWEEN, **more: Table) -> Table:
    """A hollow shaft in a hub with other cells, one of them named first; rims and bores as they are stated."""
    draw = np.random.default_rng(seed)
    sizes, sides = draw.uniform(0.04, 0.1, 2), draw.permutation(["shaft_out", "hub_in"])
    file = folder / "rings.geo"
    shaft = RING.format(name="shaft", low=INNER, high=BETWEEN, size=sizes[0])
    hub = RING.format(name="hub", low=wide, high=OUTER, size=sizes[1])
    file.write_text(f"{shaft}{hub}Mesh.ElementOrder = {degree};")
    return {
        "domain": {"shape": "file", "file": str(file)},
        "material": dict(MATERIAL),
        "interface": {"fit": {"between": list(map(str, sides)), **between}},
        "solver": {"degree": degree},
        "boundary": more,
    }


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("seed", [DAY, DAY + 1])
def test_rings_turn_freely_and_their_forces_and_moments_balance(seed: int, degree: int, tmp_path: Path) -> None:
    problem = prepare(read_tables(rings(tmp_path, seed, {"contact": {"gap": "measured"}}, degree))).problem
    (surface,) = problem.surfaces
    turned = np.column_stack([-(problem.points[:, 1] + 2), problem.points[:, 0] - 3])
    for moved in (turned, turned * problem.bodies.members[:, None]):
        seen = problem.relative(moved.ravel()).reshape(-1, 2)[surface.blocks]
        assert np.abs(np.sum(seen * surface.normals, axis=1)).max() < 1e-13
    seen = problem.relative(turned.ravel()).reshape(-1, 2)[surface.blocks]
    assert np.abs([*seen.ravel(), *problem.interfaces[0].gap]).max() < 1e-13
    force = np.zeros_like(turned)
    force[surface.blocks] = np.random.default_rng(seed).normal(size=(len(surface.blocks), 2))
    forces = problem.on_bodies(force)
    assert np.abs([*forces.sum(axis=0), np.sum(forces * turned)]).max() < 1e-12


def test_a_fit_bears_the_torque_of_its_friction(tmp_path: Path) -> None:
    between = {"contact": {"gap": GAP}, "friction": {"law": "tresca", "yield_traction": TAU}}
    loads = {"rim": RIM, "turn": {"on": "shaft_in", "moment": TAU * 2 * np.pi * BETWEEN**2}}
    assert prepare(read_tables(rings(tmp_path, DAY, between, **loads))).load_factors("turn").held == pytest.approx(
        1.0, rel=2e-3
    )


def test_a_cooled_shaft_is_loose_and_does_not_spin(tmp_path: Path) -> None:
    table = rings(tmp_path, DAY, {"contact": {"gap": 0.0}}, rim=RIM)
    table |= {"body": {"cool": {"region": "shaft", "temperature": -1.0}}}
    found = solved(table | {"material": MATERIAL | {"thermal_expansion": 1e-3}})
    assert found.exit_code == 0
    assert [mode.name for mode in found.solvability.free] == ['rotation about (3, -2) of body "shaft"']
    part = found.contact["fit"]
    assert np.abs(part.slip).max() < 3e-3 * BETWEEN
    assert np.abs(part.pressure).max() < 1e-9 * E


def test_a_press_fit_without_supports_has_the_pressure_of_its_overlap(tmp_path: Path) -> None:
    """Lame: two rings; they may move as a whole and turn in one another."""
    found = solved(rings(tmp_path, DAY, {"contact": {"gap": GAP}}))
    assert found.exit_code == 0
    assert len(found.solvability.free) == 4
    inner, outer = (
        (large**2 + small**2) / (large**2 - small**2) for small, large in ((INNER, BETWEEN), (BETWEEN, OUTER))
    )
    part = found.contact["fit"]
    assert part.pressure.mean() == pytest.approx(-GAP * E / BETWEEN / (inner + outer), rel=0.02)


def test_a_clearance_is_that_of_the_circles(tmp_path: Path) -> None:
    table = rings(tmp_path, DAY, {"contact": {"gap": "measured"}}, wide=BETWEEN + 0.05)
    np.testing.assert_allclose(prepare(read_tables(table)).problem.interfaces[0].gap, 0.05, rtol=1e-10)


@pytest.mark.parametrize("degree", [1, 2])
def test_nothing_holds_a_round_disk_against_a_torque(degree: int) -> None:
    arcs = ["lower_arc", "upper_arc"]
    table = {
        "domain": {"shape": "disk", "radius": 0.5, "mesh_size": 0.1, "mesh_size_below": 0.02},
        "material": dict(MATERIAL),
        "boundary": {"turn": {"on": arcs, "moment": 1e6}, "seat": {"on": arcs, "contact": {"gap": GAP}}},
        "solver": {"degree": degree},
    }
    found = prepare(read_tables(table)).solvability
    assert (found.state, found.lambda_held) == ("escapes", 0.0)
    assert getattr(found.direction, "name", "") == "rotation about (0, 0.5), counterclockwise"


def test_a_tight_rod_slides_out_of_its_hole(tmp_path: Path) -> None:
    table = {
        "domain": {"shape": "file", "file": str(meshes.make(tmp_path / "rod.msh", ROD))},
        "material": MATERIAL | {"model": "three_dimensional"},
        "boundary": {
            "pull": {"on": "rod_high", "force": [0, 0, 1e3]},
            "rim": {"on": "block_rim", "displacement": [0] * 3},
        },
        "interface": {"fit": {"between": ["rod_seat", "block_seat"], "contact": {"gap": GAP}}},
    }
    found = prepare(read_tables(table)).solvability
    assert found.lambda_held == 0.0
    assert getattr(found.direction, "name", "") == 'translation along +z of body "rod": it slides off body "block"'


def test_an_overlap_that_is_measured_is_a_load() -> None:
    """Two blocks of height 1 that overlap by d: the stress is E d/2."""
    block, depth = {"shape": "rectangle", "size": [1.0, 1.0]}, 1e-4
    found: Solution = solved(
        {
            "domain": {
                "lower": block | {"cells": [7, 7]},
                "upper": block | {"cells": [8, 8], "origin": [0, 1 - depth]},
            },
            "material": MATERIAL | {"poisson_ratio": 0.0},
            "boundary": {"ends": {"on": ["lower.bottom", "upper.top"], "displacement": [0, 0]}},
            "interface": {"fit": {"between": ["upper.bottom", "lower.top"], "contact": {"gap": "measured"}}},
        }
    )
    assert found.estimate is not None
    assert found.estimate.relative < 1e-6
    np.testing.assert_allclose(found.contact["fit"].pressure, E * depth / 2, rtol=1e-9)


SHAPES = {  # radius and slope of the meridian at a height
    "cylinder": (lambda z: 1 + 0 * z, lambda z: 0 * z),
    "cone": (lambda z: 2 - z, lambda z: -1 + 0 * z),
    "ball": (lambda z: np.sqrt(1 - z**2), lambda z: -z / np.sqrt(1 - z**2)),
}


def side_of(points: Any, corners: Any) -> facets.Facets:
    outward = facets.outward(points[corners], np.zeros((len(corners), points.shape[1])))
    return facets.Facets(nodes=corners, points=points[corners], normals=outward)


@pytest.mark.parametrize(("shape", "rows"), [("cylinder", 2), ("cylinder", 5), ("cone", 5), ("ball", 5)])
def test_the_normals_are_those_of_the_surface(shape: str, rows: int) -> None:
    draw = np.random.default_rng(DAY)
    a, z = (
        grid.ravel() for grid in np.meshgrid(*(np.sort(draw.uniform(0, m, n)) for m, n in ((2.5, 16), (0.5, rows))))
    )
    (radius, slope), out = (of(z) for of in SHAPES[shape]), np.column_stack([np.cos(a), np.sin(a)])
    points, normals = np.column_stack([radius[:, None] * out, z]), np.column_stack([out, -slope])
    first = (np.arange(15) + 16 * np.arange(rows - 1)[:, None]).ravel()
    corners = np.concatenate([first[:, None] + steps for steps in ((0, 1, 16), (1, 17, 16))])
    found = facets.quadric_of(side_of(points, corners))
    assert found is not None
    slopes = found.slopes(points)
    along = np.sum(slopes * normals, axis=1) / np.linalg.norm(slopes, axis=1) / np.linalg.norm(normals, axis=1)
    np.testing.assert_allclose(np.abs(along), 1.0, rtol=1e-12)


@pytest.mark.parametrize("corners", [4, 6, 8])
def test_a_polygon_of_one_facet_a_side_is_no_circle(corners: int) -> None:
    number, angle = np.arange(corners), 2 * np.pi * np.arange(corners) / corners
    ring = np.column_stack([number, (number + 1) % corners])
    assert facets.quadric_of(side_of(np.column_stack([np.cos(angle), np.sin(angle)]), ring)) is None
