"""Pictures are drawn from a folder alone, whatever is in it; and what cannot be drawn harms nobody.

Synthetic folders, written as the solver writes them, so that this fails for reasons of drawing only.
"""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
import tomli_w
from dolfinx import mesh
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from matplotlib.text import Annotation, Text
from mpi4py import MPI
from runs import hvi, write_scene
from scenes import model

from hvi_fenicsx import compat
from hvi_fenicsx.errors import HviError
from hvi_fenicsx.report import page, png_file, reader, units
from hvi_fenicsx.report.body_mesh import BodyMesh, body_mesh
from hvi_fenicsx.report.contact_part import ContactPart
from hvi_fenicsx.report.pictures import bodies, contact, draw, sides, space
from hvi_fenicsx.report.solution_arrays import FILE, SolutionArrays, load, save
from hvi_fenicsx.results import tables
from hvi_fenicsx.runtime import processes

Array = npt.NDArray[np.float64]
E, NU, LOAD = 2.15e11, 0.29, 1.0e6
LAW = {"law": "quadratic_linear", "gamma1": 1.0e3, "gamma2": 0.5e3, "delta": 9.0e-6}
HELD = {"state": "held", "direction": None}
ESCAPES = {"state": "escapes", "direction": "translation along +y"}


def square(cells: int = 16) -> mesh.Mesh:
    return mesh.create_unit_square(MPI.COMM_SELF, cells, cells)


def box() -> mesh.Mesh:
    return mesh.create_box(MPI.COMM_SELF, [[0, 0, 0], [1, 0.6, 0.4]], [6, 4, 3])


def pressed(x: Array) -> Array:
    """The closed form of the model problem without friction."""
    up = x.shape[0] - 1
    u = np.zeros_like(x)
    u[0], u[up] = LOAD * (1 + NU) / E * x[0], -LOAD * (1 + NU) / E * x[up]
    return u


def peeled(x: Array) -> Array:
    """The left half of the floor is lifted."""
    u = pressed(x)
    u[-1] += 4e-6 * np.maximum(0.5 - x[0], 0.0)
    return u


def plain(body: mesh.Mesh) -> SolutionArrays:
    """The body alone."""
    d = body.geometry.dim
    return SolutionArrays(points=body.geometry.x[:, :d].copy(), cells=compat.geometry_dofmap(body).astype(np.int64))


def facets_on(arrays: SolutionArrays, on: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """The facets all of whose vertices are chosen."""
    boundary = np.sort(body_mesh(arrays).boundary, axis=1)
    return boundary[on[boundary].all(axis=1)]


def floor(body: mesh.Mesh, value: Callable[[Array], Array]) -> ContactPart:
    """The floor under the body, as a part of Γc."""
    d, arrays, x = body.geometry.dim, plain(body), body.geometry.x
    low = np.isclose(x[:, d - 1], 0.0)
    vertices = np.flatnonzero(low)
    vertices = vertices[np.lexsort(x[vertices].T)]
    points, u = x[vertices], value(x[vertices, :d].T).T
    lifted = u[:, -1] > 1e-12
    columns = {"x": points[:, 0], "y": points[:, 1], "u_n": -u[:, -1], "u_t1": u[:, 0], "gap": u[:, -1]}
    columns |= {"sigma_n": np.where(lifted, 0.0, -LOAD), "friction_t1": 1e3 * u[:, 0] / 9e-6}
    columns |= {"contact": (~lifted).astype(float)}
    zero, drops = np.zeros(len(points)), np.tile([-LAW["delta"], LAW["delta"]], (len(points), 1))
    columns |= {"s": points[:, 0], "branch_t": zero} if d == 2 else {"z": points[:, 2], "u_t2": zero}
    columns |= {"friction_t2": zero} if d == 3 else {}
    normals = np.tile(-np.eye(d)[-1], (len(points), 1))
    facets = facets_on(arrays, low)
    return ContactPart(
        name="floor", columns=columns, vertices=vertices, facets=facets, weight=zero, normal=normals, drops=drops
    )


def change(folder: Path, **values: Any) -> None:
    """Other arrays in a result."""
    save(folder / FILE, replace(load(folder / FILE), **values))


def role(where: str, effect: str, **role: Any) -> dict[str, Any]:
    """An effect on a boundary part, as the summary has it."""
    nothing = {"traction": [], "pressure": None, "prescribed": [], "bounded": False, "obstacle": None, "laws": []}
    plain = {"place": "boundary", "drive": "resistance", "meaning": "", "label": effect}
    return {"effect": effect, "where": where, "role": plain | nothing | role}


def write_words(folder: Path, d: int, solvability: Mapping[str, object] = HELD, **summary: Any) -> None:
    loaded = {"on": "right", "traction": ["1e6*(1 - y)", *[0.0] * (d - 1)]}
    floor = {"on": "bottom", "contact": {"gap": 0.0}, "friction": LAW}
    scene = {
        "title": "A synthetic result with $ and _ in its title",
        "domain": {"shape": "rectangle" if d == 2 else "box"},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, *["free"] * (d - 1)]},
            "pull": loaded,
            "floor": floor,
        },
    }
    effects = [
        role("wall", "displacement", drive="kinematic", prescribed=[0]),
        role("pull", "traction", drive="load", traction=loaded["traction"]),
        role("floor", "contact", drive="kinematic", bounded=True),
        role(
            "floor",
            "friction",
            laws=[{"direction": "slip", "law": LAW, "multiplier": "1 + 0*x", "length_multiplier": 1.0}],
        ),
    ]
    summary = {"effects": effects} | summary
    record = {"dofs": 578, "smoothing": None, "solvability": solvability, "certificate": {"passed": True}} | summary
    (folder / "scene.toml").write_text(tomli_w.dumps(scene), encoding="utf-8")
    (folder / "summary.json").write_text(json.dumps(record), encoding="utf-8")


