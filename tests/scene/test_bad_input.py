"""Wrong scenes: exit code 2, one clear message, no traceback, nothing written; serial and on two ranks alike.

A rank that stops alone hangs the others, so each case runs under mpirun too, with a time limit.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import meshes
import pytest
from runs import hvi, process, write_scene
from scenes import STEEL, model, quadratic_linear

from hvi_fenicsx import InputError, prepare, read_scene, read_tables

LAW = quadratic_linear(1e3)
TABLE: dict[str, tuple[str, str]] = {
    "a degree that there is not": ("solver.degree=3", "--set solver.degree: must be 2 or less (is 3)"),
    "unknown key": ("domain.sell=[4, 4]", "sell: unknown key"),
    "unknown table": ("boundry.x.on='left'", "boundry"),
    "misspelt side": ("boundary.wall.on='lefft'", 'did you mean "left"'),
    "negative modulus": ("material.youngs_modulus=-1.0", "greater than 0"),
    "infinite load": ("boundary.pull.traction=[inf, 0.0]", "traction"),
    "foreign name": ("boundary.pull.traction=['1e6*open', 0.0]", "open"),
    "a call into Python": ('boundary.pull.traction=[\'__import__("os").system("id")\', 0.0]', "traction"),
    "too few components": ("boundary.pull.traction=[1e6]", "2D"),
    "a load that is not finite": ("boundary.press.traction=[0.0, '-1e6/x']", "is not finite everywhere there"),
    "contact excludes a support": ("boundary.wall.displacement=[0.0, -1e-5]", "violates the contact bound"),
    "bounds that contradict each other at one vertex": (
        "boundary.floor.contact={lower='2e-6*(x - 0.5)', upper='2e-6*(0.75 - x)'}",
        "boundary.floor: at (0.75, 0), u·n would have to be at least",
    ),
    "supports that differ where they meet": (
        "boundary.press={on='top', displacement=[1e-3, 'free']}",
        "boundary.wall and boundary.press meet at (0, 1) and prescribe displacements along x that differ",
    ),
    "a friction that follows the pressure": ("boundary.floor.friction.law='coulomb'", "no derivative of an energy"),
    "a law against its formula": ("boundary.floor.friction.gamma2=1e3", "2 gamma2"),
    "exact method with smoothing": (
        "solver={method='branch', epsilon=0.1}",
        '--set solver.method: "branch" solves the law without smoothing',
    ),
    "a table that there is not": ("solvr.tolerance=1e-3", 'hvi: --set solvr: unknown key "solvr"; did you mean'),
    "a value of two lines": ('title="a\nb"', "must be KEY=VALUE, a dotted key and a TOML value"),
    "no such mesh": ("domain={shape='file', file='absent.msh'}", "does not exist"),
    "more memory than there is": ("domain.cells=[32000, 32000]", "use fewer cells"),
    "a size of no body": ("domain.size=[1.0, 1e-12]", "must be 1e-09 or more"),
    "a displacement beyond all numbers": ("boundary.wall.displacement=[1e308, 'free']", "cannot be computed with"),
    "a load whose energy is no number": (
        "boundary.press.traction=[0.0, -1e160]",
        "boundary.press.traction: makes stresses of about 1e+160 N/m²",
    ),
    "no modulus at all": (
        "material={elasticity='tensor', model='plane_stress', matrix=[[0,0,0],[0,0,0],[0,0,0]]}",
        "the elasticity is zero",
    ),
    "a number of thousands of digits": (
        f"domain.cells=[0x{'F' * 5000}, 4]",
        "domain.cells.0: is a whole number beyond",
    ),
    "a law of too many pieces": (
        "boundary.floor.friction={law='sawtooth', peak_traction=2, residual_traction=1, delta=1e-6, drops=1000000000}",
        "drops = 1000000000 must be a whole number from 1 to 1000",
    ),
    "a load that is not finite where it is integrated": (
        "boundary.press.traction=[0.0, '-exp(1e9*sin(8*pi*x)**2)']",
        "boundary.press.traction: the formula is not finite everywhere there, between the vertices",
    ),
    "a ball beyond all numbers": (
        "boundary.floor.contact={obstacle={shape='sphere', center=[0.5, -9], radius=1e308, direction=[0, -1]}}",
        "boundary.floor.contact: the formula",
    ),
    "a shape that is a list": ("boundary.floor.contact={obstacle={shape=[1]}}", "must be one of plane, sphere"),
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "scene.toml", model(4, friction=LAW))


def assert_refused(done: subprocess.CompletedProcess[str], words: str, folder: Path, before: set[str]) -> None:
    assert done.returncode == 2, done.stdout + done.stderr
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("hvi: ")
    assert done.stderr.count("hvi: ") == 1
    assert done.stdout == ""
    assert {f.name for f in folder.iterdir()} == before


@pytest.mark.parametrize("case", TABLE)
def test_a_wrong_scene_is_refused_in_words(case: str, scene: Path, tmp_path: Path) -> None:
    override, words = TABLE[case]
    assert_refused(hvi("run", scene, "--set", override, cwd=tmp_path), words, tmp_path, {"scene.toml"})


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('method = "auto"', 'method = "newtn"', "solver.method: unknown method 'newtn'"),
        ("-1000000.0", '"-1e6/x"', "boundary.press.traction: the formula '-1e6/x' is not finite everywhere there"),
    ],
)
def test_what_is_found_late_has_its_line(old: str, new: str, words: str, scene: Path, tmp_path: Path) -> None:
    """The method is known only after the scene is read, and a load is evaluated on the mesh."""
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text.replace(old, new), encoding="utf-8")
    line = text[: text.index(old)].count("\n") + (1 if "method" in old else -1)
    assert_refused(hvi("run", scene, cwd=tmp_path), f"scene.toml:{line}: {words}", tmp_path, {"scene.toml"})


@pytest.mark.parametrize(
    ("body", "place", "line"),
    [
        ('[body]\nforce = ["sqrt(y - 0.5)", 0.0]', "body.force", 2),
        ('[body.weight]\nforce = ["sqrt(y - 0.5)", 0.0]', "body.weight.force", 2),
        ('[body.weight]\nregion = ["soft", "hard"]\nforce = ["sqrt(y - 0.5)", 0.0]', "body.weight.force", 3),
        ('[body]\nregion = "hard"\nforce = ["sqrt(y - 0.5)", 0.0]', "body.force", 3),
        ('[boundary."a.b"]\non = "top"\ntraction = ["sqrt(x - 0.5)", 0.0]', "boundary.a.b.traction", 3),
    ],
)
def test_a_formula_that_fails_on_the_mesh_has_its_line(body: str, place: str, line: int, tmp_path: Path) -> None:
    """Errors name what acts in the body by its region; the file may give it by the name of its table."""
    file = meshes.make(tmp_path / "m.msh", meshes.HALVES)
    table = file_scene(file, floor={"on": "bottom", "contact": {"gap": 0.0}})
    del table["boundary"]["press"]
    table["material"] = {"a": STEEL | {"region": ["soft", "hard"]}}
    scene = write_scene(tmp_path / "scene.toml", table)
    before = scene.read_text(encoding="utf-8").count("\n") + 1
    scene.write_text(scene.read_text(encoding="utf-8") + "\n" + body, encoding="utf-8")
    done = hvi("check", scene, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"hvi: {scene}:{before + line}: {place}: the formula 'sqrt(")


def test_a_wrong_scene_is_refused_by_the_process_too(scene: Path, tmp_path: Path) -> None:
    done = process("run", scene, "--set", "boundary.press.traction=[0.0, '-1e6/x']", cwd=tmp_path)
    assert_refused(done, "is not finite everywhere there", tmp_path, {"scene.toml"})


PLACES = ["/proc/nowhere/result", "{folder}/scene.toml/result", "{folder}/scene.toml"]
"""As root, too: /proc takes no folders and a file holds none."""


@pytest.mark.parametrize("out", PLACES)
def test_a_folder_that_cannot_be_written_is_refused(out: str, scene: Path, tmp_path: Path) -> None:
    done = hvi("run", scene, "--out", out.format(folder=tmp_path), cwd=tmp_path)
    assert_refused(done, "--out", tmp_path, {"scene.toml"})


ALL_RANKS = """
import json, sys
from mpi4py import MPI
from hvi_fenicsx.commands.cli import main
codes = [int(main(["run", *words])) for words in json.loads(sys.argv[2])]
every = MPI.COMM_WORLD.gather(codes)
if every:
    with open(sys.argv[1], "w") as file:
        file.write(repr(every))
