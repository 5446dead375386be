"""Mesh files of second order: their sides are the curves that gmsh had, for refined vertices and for gaps of degree 2.

A side that is read in a wrong order of nodes, or found on a wrong facet, still gives a mesh; so all is held to circles.
"""

from __future__ import annotations

from pathlib import Path

import meshes
import numpy as np
import pytest
from dolfinx import mesh as dmesh
from mpi4py import MPI
from runs import hvi, summary

from hvi_fenicsx import InputError, Model, prepare, read_scene
from hvi_fenicsx.api import solve
from hvi_fenicsx.mesh import facets as facet_sizes
from hvi_fenicsx.mesh import gmsh_file, refinement
from hvi_fenicsx.mesh.curved import CurvedFacets
from hvi_fenicsx.mesh.domain import Domain

DEMOS = Path(__file__).parents[2] / "demos"
DISK = """
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
occ.addDisk(0, 0, 0, 1, 1)
occ.synchronize()
gmsh.model.addPhysicalGroup(1, [1], name="rim")
body()
mesh.generate(2)
mesh.setOrder({order})
"""
BALL = """
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
occ.addSphere(0, 0, 0, 1)
occ.synchronize()
gmsh.model.addPhysicalGroup(2, [1], name="rim")
gmsh.model.addPhysicalGroup(3, [1], name="body")
mesh.generate(3)
mesh.setOrder({order})
"""
HALF = """
geo, r = gmsh.model.geo, 0.1
ends = [geo.addPoint(x, y, 0, size) for x, y, size in ((-r, r, 0.01), (0, 0, 5e-4), (r, r, 0.01))]
centre = geo.addPoint(0, r, 0, 0.01)
lines = [geo.addCircleArc(ends[0], centre, ends[1]), geo.addCircleArc(ends[1], centre, ends[2])]
lines.append(geo.addLine(ends[2], ends[0]))
geo.addPlaneSurface([geo.addCurveLoop(lines)])
geo.synchronize()
gmsh.model.addPhysicalGroup(1, lines[:2], name="arc")
gmsh.model.addPhysicalGroup(1, lines[2:], name="top")
body()
mesh.generate(2)
mesh.setOrder({order})
"""


def read(folder: Path, script: str, dimension: int, **values: float) -> Domain:
    file = meshes.make(folder / "round.msh", script.format(**values))
    return gmsh_file.read(MPI.COMM_WORLD, file, dimension)


def volume(domain: Domain) -> float:
    corners = refinement.cell_corners(domain.mesh)[:, :, : domain.dimension]
    edges = corners[:, 1:] - corners[:, :1]
    return float(np.abs(np.linalg.det(edges)).sum()) / (2 if domain.dimension == 2 else 6)


def off_the_rim(domain: Domain) -> float:
    """How far the vertices of the rim are from the unit circle or sphere, at most."""
    rim = dmesh.entities_to_geometry(domain.mesh, domain.dimension - 1, domain.sides["rim"])
    return float(np.abs(np.linalg.norm(domain.mesh.geometry.x[np.unique(rim)], axis=1) - 1).max())


@pytest.mark.parametrize(("script", "dimension"), [(DISK, 2), (BALL, 3)])
def test_a_side_of_second_order_is_refined_onto_its_curve(script: str, dimension: int, tmp_path: Path) -> None:
    """Of a file of first order new vertices stay on the facets, and in the plane h² is missing of the area."""
    missing, off = [], []
    for order in (2, 1):
        coarse = read(tmp_path, script, dimension, size=0.4, order=order)
        fine = refinement.uniform(coarse).domain
        assert off_the_rim(coarse) < 1e-9
        off.append(off_the_rim(fine))
        missing.append([1 - volume(domain) / (np.pi, 4 * np.pi / 3)[dimension - 2] for domain in (coarse, fine)])
    assert off[0] < 0.02 * off[1]
    assert missing[1][0] == pytest.approx(missing[1][1], rel=1e-9)
    assert missing[0][0] / missing[0][1] == pytest.approx((4.0, 3.2)[dimension - 2], rel=0.05)  # Plaza's faces


@pytest.mark.parametrize(("script", "dimension"), [(DISK, 2), (BALL, 3)])
def test_the_nearest_points_are_on_the_circle_to_high_order(script: str, dimension: int, tmp_path: Path) -> None:
    found, widths = [], []
    x = np.random.default_rng(1).normal(size=(500, dimension))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    for size in (0.4, 0.15):
        curve = read(tmp_path, script, dimension, size=size, order=2).curves["rim"]
        assert isinstance(curve, CurvedFacets)
        nearest = curve.nearest(0.99 * x)
        np.testing.assert_allclose(curve.nearest(nearest), nearest, atol=1e-12)
        found.append(np.abs(nearest - x).max())
        widths.append(np.linalg.norm(curve.points[:, 1] - curve.points[:, 0], axis=1).max())
    assert np.log(found[1] / found[0]) / np.log(widths[1] / widths[0]) > (3.8, 2.8)[dimension - 2]
    assert found[1] < 1e-3