def result(folder: Path, body: mesh.Mesh, value: Callable[[Array], Array], **summary: Any) -> Path:
    folder.mkdir(exist_ok=True)
    arrays = plain(body)
    save(folder / FILE, replace(arrays, displacement=value(arrays.points.T).T, parts={"floor": floor(body, value)}))
    write_words(folder, body.geometry.dim, **summary)
    return folder


def escaping(folder: Path, body: mesh.Mesh, value: Callable[[Array], Array]) -> Path:
    folder.mkdir(exist_ok=True)
    arrays = plain(body)
    save(folder / FILE, replace(arrays, escape_mode=value(arrays.points.T).T))
    write_words(folder, body.geometry.dim, ESCAPES, certificate=None)
    return folder


def assert_drawn(paths: list[Path], *names: str) -> None:
    """PNGs of these names, as wide as stated, with something on them, and no half-written one beside them."""
    from matplotlib.image import imread

    assert sorted(p.name for p in paths) == sorted(names)
    for path in paths:
        image = imread(path)
        assert image.shape[1] == 1200
        assert 500 <= image.shape[0] <= 2000
        assert image[..., :3].std() > 0.05
        assert not list(path.parent.glob(f".*{draw.UNFINISHED}"))


@pytest.fixture
def left_running(monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[str]]:
    """The processes that this test started and that still run: they carry its mark in their environment."""
    mark = uuid.uuid4().hex
    monkeypatch.setenv("HVI_TEST_MARK", mark)

    def found() -> list[str]:
        names = []
        for process in Path("/proc").glob("[0-9]*"):
            try:
                if mark.encode() in (process / "environ").read_bytes():
                    names.append((process / "comm").read_text().strip())
            except OSError:
                continue
        return names

    return found


SMOOTHED = {"smoothing": "paper", "certificate": None}


@pytest.mark.parametrize(
    ("value", "summary"),
    [(pressed, {}), (peeled, {}), (np.zeros_like, {}), (peeled, SMOOTHED)],
    ids=["pressed", "peeled", "still", "peeled-smoothed"],
)
def test_a_plane_result_has_its_body_and_its_contact(
    tmp_path: Path, value: Callable[[Array], Array], summary: dict[str, Any]
) -> None:
    folder = result(tmp_path / "r", square(), value, **summary)
    assert_drawn(draw.draw(folder), "body.png", "contact.png")


def test_a_side_of_one_edge_has_a_pressure_that_is_drawn(tmp_path: Path) -> None:
    assert bodies.body(reader.read(result(tmp_path / "r", square(1), pressed))).axes


@pytest.mark.parametrize("value", [pressed, peeled], ids=lambda f: f.__name__)
def test_so_has_a_result_in_space_and_no_x_server_remains(
    tmp_path: Path, value: Callable[[Array], Array], left_running: Callable[[], list[str]]
) -> None:
    assert_drawn(draw.draw(result(tmp_path / "r", box(), value)), "body.png", "contact.png")
    assert left_running() == []


@pytest.mark.parametrize(
    "value",
    [lambda x: np.stack([0 * x[0], *[1 + 0 * c for c in x[1:]]]), lambda x: np.stack([-x[1], x[0] - 1, *(0 * x[2:])])],
    ids=["translation", "rotation"],
)
@pytest.mark.parametrize("body", [square, box], ids=["plane", "space"])
def test_an_escape_is_drawn_as_a_motion(
    tmp_path: Path, body: Callable[[], mesh.Mesh], value: Callable[[Array], Array]
) -> None:
    assert_drawn(draw.draw(escaping(tmp_path / "r", body(), value)), "escape.png")


def write_sides(folder: Path, body: mesh.Mesh, **on: Callable[[Array], npt.NDArray[np.bool_]]) -> None:
    x = body.geometry.x
    change(folder, sides={name: facets_on(plain(body), where(x.T)) for name, where in on.items()})


def test_a_body_on_its_way_off_is_not_drawn(tmp_path: Path) -> None:
    """A displacement of a hundred times its size is no state that was borne; certified it is one."""
    folder = result(tmp_path / "r", square(), pressed)
    write_sides(folder, square(), **ON)
    change(folder, displacement=load(folder / FILE).displacement + 100.0)
    assert {"body.png", "contact.png"} <= {path.name for path in draw.draw(folder)}
    write_words(folder, 2, {"state": "metastable", "direction": None}, certificate={"passed": False})
    assert [path.name for path in draw.draw(folder)] == ["scene.png"]


ON = {"wall": lambda x: x[0] == 0, "pull": lambda x: x[0] == 1}


@pytest.mark.parametrize("body", [square, box], ids=["plane", "space"])
def test_the_scene_is_drawn_where_the_folder_tells_its_sides(tmp_path: Path, body: Callable[[], mesh.Mesh]) -> None:
    folder = result(tmp_path / "r", body(), pressed)
    write_sides(folder, body(), **ON)
    assert_drawn(draw.draw(folder), "body.png", "scene.png", "contact.png")
    found = reader.read(folder)
    drawn = found.body
    (support,), (load,) = sides.held_sides(found), sides.loaded_sides(found)
    assert support.rolling
    assert support.side.normals == pytest.approx(np.broadcast_to([-1.0, 0.0, 0.0], support.side.normals.shape))
    x, y, _ = drawn.points[load.side.vertices].T
    assert x == pytest.approx(np.ones(len(x)), abs=1e-12)
    assert load.traction == pytest.approx(np.stack([1e6 * (1 - y), 0 * y, 0 * y], axis=1))


