"""Cells with curved edges at degree 2: closed forms, uniform stresses, ranks, and where they are not used.

A polygon, a node off its curve or a side that leaves its plane still converges and passes its own certificate; so all
is held to Lamé's thick walls and to uniform stresses, which curved cells represent exactly.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import basix
import meshes
import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from runs import hvi as command
from runs import summary
from scipy.spatial import KDTree

import hvi_fenicsx as hvi
from hvi_fenicsx.mesh import gmsh_file, nodes, refinement
from hvi_fenicsx.mesh.curved import mesh_of
from hvi_fenicsx.problem import spaces
from hvi_fenicsx.report.solution_arrays import SolutionArrays
from hvi_fenicsx.study.transfer import BodyTransfer

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
from rings import RING

E, NU, P = 1e7, 0.3, 1e5
BULK, SHEAR = E / (3 * (1 - 2 * NU)), E / (2 * (1 + NU))
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


def lame(dimension: int, r: np.ndarray) -> np.ndarray:
    """The radial displacement of a thick wall under pressure inside (Lamé)."""
    if dimension == 2:
        a = P / 3
        return (1 + NU) / E * ((1 - 2 * NU) * a * r + 4 * a / r)
    return P / 7 * (r / (3 * BULK) + 8 / (4 * SHEAR * r**2))


def lame_energy(dimension: int) -> float:
    surface = {2: np.pi / 2, 3: np.pi / 2}[dimension]
    return float(-0.5 * P * lame(dimension, np.array(1.0)) * surface)


def errors(folder: Path, dimension: int, size: float, order: int) -> tuple[float, float, float]:
    """Of the energy and of the nodal displacements, relative, and the estimated one in the energy norm."""
    effects = [rubber(dimension), *symmetry(FLAT[dimension]), hvi.Pressure("inner", P)]
    found = hvi.solve(hvi.Model(body(folder, dimension, size, order), effects), degree=2)
    x, u = found.u.function_space.tabulate_dof_coordinates()[:, :dimension], found.u.x.array.reshape(-1, dimension)
    r = np.linalg.norm(x, axis=1, keepdims=True)
    away = u - lame(dimension, r) * x / r
    exact = lame_energy(dimension)
    assert found.certificate.passed
    assert found.estimate is not None
    return (
        (found.energy - exact) / abs(exact),
        float(np.abs(away).max() / lame(dimension, np.array(1.0))),
        found.estimate.relative,
    )


def test_a_ring_under_pressure_converges_as_straight_bodies_do(tmp_path: Path) -> None:
    """With straight cells the energy's error is that of the polygon, 300 times as large, and falls as h²."""
    coarse, fine = (errors(tmp_path, 2, size, 2) for size in (1 / 4, 1 / 8))
    assert np.log2(coarse[0] / fine[0]) > 3.4
    assert np.log2(coarse[1] / fine[1]) > 2.4
    assert fine[0] < 1.2e-5
    assert fine[2] == pytest.approx(np.sqrt(fine[0]), rel=0.1)
    assert errors(tmp_path, 2, 1 / 8, 1)[0] > 250 * fine[0]


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.long)])
def test_a_uniform_pressure_on_a_flat_side_of_curved_cells_is_exact(dimension: int, tmp_path: Path) -> None:
    loads = [hvi.Pressure("inner", P), hvi.Pressure("outer", P)]
    effects = [rubber(dimension), *symmetry(FLAT[dimension][:-1]), hvi.Contact("bottom"), *loads]
    found = hvi.solve(hvi.Model(body(tmp_path, dimension, 0.5), effects), degree=2)
    assert found.certificate.passed
    np.testing.assert_allclose(found.contact["bottom"].pressure, P, rtol=1e-10)
    pyvista = pytest.importorskip("pyvista")
    found.write(tmp_path / "out", pictures=False)
    strain = pyvista.read(next((tmp_path / "out").glob("displacement*.vtu"))).cell_data["strain"].reshape(-1, 3, 3)
    uniform = -P / (3 * BULK) * np.eye(3) if dimension == 3 else -P * (1 + NU) * (1 - 2 * NU) / E * np.diag([1, 1, 0])
    np.testing.assert_allclose(strain, [uniform] * len(strain), atol=1e-6 * P / E)


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.long)])
def test_a_uniform_pressure_on_a_curved_side_is_exact(dimension: int, tmp_path: Path) -> None:
    """A body that is heated between walls has the same pressure everywhere, and a normal of its own at each node."""
    held = [hvi.Displacement(name, [0.0] * dimension) for name in FLAT[dimension]]
    effects = [rubber(dimension, 1e-2), *held, hvi.Contact("outer"), hvi.Contact("inner"), hvi.Temperature(1.0)]
    found = hvi.solve(hvi.Model(body(tmp_path, dimension, 0.5), effects), degree=2)
    assert found.certificate.passed
    for surface in found.problem.surfaces:
        inside = np.all(surface.points[:, :dimension] > 1e-6, axis=1)
        radial = surface.points[:, :dimension] / np.linalg.norm(surface.points[:, :dimension], axis=1, keepdims=True)
        sign = 1.0 if surface.part == "outer" else -1.0
        assert np.abs(surface.normals - sign * radial)[inside].max() < (0.02, 0.05)[dimension - 2]
    for name in ("outer", "inner"):
        part = found.contact[name]
        inside = np.all(part.x > 1e-6, axis=1)
        assert inside.any()
        np.testing.assert_allclose(part.pressure[inside], 3 * BULK * 1e-2, rtol=1e-10)


