"""Why: a box of effects is only open if a user can add to it without touching it, and documents that are not run rot.

The files of docs/extending.md are written out as they stand and run; each is held to a scene that says the same with
the program's own words.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from runs import ROOT, hvi, process, summary

from hvi_fenicsx import InputError, read_scene

DOCUMENT = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCKS = dict(re.findall(r"^```\w+\n# (\S+)\n(.*?)^```$", DOCUMENT, flags=re.MULTILINE | re.DOTALL))
PLAIN = {
    'law = "plateau", strength = 1.0e6, slip = 3.0e-6': 'law = "graph", points = [[0, 0], [3e-6, 1e6], [9e-6, 1e6], '
    "[9e-6, 0.5e6]]",
    "water = { level = 150.0 }": 'traction = [0.0, "-9810*(150 - y)"]',
    'plugins = ["my_law.py", "my_smoothing.py", "my_effect.py", "my_method.py", "my_quantity.py"]': "",
    'method = "lowest"': 'method = "auto"',
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the document's files; and, as ``plain.toml``, their scene in the program's own words."""
    folder, plain = tmp_path_factory.mktemp("extending"), BLOCKS["pressed.toml"]
    for own, word in PLAIN.items():
        assert own in plain
        plain = plain.replace(own, word)
    for name, text in (BLOCKS | {"plain.toml": plain}).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def pressed(files: Path) -> Path:
    """The result of the document's scene. The user's classes are known to processes of their own only."""
    done = process("run", "pressed.toml", "--no-pictures", cwd=files)
    assert done.returncode == 0, done.stderr
    return files / "results" / "pressed"


def package() -> dict[str, str]:
    """The program's files, by their digests."""
    found = (ROOT / "hvi_fenicsx").rglob("*.py")
    return {str(f): hashlib.sha256(f.read_bytes()).hexdigest() for f in found}


def test_the_document_has_the_files_and_counts_their_lines() -> None:
    told = {name: int(lines) for name, lines in re.findall(r"\| `(\w+\.py)` \| (\d+) \|", DOCUMENT)}
    assert told == {name: len([x for x in BLOCKS[name].splitlines() if x.strip()]) for name in told}
    assert set(BLOCKS) == {*told, "pressed.toml", "pressed.py", "standing.toml"}


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.long)])
def test_the_users_scene_is_that_of_the_programs_own_words(ranks: int, files: Path, request: Any) -> None:
    before, out = package(), request.getfixturevalue("pressed") if ranks == 1 else files / "parallel"
    if ranks > 1:
        done = process("run", "pressed.toml", "--out", out, "--no-pictures", cwd=files, ranks=ranks)
        assert done.returncode == 0, done.stderr
    assert hvi("run", "plain.toml", "--out", f"plain{ranks}", "--no-pictures", cwd=files).returncode == 0
    own, program = summary(out), summary(files / f"plain{ranks}")
    assert own["energy"] == pytest.approx(program["energy"], rel=1e-9)
    assert (own["method"], program["method"]) == ("lowest", "branch")
    assert own["solvability"]["margin"] == pytest.approx(program["solvability"]["margin"])
    assert own["solvability"]["kernel"] == program["solvability"]["kernel"]
    assert package() == before


def test_a_body_of_the_users_shape_stands_on_its_floor_with_its_weight(files: Path) -> None:
    before = package()
    done = process("run", "standing.toml", "--no-pictures", cwd=files)
    assert done.returncode == 0, done.stderr
    assert summary(files / "results" / "standing")["contact"]["resultant"] == pytest.approx(
        [0.0, 1.5 * 2.0e4], abs=1e-4
    )
    refused = process("check", "standing.toml", "--set", 'boundary.floor.on="botom"', cwd=files)
    assert (refused.returncode, package()) == (2, before)
    assert 'unknown side "botom"; did you mean "bottom"? allowed: bottom, right, top, left' in refused.stderr


@pytest.mark.long
def test_the_users_smoothing_gives_what_a_narrow_one_of_the_programs_gives(files: Path) -> None:
    for name in ("cubic", "quadratic"):
        wanted = f'solver={{smoothing="{name}", epsilon=1e-3}}'
        done = process("run", "pressed.toml", "--set", wanted, "--out", name, "--no-pictures", cwd=files)
        assert done.returncode == 0, done.stderr
    own, program = (summary(files / name) for name in ("cubic", "quadratic"))
    assert (own["smoothing"], own["certificate"]["passed"]) == ("cubic", True)
    assert own["energy"] == pytest.approx(program["energy"], rel=1e-6)


@pytest.mark.long
def test_an_accuracy_of_the_users_quantity_is_kept(files: Path) -> None:
    """On two ranks; against a solution that is right to 1 % in the energy norm, so to 0.01 % in energy."""
    for name, ranks, words in (("asked", 2, ("0.02", "--quantity", "work")), ("exact", 1, ("0.01",))):
        done = process(
            "run", "pressed.toml", "--out", name, "--no-pictures", "--accuracy", *words, cwd=files, ranks=ranks
        )
        assert done.returncode == 0, done.stderr
    asked = summary(files / "asked")
    assert (asked["accuracy"]["quantity"], asked["accuracy"]["reached"]) == ("work", True)
    assert "of the work of the loads" in (files / "asked" / "run.log").read_text(encoding="utf-8")
    assert asked["energy"] == pytest.approx(summary(files / "exact")["energy"], rel=0.02)


def test_from_python(files: Path, pressed: Path) -> None:
    done = subprocess.run(
        [sys.executable, "pressed.py"], cwd=files, capture_output=True, text=True, check=True, timeout=300
    )
    words = done.stdout.split()
    assert words[0] == "certified"
    assert float(words[-2]) == pytest.approx(summary(pressed)["energy"], rel=1e-7)


WRONG = {
    "missing.py": (None, "missing.py does not exist; it is looked for beside the scene file"),
    "law.txt": ("", 'must name Python files, like "my_laws.py" (is "law.txt")'),
    "broken.py": ("x = 1\ny = x +\n", "broken.py:2: SyntaxError"),
    "raises.py": ("\n\nraise ValueError('no such steel')\n", "raises.py:3: ValueError: no such steel"),
    "taken.py": (
        "from hvi_fenicsx.solvers import Method\nclass M(Method):\n    name = 'branch'\n",
        "taken.py:2: TypeError: method class M: the name 'branch' is taken",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_plugin_that_cannot_be_loaded_is_told_with_its_place(name: str, tmp_path: Path) -> None:
    text, told = WRONG[name]
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    scene = BLOCKS["pressed.toml"].replace(
        '["my_law.py", "my_smoothing.py", "my_effect.py", "my_method.py", "my_quantity.py"]', f'"{name}"'
    )
    (tmp_path / "pressed.toml").write_text(scene, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_scene(tmp_path / "pressed.toml")
    assert told in str(caught.value)
    assert "pressed.toml:2: plugins" in str(caught.value)
