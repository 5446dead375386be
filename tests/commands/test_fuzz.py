"""Damaged scenes and meshes through the whole program: refused in words or solved, never a traceback, crash or hang.

One process runs many cases, since its start costs more than a case; when it dies or hangs, the case is known by its
number and the rest go on in a new one. A case again: see :func:`damage.make`, or

    PYTHONPATH=tests/support ./hvi exec python3 tests/support/fuzz_runner.py FOLDER NUMBER NUMBER+1 1
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from damage_search import SEARCH, TORN_SEARCH
from damage_study import ACCURACY, STUDY, TORN
from runs import ROOT
from scenes import model, quadratic_linear

from hvi_fenicsx import InputError, read_scene

pytestmark = pytest.mark.long

RUNNER = ROOT / "tests" / "support" / "fuzz_runner.py"
CASES, SLICES = 600, 6
LIMIT = 600.0
"""Seconds that the cases of a process may take."""
OPTIONS = (
    "--accuracy",
    "--quantity",
    "--axis",
    "--repeat",
    "--limit",
    "--np",
    "--out",
    "--gap",
    "--set",
    "--petsc",
)
PLACES = (
    "scene.toml",
    "the mesh",
    "m.msh",
    "boundary",
    "body",
    "load '",
    "material",
    "domain",
    "solver",
    "interface",
    "path",
    *OPTIONS,
)


def run(folder: Path, first: int, last: int, step: int, ranks: int = 1) -> list[dict[str, Any]]:
    """What came of each case; a dead or stuck process is an outcome of the case that it was at."""
    found: list[dict[str, Any]] = []
    while first < last:
        words = [sys.executable, *(["-m", "mpi4py"] if ranks > 1 else []), str(RUNNER)]
        launch = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        fault = started([*launch, *words, str(folder), str(first), str(last), str(step)])
        file = folder / "outcomes"
        found += [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []
        file.unlink(missing_ok=True)
        if not fault:
            break
        number, _, done = (folder / "now").read_text(encoding="utf-8").strip().partition(" ")
        found.append({"number": int(number), "done": done, "codes": [], "trace": fault})
        first = int(number) + step
    return found


def started(words: list[str]) -> str:
    """How a process ended; nothing if well."""
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT}/tests/support:{os.environ.get('PYTHONPATH', '')}"}
    try:
        done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return "hangs"
    return f"ended with {done.returncode}: {done.stderr[-2000:]}" if done.returncode else ""


def faults(found: dict[str, Any]) -> list[str]:
    """What is wrong with an outcome."""
    if found["trace"]:
        return [found["trace"]]
    codes, error = found["codes"], found["error"]
    wrong = [] if set(codes) <= {0, 2, 3, 4} and len(set(codes)) == 1 else [f"exit codes {codes}: {error}"]
    if codes[0] == 2:
        wrong += [] if error.startswith("hvi: ") and error.count("hvi: ") == 1 else [f"not one message: {error}"]
        wrong += [] if any(place in error for place in PLACES) else [f"names no place: {error}"]
        mine = {"scene.toml", "real.toml", "m.msh", *(["out"] if found["number"] >= STUDY else [])}
        wrong += [f"left behind {f}" for f in found["files"] if f not in mine]  # a study keeps its finished points
    elif "Traceback" in error:
        wrong.append(error)
    return wrong + [f"lacks {name}" for name in found["faults"]]


def assert_sound(found: list[dict[str, Any]], count: int) -> None:
    wrong = {f"{f['number']} ({f['done']})": faults(f) for f in found if faults(f)}
    assert wrong == {}
    assert len(found) == count
    assert {0, 2} <= {f["codes"][0] for f in found}


@pytest.mark.parametrize("start", range(SLICES))
def test_damaged_cases_are_refused_or_solved(start: int, tmp_path: Path) -> None:
    assert_sound(run(tmp_path, start, CASES, SLICES), CASES // SLICES)


def test_damaged_cases_on_two_ranks(tmp_path: Path) -> None:
    assert_sound(run(tmp_path, 1000, 1060, 1, ranks=2), 60)


@pytest.mark.parametrize(("first", "count"), [(ACCURACY, 40), (STUDY, 40), (TORN, 16)])
def test_damaged_requests_and_study_folders(first: int, count: int, tmp_path: Path) -> None:
    """An accuracy or a study asked of damaged scenes or in damaged words; a torn study that shall be resumed."""
    found = run(tmp_path, first, first + count, 1)
    assert {f"{f['number']} ({f['done']})": faults(f) for f in found if faults(f)} == {}
    assert len(found) == count
    assert any(set(f["codes"]) & {0, 3, 4} for f in found), "none gets as far as solving"


@pytest.mark.parametrize(("first", "count", "ranks"), [(SEARCH, 240, 1), (SEARCH + 300, 40, 2), (TORN_SEARCH, 40, 1)])
def test_damaged_paths_searches_and_pairs_of_bodies(first: int, count: int, ranks: int, tmp_path: Path) -> None:
    """`path`, `equilibria` and scenes of two bodies, damaged; folders of stopped ones, torn before `--resume`."""
    found = run(tmp_path, first, first + count, 1, ranks)
    assert {f"{f['number']} ({f['done']})": faults(f) for f in found if faults(f)} == {}
    assert len(found) == count
    assert any(set(f["codes"]) & {0, 3, 4} for f in found), "none gets as far as solving"


KEYS = [
    "youngs_modulus",
    "poisson_ratio",
    "traction",
    "displacement",
    "friction",
    "contact",
    "delta",
    "cells",
]


@pytest.mark.parametrize("key", KEYS)
def test_a_misspelt_key_is_told_with_the_right_one(key: str, tmp_path: Path) -> None:
    whole = tomli_w.dumps(model(3, friction=quadratic_linear(1e6)))
    for i in range(1, len(key)):
        wrong = re.sub(rf"\b{key}( =|\])", rf"{key[:i]}{key[i + 1 :]}\1", whole)
        assert wrong != whole
        (tmp_path / "s.toml").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match=f"did you mean ['\"]{key}['\"]"):
            read_scene(tmp_path / "s.toml")
