"""Cells with curved edges at degree 2: closed forms, uniform stresses, ranks, and where they are not used.

A polygon, a node off its curve or a side that leaves its plane still converges and passes its own certificate; so all
is held to Lamé's thick walls and to uniform stresses, which curved cells represent exactly.
"""

from __future__ import annotations

from pathlib import Path

import lame
import meshes
import numpy as np
import pytest
import rings
import shells
import ufl
from lame import BULK, NU, E, Errors, P
from rings import RING

import hvi_fenicsx as hvi

SHELL = """
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
gmsh.option.setNumber("Mesh.MeshSizeMin", {size})
ball, hole, box = occ.addSphere(0, 0, 0, 2), occ.addSphere(0, 0, 0, 1), occ.addBox(0, 0, 0, 3, 3, 3)
occ.intersect(occ.cut([(3, ball)], [(3, hole)])[0], [(3, box)])
occ.synchronize()
for _, tag in gmsh.model.getEntities(2):
    x, y, z = gmsh.model.getBoundingBox(2, tag)[3:]
    flat = [name for name, end in (("left", x), ("front", y), ("bottom", z)) if end < 0.01]
    gmsh.model.addPhysicalGroup(2, [tag], name=flat[0] if flat else "inner" if x < 1.01 else "outer")
gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
mesh.generate(3)
mesh.setOrder({order})
"""
"""An eighth of a hollow ball, radii 1 and 2."""
FLAT = {2: ("left", "bottom"), 3: ("left", "front", "bottom")}


def body(folder: Path, dimension: int, size: float, order: int = 2) -> hvi.Body:
    if dimension == 3:
        return hvi.Body.file(meshes.make(folder / "shell.msh", SHELL.format(size=size, order=order)), dimension=3)
    file = folder / "ring.geo"
    file.write_text(RING.format(size=size, order=order))
    return hvi.Body.file(file)


def rubber(dimension: int, expansion: float = 0.0) -> hvi.Isotropic:
    kind = ("plane_strain", "three_dimensional")[dimension - 2]
    return hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model=kind, thermal_expansion=expansion)


def symmetry(names: tuple[str, ...]) -> list[hvi.Displacement]:
    axes = {"left": 0, "front": 1, "bottom": len(names) - 1 if len(names) == 3 else 1}
    every = FLAT[3] if "front" in names else FLAT[2]
    return [
        hvi.Displacement(name, [0.0 if axis == axes[name] else None for axis in range(len(every))]) for name in names
    ]


def errors(folder: Path, dimension: int, size: float, order: int) -> Errors:
    """Of the solution under pressure inside, against Lamé's thick wall."""
    effects = [rubber(dimension), *symmetry(FLAT[dimension]), hvi.Pressure("inner", P)]
    found = hvi.solve(hvi.Model(body(folder, dimension, size, order), effects), degree=2)
    assert found.certificate.passed
    return lame.errors(found, (rings if dimension == 2 else shells).displacement)


def test_a_ring_under_pressure_converges_as_straight_bodies_do(tmp_path: Path) -> None:
    """With straight cells the energy's error is that of the polygon, 300 times as large, and falls as h²."""
    coarse, fine = (errors(tmp_path, 2, size, 2) for size in (1 / 4, 1 / 8))
    assert np.log2(coarse.energy / fine.energy) > 3.4
    assert np.log2(coarse.nodal / fine.nodal) > 2.4
    assert abs(fine.energy) < 1.2e-5
    assert fine.estimated == pytest.approx(fine.norm, rel=0.1)
    assert abs(errors(tmp_path, 2, 1 / 8, 1).energy) > 250 * abs(fine.energy)


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.long)])
def test_a_uniform_pressure_on_a_curved_side_is_exact_where_facets_are_even(dimension: int, tmp_path: Path) -> None:
    """A body that is heated between walls has the same pressure everywhere, and its sphere's normal at each node."""
    held = [hvi.Displacement(name, [0.0] * dimension) for name in FLAT[dimension]]
    effects = [rubber(dimension, 1e-2), *held, hvi.Contact("outer"), hvi.Contact("inner"), hvi.Temperature(1.0)]
    found = hvi.solve(hvi.Model(body(tmp_path, dimension, 0.5), effects), degree=2)
    assert found.certificate.passed
    for surface in found.problem.surfaces:
        inside = np.all(surface.points[:, :dimension] > 1e-6, axis=1)
        radial = surface.points[:, :dimension] / np.linalg.norm(surface.points[:, :dimension], axis=1, keepdims=True)
        sign = 1.0 if surface.part == "outer" else -1.0
        assert np.abs(surface.normals - sign * radial)[inside].max() < (1e-9, 0.05)[dimension - 2]
    for name in ("outer", "inner"):
        part = found.contact[name]
        inside = np.all(part.x > 1e-6, axis=1)
        assert inside.any()
        np.testing.assert_allclose(part.pressure[inside], 3 * BULK * 1e-2, rtol=(1e-10, 1.5e-2)[dimension - 2])


def test_a_force_on_a_curved_side_is_the_whole_force(tmp_path: Path) -> None:
    """It is spread over the length of the curve, not over that of the facets."""
    effects = [rubber(2), hvi.Displacement("bottom", [0.0, 0.0]), hvi.Force("outer", [3e3, 4e3])]
    found = hvi.solve(hvi.Model(body(tmp_path, 2, 0.5), effects), degree=2)
    np.testing.assert_allclose(found.resultant("outer"), [3e3, 4e3], rtol=1e-8)
    np.testing.assert_allclose(found.resultant("bottom"), [-3e3, -4e3], rtol=1e-8)


@pytest.mark.long
def test_a_hollow_ball_under_pressure(tmp_path: Path) -> None:
    curved, straight = (errors(tmp_path, 3, 0.4, order) for order in (2, 1))
    assert abs(curved.energy) < 0.1 * abs(straight.energy)
    assert curved.nodal < 0.4 * straight.nodal
    assert curved.estimated == pytest.approx(curved.norm, rel=0.3)


@pytest.mark.parametrize("given", ["ufl", "function"])
def test_loads_of_a_program_meet_curved_cells(given: str, tmp_path: Path) -> None:
    """An expression on the body's mesh, which is straight, is taken where the nodes of the curved cells are."""
    energies = []
    for kind in ("formula", given):
        made = body(tmp_path, 2, 0.5)
        x = ufl.SpatialCoordinate(made.mesh)
        load = {"formula": "1e5*(1 + x)", "ufl": 1e5 * (1 + x[0]), "function": lambda x: 1e5 * (1 + x[0])}[kind]
        effects = [rubber(2), *symmetry(FLAT[2]), hvi.Pressure("inner", load)]
        energies.append(hvi.solve(hvi.Model(made, effects), degree=2, estimate=False).energy)
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