def test_a_force_on_a_curved_side_is_the_whole_force(tmp_path: Path) -> None:
    """It is spread over the length of the curve, not over that of the facets."""
    effects = [rubber(2), hvi.Displacement("bottom", [0.0, 0.0]), hvi.Force("outer", [3e3, 4e3])]
    found = hvi.solve(hvi.Model(body(tmp_path, 2, 0.5), effects), degree=2)
    np.testing.assert_allclose(found.resultant("outer"), [3e3, 4e3], rtol=1e-8)
    np.testing.assert_allclose(found.resultant("bottom"), [-3e3, -4e3], rtol=1e-8)


@pytest.mark.long
def test_a_hollow_ball_under_pressure(tmp_path: Path) -> None:
    curved, straight = (errors(tmp_path, 3, 0.4, order) for order in (2, 1))
    assert curved[0] < 0.1 * straight[0]
    assert curved[1] < 0.4 * straight[1]
    assert 0.7 < curved[2] / np.sqrt(curved[0]) < 1.3


@pytest.mark.long
def test_curved_bodies_are_the_same_on_ranks(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "shell.msh", SHELL.format(size=0.5, order=2))
    lines = [
        f'[domain]\nshape = "file"\nfile = "{file}"',
        f'[material]\nmodel = "three_dimensional"\nyoungs_modulus = {E}\npoisson_ratio = {NU}',
        '[boundary.left]\non = "left"\ndisplacement = [0.0, "free", "free"]',
        '[boundary.front]\non = "front"\ndisplacement = ["free", 0.0, "free"]',
        '[boundary.floor]\non = "bottom"\ncontact = { gap = 0.0 }',
        '[boundary.inner]\non = "inner"\npressure = 1e5',
        '[boundary.outer]\non = "outer"\npressure = "1.2e5 + 1e4*x"',
        "[solver]\ndegree = 2",
    ]
    scene = tmp_path / "shell.toml"
    scene.write_text("\n".join(lines))
    found = []
    for ranks in (1, 2, 3):
        out = tmp_path / str(ranks)
        assert command("run", scene, "--out", out, "--no-pictures", ranks=ranks).returncode == 0
        found.append(summary(out)["energy"])
    assert found[1:] == pytest.approx(found[:1] * 2, rel=1e-9)