"""


def test_all_of_it_on_two_ranks(scene: Path, tmp_path: Path) -> None:
    """One start of MPI for the whole table, all places and mesh files; each message is printed once."""
    codes, outs = tmp_path / "codes", [out.format(folder=tmp_path) for out in PLACES]
    meshed = {"linear triangles only": _on_a_damaged_mesh(tmp_path), "bottom, left, right, top": _misnamed(tmp_path)}
    calls = [*(["--set", override] for override, _ in TABLE.values()), *(["--out", out] for out in outs)]
    calls += [["--set", 'solver.method="condensed"']]
    calls = [*([str(scene), *words] for words in calls), *([str(file)] for file in meshed.values())]
    before = {f.name for f in tmp_path.iterdir()}
    words = [sys.executable, "-m", "mpi4py", "-c", ALL_RANKS, str(codes), json.dumps(calls)]
    done = subprocess.run(
        ["mpirun", "-n", "2", *words], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr
    assert codes.read_text() == repr([[2] * len(calls)] * 2)
    assert done.stderr.count("hvi: ") == len(calls)
    assert all(words in done.stderr for words in [*(words for _, words in TABLE.values()), *meshed])
    assert all(f"hvi: --out {out}: " in done.stderr for out in outs)
    assert "one process, not in 2" in done.stderr
    assert {f.name for f in tmp_path.iterdir()} == before | {"codes"}


@pytest.mark.parametrize(
    "words", [[], ["fly"], ["run"], ["run", "a.toml", "--speed", "9"], ["run", "a.toml", "--np", "x"]]
)
def test_a_wrong_command_line_is_refused_like_a_wrong_scene(words: list[str], tmp_path: Path) -> None:
    assert_refused(hvi(*words, cwd=tmp_path), "--help", tmp_path, set())


def file_scene(file: Path, **boundary: Any) -> dict[str, Any]:
    table = model(4)
    table["domain"] = {"shape": "file", "file": str(file)}
    table["boundary"] |= boundary
    return table


WORDS = {
    "third order": "linear triangles only",
    "quadrilaterals": "linear triangles only",
    "lines only": "dimension",
    "a solid": "its cells have dimension 3",
    "no groups": "no physical group",
    "not in a plane": "must lie in a plane",
}


@pytest.mark.parametrize("kind", WORDS)
def test_a_mesh_file_that_is_none_of_ours_is_refused(kind: str, tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "m.msh", meshes.BAD[kind])
    with pytest.raises(InputError, match=WORDS[kind]) as refused:
        prepare(read_tables(file_scene(file)))
    assert str(file) in str(refused.value)


BROKEN = {
    "cut off": (lambda text: text[: len(text) // 2], "mesh file"),
    "no mesh at all": (lambda _: "Hello, this is a letter.\n", "mesh file"),
    "nothing": (lambda _: "", "mesh file"),
    "an empty group": (lambda text: text.replace('1 1 "left"', '1 9 "left"'), "left"),
    "a coordinate out of this world": (lambda text: text.replace("\n1 1 0\n", "\n1 1e200 0\n"), "has no volume"),
    "a coordinate that is none": (lambda text: text.replace("\n1 1 0\n", "\n1 nan 0\n"), "mesh file"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_damaged_mesh_file_is_refused(kind: str, tmp_path: Path) -> None:
    damage, words = BROKEN[kind]
    file = meshes.make(tmp_path / "m.msh", meshes.GOOD)
    whole = file.read_text(encoding="utf-8")
    file.write_text(damage(whole), encoding="utf-8")
    assert file.read_text(encoding="utf-8") != whole
    with pytest.raises(InputError, match=words):
        prepare(read_tables(file_scene(file)))


def _on_a_damaged_mesh(folder: Path) -> Path:
    file = meshes.make(folder / "damaged.msh", meshes.BAD["third order"])
    return write_scene(folder / "damaged.toml", file_scene(file))


def _misnamed(folder: Path) -> Path:
    file = meshes.make(folder / "good.msh", meshes.GOOD)
    return write_scene(folder / "misnamed.toml", file_scene(file, wall={"on": "lleft", "displacement": [0.0, "free"]}))


def test_a_group_that_the_mesh_does_not_have_is_told_with_those_it_has(tmp_path: Path) -> None:
    done = hvi("run", _misnamed(tmp_path), cwd=tmp_path)
    assert_refused(done, "bottom, left, right, top", tmp_path, {"misnamed.toml", "good.msh"})


@pytest.mark.parametrize("depth", range(300, 800, 50))
def test_a_table_that_is_nested_deep_is_told_in_words(tmp_path: Path, depth: int) -> None:
    file = tmp_path / "deep.toml"
    file.write_text("study = " + "[" * depth + "]" * depth, encoding="utf-8")
    with pytest.raises(InputError, match=r"unknown key|nested too deep"):
        read_scene(file)
