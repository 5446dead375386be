"""Has a process run the cases, and goes on in a new one where it died or hung."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from runs import ROOT

LIMIT = 300.0
"""Seconds that a case may take."""


def attack(folder: Path, kinds: str, seed: int, cases: range) -> list[dict[str, Any]]:
    """What came of each case.

    Args:
        folder: for the cases; what was at fault stays there.
        kinds: of cases, a name of `child.KINDS`.
        seed: of the cases.
        cases: their numbers.
    """
    first, found = cases.start, []
    while first < cases.stop:
        fault = _child(folder, kinds, seed, range(first, cases.stop, cases.step))
        if not fault:
            break
        number, _, what = (folder / "now").read_text(encoding="utf-8").strip().partition(" ")
        found.append({"number": int(number), "what": what, "code": None, "faults": [fault]})
        first = int(number) + cases.step
    file = folder / "outcomes"
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    return sorted([*map(json.loads, lines), *found], key=lambda told: int(told["number"]))


def _child(folder: Path, kinds: str, seed: int, cases: range) -> str:
    """How a process ended; nothing if well."""
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT}/tests/support:{os.environ.get('PYTHONPATH', '')}"}
    words = [sys.executable, "-m", "hostile.child", folder, kinds, seed, cases.start, cases.stop, cases.step]
    (folder / "now").write_text(f"{cases.start} start", encoding="utf-8")
    with (folder / "errors").open("w") as errors:
        process = subprocess.Popen(
            list(map(str, words)), env=environment, stdout=errors, stderr=errors, stdin=subprocess.DEVNULL
        )
        while process.poll() is None:
            time.sleep(0.5)
            if time.time() - (folder / "now").stat().st_mtime > LIMIT:
                process.kill()
                process.wait()
                return "hangs"
    return f"ended with {process.returncode}: {(folder / 'errors').read_text()[-2000:]}" if process.returncode else ""
