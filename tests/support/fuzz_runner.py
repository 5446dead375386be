"""Runs damaged cases one after the other in one process, or under mpirun: fuzz_runner.py FOLDER FIRST LAST STEP.

The number of a case is on disk before it runs, so that whoever finds this process dead or stuck knows of what. What
came of each is a line of FOLDER/outcomes: codes, what was done, standard error, traceback, files left.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import damage_search
import damage_study
import tomli_w
from damage_search import SEARCH, TORN_SEARCH
from damage_study import STUDY, TORN
from mpi4py import MPI

from hvi_fenicsx.cli import main

COMM = MPI.COMM_WORLD


def outcome(number: int, folder: Path) -> dict[str, Any]:
    """Make a case, run it, tell what came of it. Collective."""
    case = folder / str(number)
    words = COMM.bcast(_made(number, folder, case) if COMM.rank == 0 else None)
    done = " ".join(words).replace(str(case), "")
    out, err, code, trace = io.StringIO(), io.StringIO(), -1, ""
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([*words, "--out", str(case / "out")])
    except BaseException:
        trace = traceback.format_exc()
    codes = COMM.gather(code)
    found = {"number": number, "done": done, "codes": codes, "error": err.getvalue(), "trace": trace}
    written = code == 0 if STUDY <= number < SEARCH else code in (0, 3, 4)
    lacking = _lacking(number)(case / "out") if written and COMM.rank == 0 else []
    left = sorted(os.listdir(case)) if COMM.rank == 0 else []  # rank 0 removes the case, the others may come late
    return found | {"files": left, "faults": lacking}


def _lacking(number: int) -> Callable[[Path], list[str]]:
    """What tells what a folder lacks."""
    if number >= SEARCH:
        return _faults_of_search
    return _faults if number < STUDY else _faults_of_study


def _made(number: int, folder: Path, case: Path) -> list[str]:
    """Write a case; the arguments of its call. Rank 0 only."""
    shutil.rmtree(case, ignore_errors=True)
    case.mkdir()
    (folder / "now").write_text(f"{number}\n", encoding="utf-8")
    if SEARCH <= number < TORN_SEARCH:
        return damage_search.words(number, case)
    if number >= TORN_SEARCH:
        return _torn_search(number, folder, case)
    if number < TORN:
        return damage_study.words(number, case)
    scene = folder / "sound.toml"
    asked = ["study", str(scene), *damage_study.ASKED]
    if not (folder / "finished").exists():
        scene.write_text(tomli_w.dumps(damage_study.SOUND), encoding="utf-8")
        assert main([*asked, "--out", str(folder / "finished")]) == 0
    done = damage_study.tear(number, folder / "finished", case / "out")
    (folder / "now").write_text(f"{number} {done}\n", encoding="utf-8")
    return [*asked, "--resume"]


def _torn_search(number: int, folder: Path, case: Path) -> list[str]:
    """Tear a copy of a path or a search for equilibria that was stopped, and resume it. Rank 0 only."""
    command = ("path", "equilibria")[number % 2]
    asked, stopped = damage_search.stopped(command, folder)
    done = damage_search.tear(number, stopped, case / "out")
    (folder / "now").write_text(f"{number} {done}\n", encoding="utf-8")
    return [*asked, "--resume"]


def _faults_of_search(result: Path) -> list[str]:
    """What the folder of a path, of a search or of a run of two bodies lacks."""
    table = {"summary.json": "", "scene.toml": "", "run.log": "", "manifest.json": ""}
    lacking = [name for name in table if not (result / name).is_file()]
    with contextlib.suppress(OSError):
        text = (result / "summary.json").read_text(encoding="utf-8")
        record = json.loads(text)
        lacking += ["a summary without NaN"] if "NaN" in text else []
        rows = (record.get("path") or {}).get("rows") or (record.get("equilibria") or {}).get("count")
        lacking += ["report.html"] if rows and not (result / "report.html").is_file() else []
        if record["scene"] == damage_search.STOPPED and not rows:
            lacking.append("the rows of the sound scene")
    return lacking


def _faults_of_study(result: Path) -> list[str]:
    """What a study's folder lacks: all points of the sound scene are certified."""
    lacking = [
        name
        for name in ("study.json", "study.csv", "report.html", "work_precision.png")
        if not (result / name).is_file()
    ]
    with contextlib.suppress(OSError):
        found = json.loads((result / "study.json").read_text(encoding="utf-8"))
        if found["scene"] == "torn" and not all(p["converged"] and p["errors"] for p in found["points"]):
            lacking.append("the certified points")
    return lacking


def _faults(result: Path) -> list[str]:
    """What a result folder lacks."""
    lacking = [
        name for name in ("summary.json", "scene.toml", "run.log", "report.html") if not (result / name).is_file()
    ]
    with contextlib.suppress(OSError):
        if "NaN" in (text := (result / "summary.json").read_text(encoding="utf-8")):
            lacking.append("a summary without NaN")
        json.loads(text)
    return lacking


def run(folder: Path, first: int, last: int, step: int) -> None:
    """All cases from first to last. Collective."""
    for number in range(first, last, step):
        found = outcome(number, folder)
        if COMM.rank == 0:
            with open(folder / "outcomes", "a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
            shutil.rmtree(folder / str(number), ignore_errors=True)
        COMM.barrier()


if __name__ == "__main__":
    run(Path(sys.argv[1]), *map(int, sys.argv[2:5]))