def test_a_slanted_side_is_held_along_its_own_normal(tmp_path: Path) -> None:
    """The square turned by 30 degrees: what mesh files have, and no axis tells."""
    turn = np.array([[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]])
    body = square(4)
    upright = body.geometry.x.copy()
    body.geometry.x[:, :2] = upright[:, :2] @ turn.T
    folder = result(tmp_path / "r", body, np.zeros_like)
    change(folder, parts={})
    write_sides(folder, body, wall=lambda _: upright[:, 0] == 0)
    (support,) = sides.held_sides(reader.read(folder))
    assert support.side.normals[:, :2] == pytest.approx(np.broadcast_to(-turn[:, 0], (5, 2)))
    assert len(support.side.facets) == 4


def test_each_part_has_its_picture_and_a_scene_without_contact_has_its_body(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(), peeled)
    change(folder, parts={"a.b": floor(square(), peeled), "floor": floor(square(), pressed)})
    assert_drawn(draw.draw(folder), "body.png", "contact_a.b.png", "contact_floor.png")
    bare = result(tmp_path / "bare", square(), pressed)
    change(bare, parts={})
    assert_drawn(draw.draw(bare), "body.png")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda f: (f / "summary.json").unlink(), "summary.json: No such file"),
        (lambda f: (f / "summary.json").write_text("{"), "summary.json: damaged"),
        (lambda f: (f / FILE).unlink(), "solution.npz: there is no such file"),
        (lambda f: (f / FILE).write_text("<x/>"), "solution.npz: damaged"),
        (lambda f: (f / FILE).write_bytes((f / FILE).read_bytes()[:-40]), "solution.npz: damaged"),
        (lambda f: np.savez(f / FILE, points=np.zeros((3, 2))), "solution.npz: damaged"),
        (lambda f: change(f, parts={"floor": floor(box(), pressed)}), "do not belong together"),
        (lambda f: change(f, displacement=np.zeros((3, 2))), "do not belong together"),
        (lambda f: change(f, displacement=None, parts={}), "nothing to draw"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(tmp_path: Path, damage: Callable[[Path], object], words: str) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    damage(folder)
    with pytest.raises(HviError, match=words) as caught:
        draw.draw(folder)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)


