"""Obstacles: gaps and directions against the geometry itself; contact against closed forms and against each other."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from runs import ROOT
from scenes import E, Table, model

import hvi_fenicsx as hvi
from hvi_fenicsx.effects import Contact
from hvi_fenicsx.effects.contact import Obstacle

BALL = {"shape": "sphere", "center": [0.3, -1.0, 0.2], "radius": 0.7}
TUBE = {"shape": "cylinder", "center": [0.3, -1.0, 0.2], "axis": [1.0, 2.0, -0.5], "radius": 0.7}
FLAT = {"point": [0.1, -0.2, 0.0], "normal": [0.2, 1.0, -0.3]}
MOVED = {"displacement": [0.1, -0.05, 0.2]}


def obstacle(table: Table) -> Obstacle:
    found = Contact.model_validate({"obstacle": table}).obstacle
    assert found is not None
    return found


def off_surface(table: Table, points: np.ndarray) -> np.ndarray:
    """How far points are from the surface of an obstacle, by its own equation."""
    points = points - np.array(table.get("displacement", [0.0, 0.0, 0.0]))
    if "normal" in table:
        return (points - np.array(table["point"])) @ np.array(table["normal"])
    away = points - np.array(table["center"])
    if table["shape"] == "cylinder":
        away = np.cross(away, np.array(table["axis"]) / np.linalg.norm(table["axis"]))
    return np.linalg.norm(away, axis=1) - table["radius"]


@pytest.mark.parametrize("more", [{}, MOVED, {"direction": [0.3, -2.0, 0.1]}, MOVED | {"direction": [0.3, -2.0, 0.1]}])
@pytest.mark.parametrize("table", [BALL, TUBE, FLAT, BALL | {"hollow": True}], ids=["ball", "tube", "flat", "bearing"])
def test_the_gap_leads_to_the_surface_the_shortest_way(table: Table, more: Table) -> None:
    random = np.random.default_rng(1)
    center = np.array(table.get("center", table.get("point")))
    points = center + random.normal(size=(40, 3)) * (0.1 if table.get("hollow") else 0.2)
    if not table.get("hollow"):
        points += np.array([0.0, 1.5, 0.0])
    table = {**table, **more}
    found = obstacle(table)
    gap, way = found.gap(points), found.towards(points)
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), 1.0)
    np.testing.assert_allclose(off_surface(table, points + gap[:, None] * way), 0.0, atol=1e-12)
    if "direction" not in more:
        step = 1e-6
        slope = [(found.gap(points + step * e) - found.gap(points - step * e)) / (2 * step) for e in np.eye(3)]
        np.testing.assert_allclose(np.stack(slope, axis=1), -way, atol=1e-8)


def test_a_surface_from_a_file_is_met_where_its_triangles_are(tmp_path: Path) -> None:
    """A fine STL of a ball against the ball itself, also behind its surface; beside it there is nothing."""
    file = stl_of_a_ball(tmp_path / "ball.stl", 0.7, [0.3, 0.2, -1.0])
    ball = {"center": [0.3, 0.2, -1.0], "radius": 0.7, "direction": [0, 0, -1]}
    from_file = obstacle({"shape": "surface", "file": str(file), "direction": [0, 0, -1]})
    points = np.random.default_rng(2).uniform(-0.35, 0.35, size=(60, 3)) + [0.3, 0.2, -0.2]
    exact = obstacle({"shape": "sphere", **ball}).gap(points)
    assert exact.min() < 0.0 < exact.max()
    np.testing.assert_allclose(from_file.gap(points), exact, atol=4e-3)
    assert np.isnan(from_file.gap(np.array([[2.0, 0.0, 0.0]])))[0]
    in_mm = obstacle(
        {"shape": "surface", "file": str(file), "direction": [0, 0, -1], "scale": 1e-3, "displacement": [0, 0, 1e-3]}
    )
    np.testing.assert_allclose(in_mm.gap(1e-3 * points), 1e-3 * (from_file.gap(points - [0, 0, 1.0])), atol=1e-12)


def stl_of_a_ball(file: Path, radius: float, center: list[float]) -> Path:
    from vtkmodules.vtkFiltersSources import vtkSphereSource
    from vtkmodules.vtkIOGeometry import vtkSTLWriter

    ball, writer = vtkSphereSource(), vtkSTLWriter()
    ball.SetRadius(radius)
    ball.SetCenter(*center)
    ball.SetThetaResolution(80)
    ball.SetPhiResolution(80)
    writer.SetInputConnection(ball.GetOutputPort())
    writer.SetFileName(str(file))
    writer.Write()
    return file


def solved(table: Table) -> hvi.Solution:
    found = hvi.solve(hvi.read_tables(table), estimate=False)
    assert found.converged
    return found


def disk(contact: Table) -> Table:
    """The half-disk of the demo on a coarse mesh."""
    scene = hvi.read_scene(ROOT / "demos/hertz.toml", ["domain.mesh_size=0.01", "domain.mesh_size_below=0.6e-3"])
    table: Table = scene.tables()
    table["boundary"]["floor"] |= {"contact": contact, "where": "y < 0.05"}
    return table


@pytest.mark.parametrize(
    ("contact", "radius"),
    [
        ({"obstacle": {"shape": "sphere", "center": [0.0, -0.3], "radius": 0.3}}, 0.075),
        ({"obstacle": {"shape": "sphere", "center": [0.0, 0.3], "radius": 0.3, "hollow": True}}, 0.15),
        ({"obstacle": {"shape": "sphere", "center": [0.0, -0.3], "radius": 0.3, "direction": [0, -1]}}, 0.075),
    ],
    ids=["on a cylinder", "in a bearing", "along a direction"],
)
def test_a_disk_on_a_round_obstacle_is_pressed_as_hertz_says(contact: Table, radius: float) -> None:
    """1/R is the sum of the curvatures; the peak of the pressure is sqrt(F E* / (π R))."""
    found = float(solved(disk(contact)).contact["floor"].pressure.max())
    assert found == pytest.approx(np.sqrt(4e3 * 1e7 / (1 - 0.3**2) / (np.pi * radius)), rel=0.02)


def test_a_gap_by_formula_along_a_direction_is_the_flat_obstacle() -> None:
    """Also if it is given from Python."""
    flat = solved(disk({"obstacle": {"point": [0.0, 0.0], "normal": [0.0, 1.0]}}))
    formula = solved(disk({"gap": "y", "direction": [0.0, -3.0]}))
    assert formula.energy == pytest.approx(flat.energy, rel=1e-12)


@pytest.mark.parametrize("way", ["plane", "surface"])
def test_an_obstacle_that_is_moved_compresses_a_column(way: str, tmp_path: Path) -> None:
    """σ = -E δ/h with smooth sides."""
    table: Table = {
        "domain": {"shape": "box", "size": [0.4, 0.3, 0.5], "cells": [2, 2, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": E, "poisson_ratio": 0.0},
        "boundary": {
            "base": {"on": "bottom", "displacement": [0.0, 0.0, 0.0]},
            "lid": {"on": "top", "contact": {"obstacle": {"displacement": [0.0, 0.0, -1e-4]}}},
        },
    }
    lid = table["boundary"]["lid"]["contact"]["obstacle"]
    if way == "plane":
        lid |= {"point": [0.0, 0.0, 0.5], "normal": [0.0, 0.0, -1.0]}
    else:
        lid |= {"shape": "surface", "file": str(square(tmp_path / "lid.stl", 0.5)), "direction": [0, 0, 1]}
    top = solved(table).contact["lid"]
    np.testing.assert_allclose(top.pressure, E * 1e-4 / 0.5, rtol=1e-9)


def square(file: Path, z: float) -> Path:
    """Two triangles that look down."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    text = "solid lid\n"
    for triangle in ((0, 2, 1), (0, 3, 2)):
        points = "".join(f"vertex {corners[i][0]} {corners[i][1]} {z}\n" for i in triangle)
        text += f"facet normal 0 0 -1\nouter loop\n{points}endloop\nendfacet\n"
    file.write_text(text + "endsolid lid\n")
    return file