def test_a_side_is_moved_with_its_body() -> None:
    facets = CurvedFacets(np.array([[[0.0, 0.0], [1.0, 0.0], [0.5, 0.1]]]))
    turned = facets.moved(np.array([3.0, 4.0]), np.array([[0.0, -1.0], [1.0, 0.0]]))
    found = turned.nearest(np.array([[2.8, 4.5], [3.2, 3.0]]))
    np.testing.assert_allclose(found, [[2.9, 4.5], [3.0, 4.0]], atol=1e-12)


def hertz(domain: str) -> Model:
    return read_scene(DEMOS / "hertz.toml", ["solver.degree=2", f"domain={domain}"])


@pytest.mark.parametrize(("order", "degree", "warned"), [(1, 2, True), (2, 2, False), (1, 1, False)])
def test_curved_sides_of_first_order_are_warned_of(order: int, degree: int, warned: bool, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "half.msh", HALF.format(order=order))
    scene = hertz(f'{{shape="file", file="{file}"}}').with_solver(degree=degree)
    found = [text for text in prepare(scene).warnings if "of a curved side" in text]
    assert [text.startswith("boundary.floor.contact") for text in found] == [True] * warned


@pytest.mark.parametrize("dimension", [2, 3])
def test_angles_between_facets_are_those_of_the_body(dimension: int) -> None:
    """Of a square or cube a right one at corners and edges, and none elsewhere; no vertex counts that has one facet."""
    mesh = (dmesh.create_unit_square, dmesh.create_unit_cube)[dimension - 2](MPI.COMM_SELF, *[4] * dimension)
    mesh.topology.create_connectivity(dimension - 1, dimension)
    everywhere = dmesh.exterior_facet_indices(mesh.topology)
    angles = facet_sizes.turns(mesh, everywhere)
    assert len(angles) == (16, 98)[dimension - 2]
    assert np.sum(np.isclose(angles, np.pi / 2)) == (4, 44)[dimension - 2]
    assert np.sum(angles < 1e-7) == len(angles) - (4, 44)[dimension - 2]
    floor = dmesh.locate_entities_boundary(mesh, dimension - 1, lambda x: np.isclose(x[0], 0.0))
    assert np.all(facet_sizes.turns(mesh, floor) < 1e-7)
    assert len(facet_sizes.turns(mesh, floor[:1])) == 0


@pytest.mark.long
def test_hertz_pressure_of_a_file_of_second_order_is_that_of_the_built_in_shape(tmp_path: Path) -> None:
    """Of a polygon the pressure of degree 2 shows each corner, by 5 % of the largest."""
    own = solve(read_scene(DEMOS / "hertz.toml", ["solver.degree=2"]), estimate=False).contact["floor"]
    away = []
    for order in (1, 2):
        file = meshes.make(tmp_path / f"half{order}.msh", HALF.format(order=order))
        part = solve(hertz(f'{{shape="file", file="{file}"}}'), estimate=False).contact["floor"]
        away.append(np.abs(np.interp(own.x[:, 0], part.x[:, 0], part.pressure) - own.pressure).max())
    assert away[0] > 0.03 * own.pressure.max()
    assert away[1] < 1e-5 * own.pressure.max()


@pytest.mark.long
def test_curves_of_files_are_the_same_on_ranks(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "half.msh", HALF.format(order=2))
    domain = f'{{shape="file", file="{file}", refinements=1}}'
    found = []
    for ranks in (1, 3):
        out = tmp_path / str(ranks)
        words = ("--set", f"domain={domain}", "--set", "solver.degree=2", "--out", out, "--no-pictures")
        assert hvi("run", DEMOS / "hertz.toml", *words, ranks=ranks).returncode == 0
        found.append(summary(out)["energy"])
    assert found[1] == pytest.approx(found[0], rel=1e-10)


def test_straight_sides_of_second_order_are_no_curves(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "square.msh", "square(0.3)\nmesh.generate(2)\nmesh.setOrder(2)")
    domain, plain = (
        gmsh_file.read(MPI.COMM_WORLD, f, 2)
        for f in (file, meshes.make(tmp_path / "plain.msh", "square(0.3)\nmesh.generate(2)"))
    )
    assert domain.curves == {}
    assert {name: len(f) for name, f in domain.sides.items()} == {name: len(f) for name, f in plain.sides.items()}
    assert volume(domain) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("square(0.3)\nmesh.generate(2)\nmesh.setOrder(3)", "linear triangles only, or those of order 2"),
        ("square(0.3)\nmesh.generate(2)\nmesh.recombine()\nmesh.setOrder(2)", "linear triangles only"),
        (
            "square(2.0)\nmesh.generate(2)\nmesh.setOrder(2)\nkind, tags, nodes = mesh.getElements(1)\n"
            "a, b, c = (mesh.getNode(n)[0] for n in nodes[0][:3])\nmesh.setNode(nodes[0][2], 0.1 * a + 0.9 * b, [])",
            "turns back; remesh",
        ),
    ],
)
def test_what_cannot_be_a_curve_is_refused(script: str, words: str, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "bad.msh", script)
    with pytest.raises(InputError, match=words):
        gmsh_file.read(MPI.COMM_WORLD, file, 2)
