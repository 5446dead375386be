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

from hvi_fenicsx import InputError, Model, prepare, read_scene
from hvi_fenicsx.api import solve
from hvi_fenicsx.mesh import gmsh_file, refinement
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


def hertz(domain: str) -> Model:
    return read_scene(DEMOS / "hertz.toml", ["solver.degree=2", f"domain={domain}"])


@pytest.mark.parametrize(("order", "degree", "warned"), [(1, 2, True), (2, 2, False)])
def test_curved_sides_of_first_order_are_warned_of(order: int, degree: int, warned: bool, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "half.msh", HALF.format(order=order))
    scene = hertz(f'{{shape="file", file="{file}"}}').with_solver(degree=degree)
    found = [text for text in prepare(scene).warnings if "of a curved side" in text]
    assert [text.startswith("boundary.floor.contact") for text in found] == [True] * warned


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