def stl(corners: np.ndarray, count: int | None = None) -> bytes:
    """Triangles (n, 3, 3) as a binary file, which says of itself how many there are."""
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = corners
    return b"solid lies".ljust(80) + struct.pack("<I", len(corners) if count is None else count) + rows.tobytes()


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]]
APART = np.concatenate([TETRAHEDRON, TETRAHEDRON + 5.0])
FACET = "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n"


@pytest.mark.parametrize(
    "content",
    [
        *(stl(TETRAHEDRON)[:length] for length in (0, 83, 84, 184, 283)),
        *(stl(TETRAHEDRON, count) for count in (0, 2, 5, 4_000_000_000)),
        *(stl(np.where(TETRAHEDRON == 1.0, odd, TETRAHEDRON)) for odd in (np.nan, np.inf)),
        stl(0.0 * TETRAHEDRON),
        stl(APART[1:]),
        f"solid a\n{FACET}endsolid\nsolid b\n{FACET}".encode(),
        f"solid a\n{FACET[:60]}endsolid".encode(),
        f"solid a\n{FACET.replace('1 0 0', '1e999 0 0')}endsolid".encode(),
    ],
)
def test_a_surface_that_is_cut_off_or_lies_is_refused(content: bytes, tmp_path: Path) -> None:
    """VTK took what there was."""
    file = tmp_path / "die.stl"
    file.write_bytes(content)
    with pytest.raises(hvi.InputError, match=r"obstacle.*die\.stl: "):
        hvi.Contact("top", obstacle={"shape": "surface", "file": str(file), "direction": [0, 0, -1]})


