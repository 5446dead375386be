"""Results of others, computed again: one command runs all cases and writes `docs/verification.md` with its pictures.

    ./hvi exec python3 verification/verify.py                    all cases, some minutes
    ./hvi exec python3 verification/verify.py glued_bar tijs     some; the page is not written

Exit code 0 if all numbers agree or their miss is explained in `cases.toml` (`miss`), else 1.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import page
import quantities
from outcomes import Outcome

ROOT = Path(__file__).resolve().parents[1]
CASES = Path(__file__).with_name("cases.toml")


def cases(names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """The cases of these names, or all."""
    with CASES.open("rb") as file:
        every: list[dict[str, Any]] = tomllib.load(file)["case"]
    unknown = set(names) - {case["name"] for case in every}
    if unknown:
        raise SystemExit(
            f"there is no case {', '.join(sorted(unknown))}; there are {', '.join(c['name'] for c in every)}"
        )
    return [case for case in every if not names or case["name"] in names]


def carried_out(case: Mapping[str, Any], folder: Path) -> Outcome:
    """One case in a process of its own."""
    words = [sys.executable, "-m", "hvi_fenicsx", *case["command"], "--out", str(folder), "--no-pictures"]
    start = time.perf_counter()
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - start
    if done.returncode:
        sys.stderr.write(done.stderr)
    found = [None if done.returncode else quantities.made(table).read(folder) for table in case["expected"]]
    return Outcome(case=case, folder=folder, found=found, code=done.returncode, seconds=seconds)


def unexplained(outcome: Outcome) -> int:
    """How many numbers are off without an explanation."""
    return sum(not c.agrees and "miss" not in c.expected for c in outcome.comparisons())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="CASE")
    options = parser.parse_args()
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(options.names):
            outcomes.append(carried_out(case, Path(folder) / case["name"]))
            print(*page.rows(outcomes[-1]), sep="\n", flush=True)
        if not options.names:
            page.write(outcomes, ROOT / "docs")
    return 1 if sum(map(unexplained, outcomes)) else 0


if __name__ == "__main__":
    sys.exit(main())
