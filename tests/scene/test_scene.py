"""Scenes: what is read, what is refused and in which words; a damaged file never breaks the reader."""

from __future__ import annotations

import contextlib
import runpy
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from hvi_fenicsx import laws
from hvi_fenicsx.effects import Contact, Contribution, Effect, FormContext, Friction, Place
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.model import Model, SolverTable, dump_scene, read_scene, read_tables
from hvi_fenicsx.model.reader import KEYS

ROOT = Path(__file__).parents[2]
DEMOS = sorted((ROOT / "demos").glob("*.toml"))
PAPER = """\
title = "Wall left"
[domain]
shape = "rectangle"
size = [1.0, 1.0]
cells = [32, 32]
[material]
model = "plane_stress"
youngs_modulus = 2.15e11
poisson_ratio = 0.29
[boundary.wall]
on = "left"
displacement = [0.0, "free"]
[boundary.pull]
on = "right"
traction = [1.0e6, 0.0]
[boundary.floor]
on = "bottom"
contact = { gap = 0.0 }
friction = { law = "quadratic_linear", gamma1 = 1.0e3, gamma2 = 0.5e3, delta = 9.0e-6 }
[solver]
smoothing = "paper"
epsilon_absolute = 0.1
"""
FRICTION = 'law = "quadratic_linear", gamma1 = 1.0e3, gamma2 = 0.5e3, delta = 9.0e-6'


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    def write_text(text: str, name: str = "s.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write_text


def message(path: Path, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        read_scene(path, overrides)
    assert caught.value.exit_code == 2
    return str(caught.value).replace(f"{path.parent}/", "")


# What was written, what it was changed to, and the whole message.
REFUSED = {
    "unknown key": (
        "poisson_ratio",
        "colour = 3\npoisson_ratio",
        's.toml:9: material.colour: unknown key "colour"; allowed: region, model, '
        "thermal_expansion, youngs_modulus, poisson_ratio",
    ),
    "misspelt side": (
        '"bottom"',
        '"botom"',
        's.toml:17: boundary.floor.on: unknown side "botom"; did you mean "bottom"? allowed: left, '
        "right, bottom, "
        "top (a rectangle)",
    ),
    "number as text": (
        "2.15e11",
        '"2.15e11"',
        's.toml:8: material.youngs_modulus: must be a number (is "2.15e11"); write it without quotes',
    ),
    "missing key": (
        "poisson_ratio = 0.29",
        "",
        "s.toml:6: material.poisson_ratio: is missing: Poisson's ratio ν, between -1 and 0.5",
    ),
    "shape": (
        '"rectangle"',
        '"rectangel"',
        's.toml:3: domain.shape: unknown shape "rectangel"; did you mean "rectangle"? allowed: rectangle, box, '
        "disk, half_disk, l_shape, notched_strip, file",
    ),
    "list wanted": (
        "[1.0e6, 0.0]",
        "1.0e6",
        "s.toml:15: boundary.pull.traction: must be a list, one entry for each component, like [1e6, 0.0]",
    ),
    "misspelt free": (
        '"free"',
        '"fre"',
        "s.toml:12: boundary.wall.displacement.1: 'fre' in 'fre' is not known; a formula may use "
        "x, y, z and pi; or "
        'write "free" (None from Python) to leave the component alone',
    ),
    "model of the other dimension": (
        '"plane_stress"',
        '"three_dimensional"',
        's.toml:6: material: model = "three_dimensional" is not for 2D; use plane_stress or plane_strain',
    ),
    "region of a built-in shape": (
        "[material]",
        '[material]\nregion = "a"',
        's.toml:7: material.region: a rectangle has no regions; leave region out, or use shape = "file"',
    ),
    "contact where nothing can close": (
        'on = "bottom"',
        'on = "left"',
        's.toml:18: boundary.floor.contact: the displacement normal to "left" is prescribed by '
        'boundary.wall.displacement; leave contact out or write "free" there',
    ),
    "traction that does nothing": (
        'on = "right"',
        'on = "left"',
        's.toml:15: boundary.pull.traction: component 1 does nothing: u_x is prescribed on "left" by '
        'boundary.wall.displacement; write "free" there or 0 here',
    ),
    "smoothing without a width": (
        "epsilon_absolute = 0.1",
        "",
        "s.toml:21: solver.smoothing: needs its width: add epsilon = 0.01 (relative to the law's "
        "energy at its kink) "
        "or epsilon_absolute = 0.1 (N/m), or leave smoothing out to solve the law itself",
    ),
    "table that is there twice": (
        "[solver]",
        "[boundary.wall]",
        "s.toml:20:15: not valid TOML: Cannot declare ('boundary', 'wall') twice: [boundary.wall]",
    ),
    "missing mesh file": (
        'shape = "rectangle"\nsize = [1.0, 1.0]\ncells = [32, 32]',
        'shape = "file"\nfile = "part.msh"',
        "s.toml:4: domain.file: part.msh does not exist",
    ),
    "two at once": (
        "2.15e11\npoisson_ratio = 0.29",
        "0\npoisson_ratio = 0.5",
        "s.toml:8: material.youngs_modulus: must be greater than 0 (is 0)\n"
        "s.toml:9: material.poisson_ratio: must be less than 0.5 (is 0.5)",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_and_in_which_words(case: str, write: Callable[..., Path]) -> None:
    old, new, wanted = REFUSED[case]
    assert PAPER.count(old) == 1
    known = ", ".join(laws.available())  # plugins of other tests are among them
    assert message(write(PAPER.replace(old, new))) == wanted.replace("LAWS", known)


# Here the law writes the message; the place and the essential words count.
REFUSED_BY_LAWS = {
    "misspelt law": ('"quadratic_linear"', '"quadratc_linear"', "friction.law: ", "quadratic_linear"),
    "misspelt parameter": ("gamma1", "gama1", "friction.gama1: ", "gamma1"),
    "negative parameter": ("1.0e3", "-1.0e3", "friction.gamma1: ", "-1000"),
    "text": ("1.0e3", '"1.0e3"', "friction.gamma1: must be a number", "without quotes"),
    "infinite": ("1.0e3", "inf", "friction.gamma1: must be a finite number", "inf"),
    "gamma1 is not 2 gamma2": ("0.5e3", "0.4e3", "friction.gamma1: ", '"graph"'),
    "graph": (
        FRICTION,
        'law = "graph", points = [[0, 0], [1, "a"]]',
        "friction.points.1.1: must be a number",
        '"a"',
    ),
}


@pytest.mark.parametrize("case", REFUSED_BY_LAWS)
def test_what_laws_refuse(case: str, write: Callable[..., Path]) -> None:
    old, new, place, word = REFUSED_BY_LAWS[case]
    found = message(write(PAPER.replace(old, new, 1)))
    assert found.startswith(f"s.toml:19: boundary.floor.{place}")
    assert word in found
    assert "Input should" not in found


OVERRIDES: dict[str, Callable[[Any], bool]] = {
    "solver.tolerance=1e-12": lambda s: s.solver.tolerance == 1e-12,
    "domain.cells.1=8": lambda s: s.domain.cells == (32, 8),
    'solver.linear_solver="lu"': lambda s: s.solver.linear_solver == "lu",
    "solver={}": lambda s: s.solver == SolverTable(),
    "boundary.floor.friction.delta=1e-5": lambda s: s.laws()[0].delta == 1e-5,
    'boundary.lid={on="top", traction=[0, "x"]}': lambda s: s.parts["lid"].on == ("top",),
}


@pytest.mark.parametrize("assignment", OVERRIDES)
def test_overrides(assignment: str, write: Callable[..., Path]) -> None:
    assert OVERRIDES[assignment](read_scene(write(PAPER), [assignment]))


KEY_AND_VALUE = (
    "must be KEY=VALUE, a dotted key and a TOML value, like --set solver.tolerance=1e-10; a text needs quotes, with "
    "quotes of the shell around them: --set 'solver.method=\"branch\"'"
)
WRONG_OVERRIDES = {
    "solver.tolerance=2": "--set solver.tolerance: must be less than 1 (is 2)",
    "solver.method=branch": f"--set solver.method=branch: {KEY_AND_VALUE}",
    "domain.cells.2=8": '--set domain.cells.2=8: domain.cells is a list: unknown index "2"; allowed: 0, 1',
    "title.x=1": '--set title.x=1: title is "Wall left", not a table; it has no "x"',
    "solver": f"--set solver: {KEY_AND_VALUE}",
    "solver.tolerence=1e-3": '--set solver.tolerence: unknown key "tolerence"; did you mean "tolerance"? '
    "allowed: degree, method, "
    "smoothing, epsilon, epsilon_absolute, start, tolerance, linear_solver, second_order, max_iterations",
}


@pytest.mark.parametrize("assignment", WRONG_OVERRIDES)
def test_wrong_overrides(assignment: str, write: Callable[..., Path]) -> None:
    assert message(write(PAPER), assignment) == WRONG_OVERRIDES[assignment]


def test_files_that_are_no_scenes(tmp_path: Path, write: Callable[..., Path]) -> None:
    assert message(tmp_path / "none.toml") == "none.toml: does not exist"
    assert message(tmp_path).endswith("is a folder; give the scene file in it")
    assert message(write(" \n")).startswith("s.toml: domain: is missing")
    (tmp_path / "s.toml").write_bytes(b'title = "\xff"')
    assert message(tmp_path / "s.toml") == "s.toml:1: is not UTF-8; save the scene as UTF-8"
    assert message(write("a = " + "[" * 5000)).startswith("s.toml")
    assert message(write("a = " + "1" * 5000)) == "s.toml: has a number of too many digits"
    assert message(Path("/dev/null")) == "null: is no ordinary file"
    with pytest.raises(InputError, match="cannot be read"):
        read_scene("a\0b")


@pytest.mark.parametrize("demo", DEMOS, ids=lambda d: d.stem)
def test_round_trip_of_a_demo(demo: Path, write: Callable[..., Path]) -> None:
    scene = read_scene(demo)
    assert read_scene(write(dump_scene(scene), "again.toml")) == scene


def test_a_mistake_in_one_of_several_bodies_is_told_at_its_line(write: Callable[..., Path]) -> None:
    body = '[domain.{}]\nshape = "rectangle"\nsize = [1.0, 1.0]\ncells = [2, {}]\n{}\n'
    tables = body.format("upper", 2, "origin = [0.0]") + body.format("bodies", 0, "")
    steel = '[material]\nmodel = "plane_strain"\nyoungs_modulus = 2e11\npoisson_ratio = 0.3\n'
    assert message(write(tables + steel)) == (
        "s.toml:5: domain.upper.origin: has 1 components; a rectangle wants 2\n"
        "s.toml:9: domain.bodies.cells.1: must be greater than 0 (is 0)"
    )


def test_a_file_and_a_program_make_the_same_effects(write: Callable[..., Path]) -> None:
    law = laws.create("quadratic_linear", {"gamma1": 1e3, "gamma2": 0.5e3, "delta": 9e-6})
    contact, friction = (e for e in read_scene(write(PAPER)).effects if e.name == "floor")
    assert contact == Contact("bottom").at("bottom", "floor")
    assert friction == Friction("bottom", law).at("bottom", "floor")


@pytest.fixture
def glue() -> Iterator[type[Effect]]:
    class Glue(Effect):
        """An effect of a user's own."""

        key: ClassVar[str] = "glue"
        place: ClassVar[Place] = Place.BOUNDARY
        term: ClassVar[str] = "nothing"
        strength: float

        def contribute(self, context: FormContext, where: str | None) -> Contribution:
            return Contribution()

    yield Glue
    del Effect.registry[Place.BOUNDARY]["glue"]


def test_a_new_effect_is_a_key_at_once(glue: type[Effect], write: Callable[..., Path]) -> None:
    text = PAPER.replace("contact =", "glue = { strength = 2 }\ncontact =")
    scene = read_scene(write(text))
    assert [e.strength for e in scene.effects if isinstance(e, glue)] == [2]
    assert read_scene(write(dump_scene(scene), "again.toml")) == scene
    assert "boundary.floor.glue.strength: must be a number" in message(write(text.replace("= 2 }", '= "2" }')))


def test_reading_a_scene_needs_no_dolfinx() -> None:
    heavy = ("dolfinx", "ufl", "petsc4py", "mpi4py")
    code = f"import sys, hvi_fenicsx.model; sys.exit(any(m in sys.modules for m in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0


def test_the_reference_is_what_the_classes_say() -> None:
    reference = runpy.run_path(str(ROOT / "docs" / "scene_reference.py"))["reference"]
    assert (ROOT / "docs" / "scene.md").read_text() == reference(), (
        "renew it: ./hvi exec python3 docs/scene_reference.py > docs/scene.md"
    )


# Damage: pieces of the scene exchanged for others, cut, doubled, or set to something odd.
_ODD = [
    "nan", "inf", "-1", "0", "1e400", "9" * 400, "true", '""', '"x"', "[]", "{}", "[[1]]", '"1/0"',
    '"x.__class__"', "1979-05-27", "[1, [2, [3]]]", "{ law = 3 }", '{ law = "graph", points = [[0]] }',
    '"\\u0000"', "0x10", '"' + "-" * 300 + 'x"', "-0.0", "1e-320", "'''a\nb'''", '["left", "left"]',
    '"lambda: 0"', "7_7",
    "[1e6, 'y', nan]",
]  # fmt: skip
_LINES = PAPER.splitlines()


def _damaged(kind: int, line: int, other: int, odd: str, cut: int) -> str:
    lines = list(_LINES)
    key = lines[line].partition("=")[0]
    if kind == 0:
        lines[line] = f"{key}= {odd}"
    elif kind == 1:
        lines[line], lines[other] = lines[other], lines[line]
    elif kind == 2:
        lines[line] = lines[line][: cut % (len(lines[line]) + 1)]
    elif kind == 3:
        del lines[line]
    elif kind == 4:
        lines.insert(other, lines[line])
    else:
        middle = cut % (len(lines[line]) + 1)
        lines[line] = lines[line][:middle] + odd + lines[line][middle:]
    return "\n".join(lines)


_LINE = st.integers(0, len(_LINES) - 1)
_TEXT = st.text(st.characters(codec="utf-8"), max_size=8)


@settings(max_examples=600, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(1, 14, 18, "nan", 0)  # two tables of a part in another order than they are written
@given(st.integers(0, 5), _LINE, _LINE, st.sampled_from(_ODD) | _TEXT, st.integers(0, 99))
def test_damaged_scenes_are_read_or_refused(
    tmp_path: Path, kind: int, line: int, other: int, odd: str, cut: int
) -> None:
    path = tmp_path / "damaged.toml"
    path.write_bytes(_damaged(kind, line, other, odd, cut).encode())
    try:
        scene = read_scene(path)
    except InputError as error:
        found = str(error)
    else:
        path.write_text(dump_scene(scene))
        assert read_scene(path) == scene
        return
    assert "Input should" not in found
    assert "pydantic" not in found
    assert 0 < len(found) < 4000


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | _TEXT,
    lambda v: st.lists(v, max_size=3) | st.dictionaries(_TEXT, v, max_size=3),
    max_leaves=6,
)


@settings(max_examples=200)
@given(st.dictionaries(st.sampled_from([*KEYS, "x"]), _VALUES))
@example({"plugins": 1})
@example({"plugins": {"a.py": 1}})
def test_any_tables_are_refused_in_one_way(data: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        read_tables(data)


@settings(max_examples=300)
@given(
    st.text(max_size=30)
    | st.sampled_from([f"{k}={v}" for k in ("solver.epsilon", "domain.size.0", "a.b") for v in _ODD])
)
def test_any_override_is_applied_or_refused(assignment: str) -> None:
    with contextlib.suppress(InputError):
        assert isinstance(read_scene(DEMOS[-1], [assignment]), Model)