def test_one_picture_that_fails_takes_no_other_with_it(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    change(folder, points=np.full((25, 2), np.inf))
    with pytest.raises(HviError, match=r"body\.png"):
        draw.draw(folder)
    assert (folder / "contact.png").exists()
    assert not (folder / "body.png").exists()


@pytest.mark.parametrize("processors", [1, 8])
def test_a_process_that_dies_takes_the_picture_with_it_that_it_was_drawing(tmp_path: Path, processors: int) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    write_sides(folder, square(4), **ON)
    code = (
        "import os, signal, sys; from pathlib import Path; from hvi_fenicsx.report import reader\n"
        "from hvi_fenicsx.report.pictures import __main__, drawings\n"
        "found = list(drawings.drawings(reader.read(Path(sys.argv[1]))))\n"
        "first = drawings.Drawing(found[0].path, '', lambda: os.kill(os.getpid(), signal.SIGKILL))\n"
        "drawings.drawings = lambda result: [first, *found[1:]]\n"
        "os.cpu_count = lambda: int(sys.argv[2])\n"
        "print(*__main__.draw_all(Path(sys.argv[1])))\n"
    )
    command = [*processes.PYTHON, "-c", code, str(folder), str(processors)]
    done = subprocess.run(command, env=processes.environment(), capture_output=True, text=True, check=True)
    drawn, failure = {"scene.png", "contact.png"}, "body.png: the drawing process ended with SIGKILL"
    assert drawn < set(done.stdout.splitlines())
    assert failure in done.stdout
    assert {path.name for path in folder.glob("*.png")} == drawn


def test_a_library_that_aborts_is_an_error_like_any_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As VTK does, where it believes in a display that is not there."""
    monkeypatch.setenv("DISPLAY", ":99999")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    folder = result(tmp_path / "r", box(), pressed)
    failure = "body.png: none, this VTK needs no display"
    try:
        draw.draw(folder)
    except HviError as error:
        failure = str(error)
    assert failure.startswith("body.png: ")
    assert "display" in failure
    assert (folder / "contact.png").exists()
    assert (folder / "body.png").exists() == ("none" in failure)


def test_a_child_that_takes_too_long_is_ended_with_its_server(
    tmp_path: Path, left_running: Callable[[], list[str]]
) -> None:
    folder = result(tmp_path / "r", box(), pressed)
    with pytest.raises(HviError, match="not drawn within"):
        draw.draw(folder, timeout=0.8)
    deadline = time.monotonic() + 5.0
    while left_running() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert left_running() == []
    assert not list(folder.glob(f".*{draw.UNFINISHED}"))


def test_the_process_draws_when_told_and_not_before(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    record = (folder / "summary.json").read_text(encoding="utf-8")
    (folder / "summary.json").unlink()  # the folder is being written when the process starts
    with draw.waiting(folder) as process:
        (folder / "summary.json").write_text(record, encoding="utf-8")
        process.begin()
        assert_drawn(process.finish(60.0), "body.png", "contact.png")


def test_a_process_that_is_never_told_draws_nothing_and_is_gone(
    tmp_path: Path, left_running: Callable[[], list[str]]
) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    with draw.waiting(folder) as process:
        process.line.close()  # as where the caller is killed
        assert process.child.wait(60.0) == 1
    assert not list(folder.glob("*.png"))
    assert left_running() == []


def test_a_process_that_ends_before_it_is_told_costs_one_line(tmp_path: Path) -> None:
    """In a program with PETSc's signal handlers, which end it where a pipe breaks."""
    folder = result(tmp_path / "r", square(4), pressed)
    code = (
        "import sys; from pathlib import Path; from petsc4py import PETSc; "
        "from hvi_fenicsx.report.errors import PictureError; from hvi_fenicsx.report.pictures import draw\n"
        "with draw.waiting(Path(sys.argv[1])) as process:\n"
        "    process.child.kill(); process.child.wait(10.0); process.begin()\n"
        "    try: process.finish(60.0)\n"
        "    except PictureError as error: print(error)\n"
    )
    command = [*processes.PYTHON, "-c", code, str(folder)]
    done = subprocess.run(command, env=processes.environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "the drawing process ended with -9")


def test_the_child_is_no_rank_and_the_package_loads_no_plotting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    monkeypatch.setenv("PMIX_RANK", "1")
    assert_drawn(draw.draw(result(tmp_path / "r", square(4), pressed)), "body.png", "contact.png")
    code = (
        "import sys, hvi_fenicsx.report.pictures.draw; "
        "print([m for m in ('pyvista', 'matplotlib', 'mpi4py') if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert told.stdout.strip() == "[]"


def test_a_package_that_is_not_there_is_named(tmp_path: Path) -> None:
    result(tmp_path / "r", box(), pressed)
    code = (
        "import sys; sys.modules['pyvista'] = None; from hvi_fenicsx.report.pictures.__main__ import main; main(['r'])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert "needs the package pyvista, which is not installed here" in told.stderr


@pytest.mark.long
def test_the_pieces_of_several_ranks_are_one_body(tmp_path: Path) -> None:
    """The model problem without friction, whose displacement is known."""
    scene = write_scene(tmp_path / "s.toml", model(8))
    for ranks in (1, 3):
        words = ("--out", tmp_path / str(ranks), "--no-pictures", "--no-report")
        assert hvi("run", scene, *words, ranks=ranks).returncode == 0
        assert not [*(tmp_path / str(ranks)).glob("*.html"), *(tmp_path / str(ranks)).glob("*.png")]
    one, three = (reader.read(tmp_path / str(ranks)) for ranks in (1, 3))
    body = three.body
    assert body.points.shape == (81, 3)
    assert body.cells.shape == (128, 3)
    assert body.displacement is not None
    np.testing.assert_allclose(body.displacement[:, :2].T, pressed(body.points[:, :2].T), rtol=1e-6, atol=1e-15)
    a, b = (body.points[body.boundary[:, i]] for i in (0, 1))
    assert len(body.boundary) == 32
    assert np.isclose(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2, 1.0)  # the body is on the left of its edges
    assert set(three.sides) == set(one.sides)
    for name, facets in three.sides.items():
        assert corners(body, facets) == corners(one.body, one.sides[name])
    for part, like in zip(three.parts, one.parts, strict=True):
        assert corners(body, part.facets) == corners(one.body, like.facets)
        np.testing.assert_array_equal(part.points, body.points[part.vertices])
        np.testing.assert_array_equal(part.points, like.points)


def corners(body: BodyMesh, facets: npt.NDArray[np.int64]) -> set[frozenset[tuple[float, ...]]]:
    """Facets by where their vertices are."""
    return {frozenset(tuple(np.round(point, 9)) for point in body.points[facet]) for facet in facets}


def test_a_result_that_is_written_is_read_as_it_was(tmp_path: Path) -> None:
    written = replace(plain(square(2)), displacement=np.ones((9, 2)), von_mises=np.ones(8, dtype=np.float32))
    odd_name = "a:b/“c” .. facets"
    written = replace(written, sides={odd_name: np.array([[0, 1]])}, parts={odd_name: floor(square(2), peeled)})
    save(tmp_path / FILE, written)
    found = load(tmp_path / FILE)
    assert found.escape_mode is None
    for key in ("points", "cells", "displacement", "von_mises"):
        np.testing.assert_array_equal(getattr(found, key), getattr(written, key))
    np.testing.assert_array_equal(found.sides[odd_name], written.sides[odd_name])
    part, like = found.parts[odd_name], written.parts[odd_name]
    assert part.columns.keys() == like.columns.keys()
    for key in ("vertices", "facets", "weight", "normal", "drops"):
        np.testing.assert_array_equal(getattr(part, key), getattr(like, key))
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_a_picture_carries_its_caption(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    change(folder, parts={"a": floor(square(4), peeled), "“b”": floor(square(4), pressed)})
    captions = {path.name: png_file.caption(path.read_bytes()) for path in draw.draw(folder)}
    assert captions["body.png"] == "The deformed body, its displacements magnified, with what acts on it."
    assert captions["contact_“b”.png"] == "Along ““b””: displacement, friction and pressure."


def test_the_surface_of_a_body_in_space_looks_outwards() -> None:
    body = body_mesh(plain(box()))
    a, b, c = (body.points[body.boundary[:, i]] for i in range(3))
    assert np.isclose(np.einsum("ki,ki->", a, np.cross(b, c)) / 6, 0.24)


@pytest.mark.parametrize(("body", "size"), [(square, 1.0), (box, 0.24)], ids=["plane", "space"])
def test_the_cells_fill_the_body(body: Callable[[], mesh.Mesh], size: float) -> None:
    found = body_mesh(plain(body())).volumes
    assert found.min() > 0
    assert found.sum() == pytest.approx(size)


@pytest.mark.parametrize("body", [square, box], ids=["plane", "space"])
def test_pieces_are_told_apart_whatever_their_holes(body: Callable[[], mesh.Mesh]) -> None:
    """A hole inside is a second surface of one piece; without its middle third a body is two pieces."""
    whole = body_mesh(plain(body()))
    lengths = np.where(whole.extents > 0.0, whole.extents, 1.0)
    off = np.abs(whole.points[whole.cells].mean(axis=1) / lengths - 0.5)
    hollow = replace(whole, cells=whole.cells[off[:, : whole.dimension].max(axis=1) > 0.2])
    halves = replace(whole, cells=whole.cells[off[:, 0] > 0.2])
    assert [len(np.unique(found.pieces)) for found in (whole, hollow, halves)] == [1, 1, 2]
    assert len(hollow.boundary) > len(whole.boundary)


def test_the_extremes_that_pictures_name_are_those_of_all_cells(tmp_path: Path) -> None:
    """Thousands of cells share a pixel at a corner; one of them has the largest stress, one vertex the way farthest."""
    body = square(60)
    body.geometry.x[:, :2] **= 4
    folder = result(tmp_path / "r", body, pressed)
    arrays = load(folder / FILE)
    assert arrays.displacement is not None
    sizes = body_mesh(arrays).volumes
    stress, moved = np.full(len(arrays.cells), 1e6, dtype=np.float32), arrays.displacement.copy()
    stress[np.argmin(sizes)] = 7e6
    moved[arrays.cells[np.argmin(sizes), 0]] = [0.0, 3.3e-5]
    change(folder, displacement=moved, von_mises=stress)
    found = reader.read(folder)
    for make, words in (
        (bodies.stress, "von Mises stress, peak 7 MPa"),
        (bodies.body, "displacement |u|, up to 33 µm"),
    ):
        assert words in [text.get_text().replace("\u202f", " ") for text in make(found).findobj(Text)]


def test_numbers_are_said_as_people_say_them() -> None:
    said = {units.quantity(value, unit).replace("\N{NARROW NO-BREAK SPACE}", " ") for value, unit in SAID}
    assert said == {"1 MPa", "999 kPa", "9 µm", "126 nm", "1.5 m", "2.5 km", "−3 MPa", "0 Pa"}
    assert [units.round_below(v) for v in (1.0, 1.99, 4.9, 5.0, 23456.0, 0.3)] == [1.0, 1.0, 2.0, 5.0, 20000.0, 0.2]


SAID = [(1e6, "Pa"), (0.999e6, "Pa"), (9e-6, "m"), (1.26e-7, "m"), (1.5, "m"), (2500.0, "m"), (-3e6, "Pa"), (0.0, "Pa")]


def test_where_no_prefix_suits_a_power_of_ten_is_said() -> None:
    said = [units.quantity(value, unit) for value, unit in ((1e-9, "Pa"), (8.49e-21, "m"), (2.5e24, "Pa"))]
    assert said == ["1 × 10⁻⁹ Pa", "8.49 × 10⁻²¹ m", "2.5 × 10²⁴ Pa"]
    assert units.quantity(0.89, "Pa").replace("\N{NARROW NO-BREAK SPACE}", " ") == "0.89 Pa"
    assert [units.times(f) for f in (1e19, 5e9, 100.0)] == [
        "displacements × 10¹⁹",
        "displacements × 5 × 10⁹",
        "displacements × 100",
    ]


def test_a_column_that_is_not_there_is_nothing_and_not_zero(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(4), peeled)
    part = reader.read(folder).parts[0]
    assert not part.has("u_t2")
    assert part.has("gap")
    assert np.count_nonzero(part.lifted) == 2


def paper_figures(out: Path, ranks: int) -> tuple[list[Path], list[str]]:
    """Run the demo; its pictures, and the norms that it prints."""
    script = [sys.executable, "-m", "mpi4py", "demos/paper_figures.py", "--out", str(out)]
    parallel = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    root = Path(__file__).parents[2]
    told = subprocess.run([*parallel, *script], cwd=root, capture_output=True, text=True, check=True, timeout=300)
    return sorted(out.iterdir()), [line for line in told.stdout.splitlines() if line.startswith("norm")]


@pytest.mark.long
def test_the_papers_figures_are_drawn_and_their_captions_tell_what_epsilon_does(tmp_path: Path) -> None:
    found, norms = paper_figures(tmp_path / "p", 1)
    assert_drawn(found, "figure_3a.png", "figure_3b.png", "figure_4.png", "figure_5.png")
    assert len(norms) == 2


@pytest.mark.long
def test_the_papers_figures_are_the_same_on_two_ranks(tmp_path: Path) -> None:
    assert paper_figures(tmp_path / "p", 2)[1] == paper_figures(tmp_path / "q", 1)[1]


def without_vtk(monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK draws nothing, for which it would need a display."""
    monkeypatch.setattr(space.pyvista.Plotter, "screenshot", lambda *_, **__: np.zeros((4, 4, 4), dtype=np.uint8))
    monkeypatch.setattr(space.pyvista.Plotter, "get_image_depth", lambda *_, **__: np.full((4, 4), np.nan))


def said_of_lifting(figure: Figure) -> set[str]:
    """The sizes of gaps that a picture states."""
    texts = [text.get_text().replace("\n", " ") for text in figure.findobj(Text)]
    return {found[1] for text in texts if (found := re.search(r"lifted,? up to ([-\d.e]+\s\w+)", text))}


@pytest.mark.parametrize("body", [square, box], ids=["plane", "space"])
def test_the_pictures_of_body_and_contact_state_one_gap(
    tmp_path: Path, body: Callable[[], mesh.Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The largest of a lifted vertex, also where that one still adheres; rounding in contact is no gap."""
    folder = result(tmp_path / "r", body(), peeled)
    part = load(folder / FILE).parts["floor"]
    gap, lifted = part.columns["gap"].copy(), part.columns["contact"] == 0.0
    gap[~lifted] = 15.8e-12
    sigma = part.columns["sigma_n"].copy()
    farthest = np.flatnonzero(gap == gap.max())
    sigma[farthest] = LOAD
    change(folder, parts={"floor": replace(part, columns={**part.columns, "gap": gap, "sigma_n": sigma})})
    found = reader.read(folder)
    without_vtk(monkeypatch)
    drawn = [bodies.body(found), contact.contact(found, found.parts[0])]
    assert [said_of_lifting(figure) for figure in drawn] == 2 * [{units.quantity(float(gap.max()), "m")}]
    assert float(gap.max()) == pytest.approx(2e-6, rel=1e-2)


def test_pieces_are_counted_alike_in_the_table_and_on_the_page(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(4), peeled)
    part = load(folder / FILE).parts["floor"]
    part = replace(part, columns={**part.columns, "branch_t": np.array([0.0, 2.0, 2.0, -1.0, 0.0])})
    change(folder, parts={"floor": part})
    tables.write(tmp_path / "contact.csv", tables.CONTACT, tables.contact_rows({"floor": part}))
    with (tmp_path / "contact.csv").open(encoding="utf-8") as stream:
        table = Counter(int(row["branch_t"]) for row in csv.DictReader(stream))
    assert table == {0: 2, 2: 2, -1: 1}
    told = dict(page.contact_rows(reader.read(folder).parts[0]))["pieces of the friction law in use, from 0"]
    wanted = {f"{n} on piece {piece}" if piece >= 0 else f"{n} on a kink" for piece, n in table.items()}
    assert set(told.split(", ")) == wanted


def test_what_is_lifted_is_said_where_no_curve_is(tmp_path: Path) -> None:
    """A stretch of two vertices at the end, whose bond pulls hardest there."""
    folder = result(tmp_path / "r", square(), peeled)
    part = load(folder / FILE).parts["floor"]
    lifted = part.columns["x"] < 0.1
    columns = {**part.columns, "contact": np.where(lifted, 0.0, 1.0)}
    columns["sigma_n"] = np.where(lifted, 3 * LOAD, -LOAD)
    change(folder, parts={"floor": replace(part, columns=columns)})
    found = reader.read(folder)
    fig = contact.contact(found, found.parts[0])
    fig.canvas.draw()
    said = [text for text in fig.findobj(Text) if "lifted" in text.get_text()]
    assert len(said) == 1
    box = said[0].get_window_extent()
    assert 0.0 <= box.x0 <= box.x1 <= fig.bbox.width
    others = [text for text in fig.findobj(Text) if text.get_text() and text is not said[0]]
    assert not any(box.overlaps(other.get_window_extent()) for other in [*fig.axes, *others])


def test_a_slip_that_is_rounding_beside_the_body_is_drawn_as_zero(tmp_path: Path) -> None:
    """As on a joint that is tied, in a body that moves."""
    folder = result(tmp_path / "r", square(), pressed)
    part = load(folder / FILE).parts["floor"]
    noise = 1e-22 * (-1.0) ** np.arange(len(part.vertices))
    change(
        folder,
        parts={"floor": replace(part, columns={**part.columns, "u_t1": noise, "u_n": 0 * noise, "gap": 0 * noise})},
    )
    found = reader.read(folder)
    axes = contact.contact(found, found.parts[0]).axes[-1]
    assert axes.get_title(loc="left").startswith("slip")
    assert not np.any(axes.get_lines()[0].get_ydata())


@pytest.mark.parametrize("body", [square, box], ids=["plane", "space"])
def test_the_value_of_a_load_stands_in_the_picture_and_below_its_heading(
    tmp_path: Path, body: Callable[[], mesh.Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loads on the top and on the right, of a body as wide as the picture."""
    without_vtk(monkeypatch)
    folder, d = result(tmp_path / "r", body(), pressed), body().geometry.dim
    loads = {"right": [1e6, *[0.0] * (d - 1)], "top": [*[0.0] * (d - 1), -1.234e8]}
    write_words(folder, d, effects=[role(name, "traction", traction=values) for name, values in loads.items()])
    high = body().geometry.x[:, d - 1].max()
    write_sides(folder, body(), right=lambda x: x[0] == 1, top=lambda x: x[d - 1] == high)
    found = reader.read(folder)
    for fig in (bodies.scene(found), bodies.body(found)):
        fig.canvas.draw()
        values = [text for text in fig.findobj(Text) if text.get_text().endswith("Pa") and text in fig.axes[0].texts]
        assert len(values) == 2
        for box in (value.get_window_extent() for value in values):
            assert 0.0 <= box.x0 <= box.x1 <= fig.bbox.width
            assert not any(box.overlaps(text.get_window_extent()) for text in fig.texts)


def test_the_legend_says_once_what_is_largest_on_all_parts(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(), peeled)
    small = floor(square(), peeled)
    small = replace(small, columns={**small.columns, "sigma_n": 0.5 * small.columns["sigma_n"]})
    change(folder, parts={"a": small, "b": floor(square(), peeled)})
    fig = bodies.body(reader.read(folder))
    words = [text.get_text().replace("\N{NARROW NO-BREAK SPACE}", " ") for text in fig.legends[0].get_texts()]
    assert [line for line in words if "pressure" in line or "lifted" in line] == [
        "lifted, up to 2 µm",
        "contact pressure, up to 1 MPa",
    ]


def test_a_load_on_short_stretches_has_arrows_on_each_and_its_value_beside_one(tmp_path: Path) -> None:
    """Stretches of one edge each, between the places of arrows that are spread over the whole side."""
    folder = result(tmp_path / "r", square(), pressed)
    change(folder, parts={})
    load = "(-1e6 if x > 0.3 else 0) if x < 0.45 else (-1e6 if x > 0.8 else 0)"
    write_words(folder, 2, effects=[role("top", "traction", traction=[0.0, load])])
    write_sides(folder, square(), top=lambda x: x[1] == 1)
    fig = bodies.scene(reader.read(folder))
    (arrows,) = fig.axes[0].findobj(Quiver)
    feet = np.asarray(arrows.get_offsets())[:, 0]
    assert set(np.digitize(feet, [0.3, 0.45, 0.8])) == {1, 3}
    assert np.min(np.diff(np.sort(feet))) > 0.02
    (value,) = [text for text in fig.axes[0].texts if text.get_text().endswith("Pa")]
    assert isinstance(value, Annotation)
    assert 0.3 < value.xy[0] < 0.45 or 0.8 < value.xy[0] <= 1.0


def test_the_bars_of_a_body_that_nothing_moves_say_nothing_but_zero(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", box(), np.zeros_like)
    part = load(folder / FILE).parts["floor"]
    change(folder, parts={"floor": replace(part, columns={**part.columns, "sigma_n": 0.0 * part.columns["x"]})})
    found = reader.read(folder)
    fig = contact.contact(found, found.parts[0])
    fig.canvas.draw()
    bars = [axes for axes in fig.axes if not axes.get_xlabel() and axes.get_position().width < 0.05]
    assert {float(tick) for axes in bars for tick in axes.get_yticks()} == {0.0}


def test_the_axes_of_a_map_are_in_a_unit_that_suits_and_inside_of_the_picture(tmp_path: Path) -> None:
    """A part of some millimetres on both sides of the origin."""
    small = box()
    small.geometry.x[:] = 0.02 * small.geometry.x - [0.01, 0.006, 0.0]
    folder = result(tmp_path / "r", small, pressed)
    found = reader.read(folder)
    fig = contact.contact(found, found.parts[0])
    fig.canvas.draw()
    named = [label for axes in fig.axes for label in (axes.xaxis.label, axes.yaxis.label) if label.get_text()]
    assert {label.get_text() for label in named} == {"x in mm", "y in mm"}
    assert min(label.get_window_extent().x0 for label in named) >= 0.0


def test_the_numbers_of_a_narrow_map_stand_apart_and_its_arrows_are_as_wide_as_those_of_a_wide_one(
    tmp_path: Path,
) -> None:
    """A part that is six times as long across as along, far from the origin."""
    narrow = box()
    narrow.geometry.x[:] = narrow.geometry.x * [0.1, 1.0, 1.0] + [500.0, 0.0, 0.0]
    found = reader.read(result(tmp_path / "r", narrow, pressed))
    fig = contact.contact(found, found.parts[0])
    fig.canvas.draw()
    last = next(axes for axes in fig.axes if axes.get_xlabel())
    said = [text.get_window_extent() for text in last.get_xticklabels() if text.get_text()]
    assert said
    assert not any(one.overlaps(other) for one, other in pairwise(said))
    assert {arrows.units for arrows in fig.findobj(Quiver)} == {"inches"}


@pytest.mark.parametrize("height", [1.0, 0.03])
def test_names_of_parts_cover_nothing_and_stay_in_the_picture(tmp_path: Path, height: float) -> None:
    """Of a square and of a thin strip, whose ends are shorter than their names."""
    body = square()
    body.geometry.x[:, 1] *= height
    folder = result(tmp_path / "r", body, np.zeros_like)
    change(folder, parts={})
    names = ("the_left_end_of_it", "the_right_end_of_it", "the_underside", "what_is_above", "another_above")
    load = role(names[0], "traction", traction=[1e6, 0.0])
    write_words(folder, 2, effects=[load, role(names[1], "displacement", prescribed=[0])])
    sides: list[Callable[[Array], npt.NDArray[np.bool_]]] = [
        lambda x: x[0] == 0,
        lambda x: x[0] == 1,
        lambda x: x[1] == 0,
        lambda x: (x[1] == height) & (x[0] <= 0.5),
        lambda x: (x[1] == height) & (x[0] >= 0.5),
    ]
    write_sides(folder, body, **dict(zip(names, sides, strict=True)))
    fig = bodies.scene(reader.read(folder))
    fig.canvas.draw()
    said = fig.axes[0].texts
    assert {text.get_text() for text in said} >= set(names)
    boxes = [Text.get_window_extent(text) for text in said]
    for i, box in enumerate(boxes):
        assert 0.0 <= box.x0 <= box.x1 <= fig.bbox.width
        assert not any(box.overlaps(other) for other in boxes[i + 1 :])
        assert not any(box.overlaps(text.get_window_extent()) for text in fig.texts)
    corners = fig.axes[0].transData.transform([[0.0, 0.0], [1.0, 0.0], [1.0, height], [0.0, height]])
    named = [shapely.box(*box.extents) for box, text in zip(boxes, said, strict=True) if text.get_text() in names]
    assert not np.any(shapely.intersects(named, shapely.LinearRing(corners)))


def test_an_escaping_strip_is_drawn_as_high_as_its_scene_is(tmp_path: Path) -> None:
    body = square()
    body.geometry.x[:, 1] *= 0.005
    fig = bodies.escape(reader.read(escaping(tmp_path / "r", body, lambda x: np.stack([0 * x[0], 1 + 0 * x[1]]))))
    at_rest, ghost = (patch.get_path().get_extents() for patch in fig.axes[0].patches[:2])
    assert [at_rest.height, ghost.height] == pytest.approx([0.05, 0.05])
    assert ghost.y0 == pytest.approx(0.3)
    assert "the body at rest, height × 10" in [text.get_text() for text in fig.legends[0].get_texts()]


def test_a_pressure_that_is_rounding_is_not_drawn(tmp_path: Path) -> None:
    """On a part that has lifted off, beside the stress in the body."""
    folder = result(tmp_path / "r", square(), pressed)
    part = load(folder / FILE).parts["floor"]
    noise = {"sigma_n": 1e-8 * (-1.0) ** np.arange(len(part.vertices))}
    stress = np.full(len(load(folder / FILE).cells), LOAD, dtype=np.float32)
    change(folder, parts={"floor": replace(part, columns=part.columns | noise)}, von_mises=stress)
    found = reader.read(folder)
    words = [text.get_text() for text in bodies.body(found).legends[0].get_texts()]
    assert not [line for line in words if "pressure" in line or "tension" in line]
    assert dict(page.contact_rows(found.parts[0]))["largest pressure"].startswith("0")


@pytest.mark.parametrize("along", [True, False])
def test_arrows_of_a_load_along_its_side_are_beside_it_and_apart(tmp_path: Path, along: bool) -> None:
    folder = result(tmp_path / "r", square(), pressed)
    change(folder, parts={})
    write_words(folder, 2, effects=[role("top", "traction", traction=[1e6, 0.0 if along else -1e6])])
    write_sides(folder, square(), top=lambda x: x[1] == 1)
    (arrows,) = bodies.scene(reader.read(folder)).axes[0].findobj(Quiver)
    order = np.argsort(np.asarray(arrows.get_offsets())[:, 0])
    tails, ways = np.asarray(arrows.get_offsets())[order], np.column_stack([arrows.U, arrows.V])[order]
    if along:
        assert np.all(tails[:, 1] > 1.02)
        assert np.all(np.diff(tails[:, 0]) > 1.3 * ways[:-1, 0])
        assert [tails[0, 0], (tails + ways)[-1, 0]] == pytest.approx([0.0, 1.0])
    else:
        assert (tails + ways)[:, 1] == pytest.approx(np.ones(len(tails)))


@pytest.mark.parametrize(("body", "value"), [(square, "5 kN/m"), (box, "5 kN")], ids=["plane", "space"])
def test_a_force_that_is_spread_over_a_part_has_arrows_and_its_own_value(
    tmp_path: Path, body: Callable[[], mesh.Mesh], value: str
) -> None:
    folder, d = result(tmp_path / "r", body(), pressed), body().geometry.dim
    force = [3000.0, 4000.0, 0.0][:d]
    write_words(folder, d, effects=[role("pull", "force", drive="load")])
    scene = {"title": "t", "boundary": {"pull": {"on": "right", "force": force}}}
    (folder / "scene.toml").write_text(tomli_w.dumps(scene), encoding="utf-8")
    write_sides(folder, body(), pull=ON["pull"])
    (load,) = sides.loaded_sides(reader.read(folder))
    assert load.value.replace("\N{NARROW NO-BREAK SPACE}", " ") == value
    area = 1.0 if d == 2 else 0.24
    assert load.traction[:, :d] == pytest.approx(np.broadcast_to(np.array(force) / area, (len(load.traction), d)))


def test_what_drives_a_part_without_a_traction_is_said(tmp_path: Path) -> None:
    """A moment and a displacement; a support that holds is no drive."""
    folder = result(tmp_path / "r", square(4), pressed)
    kinds = {
        "turned": ("moment", -200.0),
        "lifted": ("displacement", ["free", 1e-3]),
        "held": ("displacement", [0.0, 0.0]),
    }
    effects = [
        role(
            part, key, drive="load" if key == "moment" else "kinematic", prescribed=[1] if key == "displacement" else []
        )
        for part, (key, _) in kinds.items()
    ]
    write_words(folder, 2, effects=effects)
    scene = {"title": "t", "boundary": {part: {"on": part, key: value} for part, (key, value) in kinds.items()}}
    (folder / "scene.toml").write_text(tomli_w.dumps(scene), encoding="utf-8")
    write_sides(folder, square(4), turned=ON["pull"], lifted=ON["wall"], held=lambda x: x[1] == 0)
    fig = bodies.scene(reader.read(folder))
    said = [text.get_text().replace("\N{NARROW NO-BREAK SPACE}", " ") for text in fig.legends[0].get_texts()]
    assert [line for line in said if "“" in line] == ["“turned”: moment −200 N", "“lifted”: displacement (free, 1 mm)"]
