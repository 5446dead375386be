"""Runs cases one after the other: ``python3 -m hostile.child FOLDER KINDS SEED FIRST LAST STEP``.

The number of a case is on disk before it runs, so that whoever finds this process dead or stuck knows of what. What
came of each is a line of FOLDER/outcomes.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from runs import command

from hvi_fenicsx.commands.cli import main
from hvi_fenicsx.runtime.processes import SIGNALS

from . import folders, requests, surroundings
from .case import Case
from .judge import Outcome, faults, owned, snapshot

KINDS = {"surroundings": [*folders.KINDS, *surroundings.KINDS], "requests": requests.KINDS}
LIMIT = 200.0
"""Seconds that a case may take in a process of its own."""


def outcome(kinds: str, seed: int, number: int, folder: Path) -> dict[str, object]:
    """Make a case, which its kinds, seed and number alone decide; run it, judge it."""
    place = folder / str(number)
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    (folder / "now").write_text(f"{number} is made\n", encoding="utf-8")
    kind = KINDS[kinds][number % len(KINDS[kinds])]
    case = kind(random.Random(f"{seed}-{number}"), place)
    (folder / "now").write_text(f"{number} {case.what}\n", encoding="utf-8", errors="replace")
    before, mine, began = snapshot(place), owned(place), time.monotonic()
    code, text = _alone(case, place) if case.alone else _within(case, place, folder / "words")
    found = Outcome(code, text, before, snapshot(place), mine)
    wrong, seconds = faults(case, found, place), round(time.monotonic() - began, 1)
    if not wrong:
        shutil.rmtree(place, ignore_errors=True)
    told = {
        "number": number,
        "kind": kind.__name__,
        "what": case.what,
        "code": code,
        "seconds": seconds,
        "faults": wrong,
    }
    return told | ({"words": list(case.words), "text": text[-3000:]} if wrong else {"text": text[-200:]})


def _within(case: Case, place: Path, words: Path) -> tuple[int, str]:
    """Exit code and words of the program within this process."""
    handlers, code, trace = {number: signal.getsignal(number) for number in SIGNALS}, 1, ""
    with words.open("w+b") as file:
        try:
            with contextlib.chdir(place), _written_to(file):
                code = main(list(case.words))
        except SystemExit as end:  # --help, as in a process
            code = int(end.code or 0)
        except BaseException:
            trace = traceback.format_exc()
        for number, handler in handlers.items():
            signal.signal(number, handler)
        return code, words.read_bytes().decode(errors="replace") + trace


@contextlib.contextmanager
def _written_to(file: IO[bytes]) -> Iterator[None]:
    """Both outputs of this process and its children go into a file."""
    kept = [os.dup(1), os.dup(2)]
    try:
        for number in (1, 2):
            os.dup2(file.fileno(), number)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, saved in enumerate(kept, 1):
            os.dup2(saved, number)
            os.close(saved)


def _alone(case: Case, place: Path) -> tuple[int, str]:
    """Exit code and words of a process."""
    changed = {**os.environ, **case.environment}
    variables = {name: value for name, value in changed.items() if value is not None}
    words = ["/bin/sh", "-c", case.shell if case.shell != '"$@"' else 'exec "$@"', "sh", *command(*case.words)]
    words[words.index("-m") : words.index("-m")] = ["-P"]
    process = subprocess.Popen(
        words, cwd=place, env=variables, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        start_new_session=True,
    )  # fmt: skip
    if case.end_after:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(case.end_after)
        process.terminate()
    try:
        raw, _ = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raw, _ = process.communicate()
        return 1, _decoded(raw, case) + "\nhangs"
    return process.returncode, _decoded(raw, case)


def _decoded(raw: bytes, case: Case) -> str:
    """The words of a process; two bytes for each character where the environment asks for that."""
    text = raw.decode(errors="replace")
    return text.replace("\0", "") if case.environment.get("PYTHONIOENCODING") == "utf-16" else text


def run(folder: Path, kinds: str, seed: int, first: int, last: int, step: int) -> None:
    """All cases from first to last."""
    for number in range(first, last, step):
        told = outcome(kinds, seed, number, folder)
        with open(folder / "outcomes", "a", encoding="utf-8") as file:
            file.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    run(Path(sys.argv[1]), sys.argv[2], *map(int, sys.argv[3:7]))