def test_nodes_of_edges_between_two_sides_stay_on_both(tmp_path: Path) -> None:
    """Of a flat side with a round edge too, refined or not; the file has the nodes of the coarse mesh."""
    file = meshes.make(tmp_path / "shell.msh", SHELL.format(size=0.5, order=2))
    coarse = gmsh_file.read(MPI.COMM_WORLD, file, 3)
    for domain, rounding in ((coarse, 1e-12), (refinement.uniform(coarse).domain, 1e-7)):
        mesh = mesh_of(domain, 2)
        assert mesh is not domain.mesh
        space = fem.functionspace(mesh, ("Lagrange", 2))
        x = nodes.points(space)
        for axis, name in enumerate(FLAT[3]):
            on = np.unique(nodes.facet_nodes(space, domain.sides[name]))
            assert np.abs(x[on, axis]).max() < rounding


def test_only_cells_that_a_curve_would_turn_over_stay_straight_and_that_is_said(tmp_path: Path) -> None:
    """All other edges have their node where the file has it."""
    file = meshes.make(tmp_path / "shell.msh", SHELL.format(size=0.8, order=2))
    effects = [rubber(3), *symmetry(FLAT[3]), hvi.Pressure("inner", P)]
    found = hvi.check(hvi.Model(hvi.Body.file(file, dimension=3), effects), degree=2)
    (said,) = (text for text in found.warnings if "too coarse for its curve" in text)
    space, sides = found.problem.space, found.problem.domain.sides
    position = fem.Function(space)
    position.interpolate(lambda x: x)
    x, cells = spaces.values(space, position.x.array), space.dofmap.list
    ends = np.array(basix.topology(basix.CellType.tetrahedron)[1])
    plain = np.all(np.abs(x[cells[:, 4:]] - x[cells[:, ends]].mean(axis=2)) < 1e-12, axis=(1, 2))
    of_file = [line.split() for line in file.read_text().splitlines()]
    nearest = KDTree([[float(word) for word in line] for line in of_file if len(line) == 3 and '"' not in line[2]])
    on = np.unique(np.concatenate([nodes.facet_nodes(space, facets) for facets in sides.values()]))
    off = on[nearest.query(x[on])[0] > 1e-6]
    touched = np.any(np.isin(cells, off), axis=1)
    assert 0 < int(said.split(" cells would turn over")[0].split()[-1]) <= np.count_nonzero(plain & touched)
    assert set(off) <= set(cells[plain].ravel())
    assert len(off) < len(on) / 4


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


def test_an_energy_with_data_of_the_straight_mesh_keeps_its_cells_straight(tmp_path: Path) -> None:
    made = body(tmp_path, 2, 0.5)
    stiffness = fem.Function(fem.functionspace(made.mesh, ("Discontinuous Lagrange", 0)))
    stiffness.x.array[:] = E

    def energy(u: Any, v: Any) -> Any:
        return stiffness * ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx

    effects = [hvi.Energy(energy), *symmetry(FLAT[2]), hvi.Pressure("inner", P)]
    found = hvi.check(hvi.Model(made, effects), degree=2)
    assert any("data of the straight mesh" in text for text in found.warnings)


def test_fields_are_compared_at_places_of_curved_cells(tmp_path: Path) -> None:
    """Positions on a finer mesh are found again, those beyond the straight cells too."""
    file = tmp_path / "ring.geo"
    file.write_text(RING.format(size=0.5, order=2))
    domain = gmsh_file.read(MPI.COMM_WORLD, file, 2)
    found = []
    for mesh in (mesh_of(domain, 2), mesh_of(refinement.uniform(domain).domain, 2)):
        space = fem.functionspace(mesh, ("Lagrange", 2))
        x = nodes.points(space)[:, :2]
        found.append(SolutionArrays(points=x, cells=nodes.parts(space.dofmap.list.astype(np.int64)), degree=2))
    coarse, fine = found
    assert np.abs(BodyTransfer(coarse, fine)(coarse.points) - fine.points).max() < 1e-9
