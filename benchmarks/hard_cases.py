"""The hard-case matrix: run it, and write its table.

    python3 benchmarks/hard_cases.py run [--method auto ...] [--only KEY ...] [--cells N] [--limit SECONDS]
        [--sample NUMBER SEED] [--out FILE]
    python3 benchmarks/hard_cases.py report [--table hard_wide] [--out FILE]
    python3 benchmarks/hard_cases.py list [--table hard_wide]

``run`` starts one worker for the cases on one rank and one, through mpirun, for those on two; each works its cases off
in one process and adds a line to the results after each. Finished ones are not done again. A worker that crashes, or
is silent for too long, is started anew, and the case it was at counts as unsolved.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from covering import Case, Table, cases

HERE = Path(__file__).resolve().parent
AXES = HERE / "hard_cases.toml"
TABLES = ("hard_cases", "hard_wide")
SILENCE = 10.0
"""A worker that writes nothing for so many time limits, in wall time, hangs."""

Record = dict[str, Any]


def main() -> int:
    """The command line."""
    options = _options()
    table = Table.read(HERE / f"{options.table}.toml")
    options.limit = options.limit or table.data["limit"]
    options.out = options.out or HERE.parent / "results" / f"{options.table}.jsonl"
    listed = [c for c in cases(table) if not options.only or c.key in options.only]
    if options.command == "run":
        listed = _sampled([c for c in listed if c["cells"] <= (options.cells or c["cells"])], options.sample)
    if options.command == "list":
        print("\n".join(f"{c.number:3} {c.key} {c.values}" for c in listed))
    elif options.command == "report":
        import hard_report

        hard_report.write(options.table, table, listed, read(options.out), HERE.parent / "docs")
    elif options.worker:
        _work(table, [c for c in listed if c["ranks"] == options.worker], options)
    else:
        for ranks in table.axes["ranks"]:
            _supervise(ranks, table, listed, options)
    return 0


def _sampled(listed: list[Case], sample: list[int] | None) -> list[Case]:
    """So many cases in the random order of a seed: a larger sample has those of a smaller one, too."""
    if sample is None:
        return listed
    number, seed = sample
    return random.Random(seed).sample(listed, len(listed))[:number]


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["run", "report", "list"])
    parser.add_argument("--table", choices=TABLES, default=TABLES[0], help="the axes (hard_cases)")
    parser.add_argument("--method", nargs="+", help="methods, by default all there are")
    parser.add_argument("--only", nargs="+", metavar="KEY", help="cases, by default all there are")
    parser.add_argument("--cells", type=int, help="run no larger cases")
    sample = "so many of them, drawn with a seed"
    parser.add_argument("--sample", type=int, nargs=2, metavar=("NUMBER", "SEED"), help=sample)
    limit = "processor time for one case and one method, by default the table's"
    parser.add_argument("--limit", type=float, metavar="SECONDS", help=limit)
    parser.add_argument("--out", type=Path, help="file of results (results/TABLE.jsonl)")
    parser.add_argument("--worker", type=int, metavar="RANKS", help=argparse.SUPPRESS)
    return parser.parse_args()


def read(path: Path) -> list[Record]:
    """The results so far."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def _supervise(ranks: int, table: Table, listed: list[Case], options: argparse.Namespace) -> None:
    """Start workers until one ends by itself with nothing left to do."""
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.touch()
    if not any(c["ranks"] == ranks for c in listed):
        return
    while (code := _watched(_command(ranks), options.out, SILENCE * options.limit)) != 0:
        if not _bury(options.out, f"the process ended with {code}"):
            raise SystemExit(f"a worker on {ranks} ranks ended with {code} before its first case")


def _command(ranks: int) -> list[str]:
    own = [sys.executable, *(["-m", "mpi4py"] if ranks > 1 else []), str(HERE / "hard_cases.py")]
    launch = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return [*launch, *own, *sys.argv[1:], "--worker", str(ranks)]


def _watched(command: list[str], out: Path, silence: float) -> int:
    """Run a worker; kill it when the results do not grow any more."""
    # Ranks that wait would otherwise take the processors from those that work, where there are fewer of them.
    worker = subprocess.Popen(command, start_new_session=True, env={"OMPI_MCA_mpi_yield_when_idle": "1", **os.environ})
    while worker.poll() is None:
        time.sleep(1.0)
        if time.time() - max(out.stat().st_mtime, _started_at(worker.pid)) > silence:
            os.killpg(worker.pid, signal.SIGKILL)
    return worker.returncode


def _started_at(pid: int) -> float:
    try:
        return Path(f"/proc/{pid}").stat().st_mtime
    except FileNotFoundError:
        return 0.0


def _bury(out: Path, reason: str) -> bool:
    """Make a result of the case that was begun last and not ended."""
    records = read(out)
    if not records or records[-1]["outcome"] != "begun":
        return False
    _append(out, {**records[-1], "outcome": "failed", "reason": reason})
    return True


def _append(out: Path, record: Record) -> None:
    with out.open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")


def _work(table: Table, listed: list[Case], options: argparse.Namespace) -> None:
    from hard_run import COMM, attempt, methods

    from hvi_fenicsx.runtime import processes

    processes.die_with_parent(signal.SIGKILL)  # mpirun, when it is killed: its ranks are no members of its group
    done = {(r["key"], r["method"]) for r in read(options.out) if r["outcome"] != "begun"}
    COMM.barrier()  # all ranks have read before the first one writes
    for case, method in _open(listed, options.method or methods(), done):
        begun = {"key": case.key, "number": case.number, "method": method, "ranks": COMM.size, "limit": options.limit}
        if COMM.rank == 0:
            _append(options.out, {**begun, "outcome": "begun"})
        record = {**begun, **attempt(case, table.data, method, options.limit)}
        if COMM.rank == 0:
            _append(options.out, record)
            print(told(record), flush=True)


def told(record: Record) -> str:
    """A result in a line; its time is that of the limit, processor time."""
    took = f"{record['cpu']:.1f} s of processor time"
    return f"{record['number']} {record['method']} {record['outcome']}, {took}: {record['reason']}".rstrip(": ")


def _open(listed: list[Case], wanted: list[str], done: set[tuple[str, str]]) -> Iterator[tuple[Case, str]]:
    return ((c, m) for c in listed for m in wanted if (c.key, m) not in done and _fits(c, m))


def _fits(case: Case, method: str) -> bool:
    """``branch`` is for the unsmoothed law only."""
    return method != "branch" or case["smoothing"] == "exact"


if __name__ == "__main__":
    sys.exit(main())
