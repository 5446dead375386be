"""Runs of the command line, within this process or as users start them, serial or under mpirun; what they leave."""

from __future__ import annotations

import contextlib
import fcntl
import io
import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hvi_fenicsx import dump_scene, read_tables
from hvi_fenicsx.commands.cli import main
from hvi_fenicsx.runtime.processes import SIGNALS

ROOT = Path(__file__).parents[2]
RANKS = (1, 2, pytest.param(3, marks=pytest.mark.long))
"""Three ranks show more: one with a neighbour on either side, parts of unequal size. They want three cores."""
LONG_RANKS = (1, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 3)))
"""For what the scenes of ``workflow/test_ranks.py`` go through on three ranks as well."""


def command(*words: object, ranks: int = 1) -> list[str]:
    """The command line of a run."""
    serial = [sys.executable, "-m", "hvi_fenicsx"]
    parallel = ["mpirun", "-n", str(ranks), sys.executable, "-m", "mpi4py", "-m", "hvi_fenicsx"]
    return [*(serial if ranks == 1 else parallel), *map(str, words)]


def hvi(*words: object, ranks: int = 1, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """A command to its end, within this process (what ``main`` returns is what a process ends with) or on ranks."""
    if ranks > 1:
        return process(*words, ranks=ranks, cwd=cwd)
    out, err = io.StringIO(), io.StringIO()
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        with contextlib.chdir(cwd), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(list(map(str, words)))
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


@contextlib.contextmanager
def cores(ranks: int) -> Iterator[None]:
    """Several ranks run while no other test's do: on shared cores they take ten times as long."""
    if ranks == 1:
        yield
        return
    with (Path(tempfile.gettempdir()) / "hvi-tests-ranks.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def process(*words: object, ranks: int = 1, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """A command to its end, in a process of its own or in several: slower by a second of imports."""
    with cores(ranks):
        return subprocess.run(
            command(*words, ranks=ranks), cwd=cwd, capture_output=True, text=True, check=False, timeout=300
        )


def on_ranks(ranks: int, script: str, *words: object) -> Any:
    """What a script under mpirun prints in its last line, as JSON."""
    python = [sys.executable, "-m", "mpi4py", script, *map(str, words)]
    words = ["mpirun", "-n", str(ranks), *python]
    with cores(ranks):
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


_RUN_ALL = """
import sys
from hvi_fenicsx.commands.cli import main
folder, ranks = sys.argv[1:3]
for name in sys.argv[3:]:
    main(["run", f"{folder}/{name}.toml", "--out", f"{folder}/{name}-{ranks}", "--no-pictures"])
"""


def run_all(folder: Path, scenes: dict[str, dict[str, Any]], ranks: int) -> None:
    """Results FOLDER/NAME-RANKS of all scenes; one start of MPI serves them, since starting it is what takes time."""
    for name, table in scenes.items():
        write_scene(folder / f"{name}.toml", table)
    if ranks == 1:
        for name in scenes:
            hvi("run", folder / f"{name}.toml", "--out", folder / f"{name}-1", "--no-pictures")
        return
    python = [sys.executable, "-m", "mpi4py", "-c", _RUN_ALL, str(folder), str(ranks), *scenes]
    with cores(ranks):
        subprocess.run(["mpirun", "-n", str(ranks), *python], check=True, capture_output=True, timeout=300)


def write_scene(path: Path, table: dict[str, Any]) -> Path:
    """A scene file of these tables."""
    path.write_text(dump_scene(read_tables(table)), encoding="utf-8")
    return path


def summary(folder: Path) -> dict[str, Any]:
    """The run in numbers; NaN and infinity, which are no JSON, are refused."""

    def refuse(word: str) -> None:
        raise ValueError(f"{word} is no JSON")

    found: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"), parse_constant=refuse)
    return found


def contact(folder: Path) -> npt.NDArray[Any]:
    """``contact.csv`` by NumPy."""
    return table(folder / "contact.csv")


def table(file: Path) -> npt.NDArray[Any]:
    """A table of a part's vertices by NumPy, columns by name; empty cells are NaN."""
    names = file.read_text(encoding="utf-8").splitlines()[0].split(",")
    kinds = [(name, "U40" if name == "part" else "f8") for name in names]
    return np.genfromtxt(file, delimiter=",", dtype=kinds, skip_header=1, encoding="utf-8")
