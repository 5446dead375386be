"""Pictures are drawn from a folder alone, whatever is in it; and what cannot be drawn harms nobody.

Synthetic folders, written as the solver writes them, so that this fails for reasons of drawing only.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import tomli_w
from dolfinx import mesh
from matplotlib.text import Text
from mpi4py import MPI
from PIL import Image
from runs import hvi, write_scene
from scenes import model

from hvi_fenicsx import compat
from hvi_fenicsx.errors import HviError
from hvi_fenicsx.report import page, reader
from hvi_fenicsx.report.body_mesh import BodyMesh, body_mesh
from hvi_fenicsx.report.pictures import bodies, shape
from hvi_fenicsx.report.solution_arrays import FILE, ContactPart, LoadArrays, SolutionArrays, load, save
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
        assert not list(path.parent.glob(f".*{page.UNFINISHED}"))


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
    assert_drawn(page.draw(folder), "body.png", "contact.png")


@pytest.mark.parametrize("value", [pressed, pytest.param(peeled, marks=pytest.mark.long)], ids=["pressed", "peeled"])
def test_so_has_a_result_in_space_and_no_x_server_remains(
    tmp_path: Path, value: Callable[[Array], Array], left_running: Callable[[], list[str]]
) -> None:
    assert_drawn(page.draw(result(tmp_path / "r", box(), value)), "body.png", "contact.png")
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
    assert_drawn(page.draw(escaping(tmp_path / "r", body(), value)), "escape.png")


def write_sides(folder: Path, body: mesh.Mesh, **on: Callable[[Array], npt.NDArray[np.bool_]]) -> None:
    x, d = body.geometry.x, body.geometry.dim
    at = np.flatnonzero(x[:, 0] == 1)
    push = LoadArrays(vertices=at, traction=np.outer(1e6 * (1 - x[at, 1]), np.eye(d)[0]), pressure=np.zeros(len(at)))
    found = {name: facets_on(plain(body), where(x.T)) for name, where in on.items()}
    change(folder, sides=found, loads={"pull": push} if "pull" in on else {})


ON = {"wall": lambda x: x[0] == 0, "pull": lambda x: x[0] == 1}


def test_a_slanted_side_is_held_along_its_own_normal(tmp_path: Path) -> None:
    """The square turned by 30 degrees: what mesh files have, and no axis tells."""
    turn = np.array([[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]])
    body = square(4)
    upright = body.geometry.x.copy()
    body.geometry.x[:, :2] = upright[:, :2] @ turn.T
    folder = result(tmp_path / "r", body, np.zeros_like)
    change(folder, parts={})
    write_sides(folder, body, wall=lambda _: upright[:, 0] == 0)
    (support,) = shape.held_sides(reader.read(folder))
    assert support.side.normals[:, :2] == pytest.approx(np.broadcast_to(-turn[:, 0], (5, 2)))
    assert len(support.side.facets) == 4


def test_each_part_has_its_picture_and_a_scene_without_contact_has_its_body(tmp_path: Path) -> None:
    folder = result(tmp_path / "r", square(), peeled)
    change(folder, parts={"a.b": floor(square(), peeled), "floor": floor(square(), pressed)})
    assert_drawn(page.draw(folder), "body.png", "contact_a.b.png", "contact_floor.png")
    bare = result(tmp_path / "bare", square(), pressed)
    change(bare, parts={})
    assert_drawn(page.draw(bare), "body.png")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda f: (f / "summary.json").unlink(), "summary.json: No such file"),
        (lambda f: (f / "summary.json").write_text("{"), "r: damaged"),
        (lambda f: (f / FILE).unlink(), "solution.npz: there is no such file"),
        (lambda f: (f / FILE).write_text("<x/>"), "solution.npz: damaged"),
        (lambda f: (f / FILE).write_bytes((f / FILE).read_bytes()[:-40]), "solution.npz: damaged"),
        (lambda f: np.savez(f / FILE, points=np.zeros((3, 2))), "solution.npz: damaged"),
        (lambda f: change(f, displacement=None, parts={}), "nothing to draw"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(tmp_path: Path, damage: Callable[[Path], object], words: str) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    damage(folder)
    with pytest.raises(HviError, match=words) as caught:
        page.draw(folder)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)


@pytest.mark.parametrize("processors", [1, 8])
def test_a_process_that_dies_takes_the_picture_with_it_that_it_was_drawing(tmp_path: Path, processors: int) -> None:
    folder = result(tmp_path / "r", square(4), pressed)
    write_sides(folder, square(4), **ON)
    code = (
        "import os, signal, sys; from pathlib import Path; from hvi_fenicsx.report import reader\n"
        "from hvi_fenicsx.report.pictures import drawings\n"
        "found = list(drawings.drawings(reader.read(Path(sys.argv[1]))))\n"
        "first = drawings.Drawing(found[0].path, '', lambda: os.kill(os.getpid(), signal.SIGKILL))\n"
        "drawings.drawings = lambda result: [first, *found[1:]]\n"
        "os.cpu_count = lambda: int(sys.argv[2])\n"
        "sys.exit(drawings.main(sys.argv[1:2]))\n"
    )
    command = [*processes.PYTHON, "-c", code, str(folder), str(processors)]
    done = subprocess.run(command, env=processes.environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 1
    drawn, failure = {"scene.png", "contact.png"}, "body.png: the drawing process ended with SIGKILL"
    assert drawn == set(done.stdout.splitlines())
    assert failure in done.stderr
    assert {path.name for path in folder.glob("*.png")} == drawn


def test_a_child_that_takes_too_long_is_ended_with_its_server(
    tmp_path: Path, left_running: Callable[[], list[str]]
) -> None:
    folder = result(tmp_path / "r", box(), pressed)
    with pytest.raises(HviError, match="not drawn within"):
        page.draw(folder, timeout=0.8)
    deadline = time.monotonic() + 5.0
    while left_running() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert left_running() == []
    assert not list(folder.glob(f".*{page.UNFINISHED}"))


def test_the_child_is_no_rank_and_the_package_loads_no_plotting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    monkeypatch.setenv("PMIX_RANK", "1")
    assert_drawn(page.draw(result(tmp_path / "r", square(4), pressed)), "body.png", "contact.png")
    code = (
        "import sys, hvi_fenicsx.report.page; "
        "print([m for m in ('pyvista', 'matplotlib', 'mpi4py') if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert told.stdout.strip() == "[]"


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
    assert set(three.arrays.sides) == set(one.arrays.sides)
    for name, facets in three.arrays.sides.items():
        assert corners(body, facets) == corners(one.body, one.arrays.sides[name])
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
    captions = {path.name: Image.open(path).info["Description"] for path in page.draw(folder)}
    assert captions["body.png"] == "The deformed body, its displacements magnified, with what acts on it."
    assert captions["contact_“b”.png"] == "Along ““b””: displacement, friction and pressure."


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
        (bodies.stress, "von Mises stress, peak 7 MPa; "),
        (bodies.body, "displacement |u|, up to 33 µm; "),
    ):
        said = [text.get_text().replace("\u202f", " ") for text in make(found).findobj(Text)]
        assert any(text.startswith(words) for text in said)


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
