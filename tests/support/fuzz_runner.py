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
from pathlib import Path
from typing import Any

import damage_study
import tomli_w
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
    written = code in (0, 3, 4) if number < STUDY else code == 0
    lacking = (_faults if number < STUDY else _faults_of_study)(case / "out") if written and COMM.rank == 0 else []
    left = sorted(os.listdir(case)) if COMM.rank == 0 else []  # rank 0 removes the case, the others may come late
    return found | {"files": left, "faults": lacking}


def _made(number: int, folder: Path, case: Path) -> list[str]:
    """Write a case; the arguments of its call. Rank 0 only."""
    shutil.rmtree(case, ignore_errors=True)
    case.mkdir()
    (folder / "now").write_text(f"{number}\n", encoding="utf-8")
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


def _faults_of_study(result: Path) -> list[str]:
    """What a study's folder lacks: all points of the sound scene are certified."""
    lacking = [name for name in ("study.json", "study.csv", "report.html", "time.png") if not (result / name).is_file()]
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