def test_a_binary_surface_is_that_of_a_text(tmp_path: Path) -> None:
    """Also of two closed pieces, and of two parts of a text."""
    binary, text = tmp_path / "binary.stl", tmp_path / "text.stl"
    binary.write_bytes(stl(APART))
    corners = ["".join("vertex {} {} {}\n".format(*p) for p in triangle) for triangle in APART]
    facets = [f"facet normal 0 0 0\nouter loop\n{three}endloop\nendfacet\n" for three in corners]
    text.write_text("".join(f"solid\n{''.join(part)}endsolid\n" for part in (facets[:4], facets[4:])))
    points = np.random.default_rng(3).uniform(0.1, 0.3, (9, 3)) + [0.0, 0.0, 2.0]
    gaps = [
        obstacle({"shape": "surface", "file": str(file), "direction": [0, 0, -1]}).gap(points)
        for file in (binary, text)
        for file in (binary, text)
    ]
    np.testing.assert_allclose(gaps[0], gaps[1], atol=1e-6)
    np.testing.assert_allclose(gaps[1], points.sum(axis=1) - 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("contact", "said"),
    [
        ({"obstacle": {"shape": "ball"}}, "unknown shape"),
        ({"obstacle": {"shape": "cylinder", "center": [0, 0], "axis": [0, 1], "radius": 1.0}}, "needs 3D"),
        ({"obstacle": {"shape": "sphere", "center": [0.5, 0.0], "radius": 0.1}}, "no direction leads"),
        ({"obstacle": {"shape": "sphere", "center": [9.0, -1.0], "radius": 1.0, "direction": [0, -1]}}, "not finite"),
        ({"obstacle": {"shape": "surface", "file": "none.stl", "direction": [0, 1]}}, "does not exist"),
        ({"gap": 0.0, "direction": [0.0, 0.0]}, "direction"),
        ({"lower": 0.0, "upper": 1.0, "direction": [0.0, 1.0]}, "direction"),
    ],
)
def test_what_is_refused(contact: Table, said: str) -> None:
    table = model(4)
    table["boundary"]["floor"]["contact"] = contact
    with pytest.raises((hvi.InputError, ValueError), match=said):
        hvi.prepare(hvi.read_tables(table))
