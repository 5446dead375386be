"""What an accuracy costs at degree 1, at degree 2 and at the degree that the program chooses, side by side.

    ./hvi exec python3 benchmarks/degrees.py [--only NAME] [--quantity NAME] [--again] [--limit S] [--write]

Each request runs in a process of its own, at the three degrees in turn, after a run to 90 % that loads the compiled
forms. CPU times are of one rank and of one thread. At degree 2 the true error is the distance to a solution on the same
meshes, refined on (benchmarks/accuracy.py). What is in docs/benchmarks/degrees.json is not measured again. ``--write``
puts the tables of all stored rows into docs/accuracy.md.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass

import accuracy
import common
from mpi4py import MPI

from hvi_fenicsx import read_scene
from hvi_fenicsx.accuracy import control
from hvi_fenicsx.accuracy.control import AccuracyResult, Goal

STORE = accuracy.ROOT / "docs" / "benchmarks" / "degrees.json"
ACCURACIES = (1e-1, 1e-2, 1e-3)
DEGREES: tuple[int | None, ...] = (1, 2, None)
"""None: as the program chooses."""
GIVEN_UP, REFUSED = "given up", "refused"
Key = tuple[str, str, float, int | None]


@dataclass(frozen=True, kw_only=True)
class Row:
    """One request at one degree; ``asked`` is None where the program chose."""

    scene: str
    quantity: str
    requested: float
    asked: int | None
    degree: int | None = None
    estimated: float | None = None
    true: float | None = None
    dofs: int | None = None
    seconds: float | None = None
    why: str | None = None

    @property
    def key(self) -> Key:
        return self.scene, self.quantity, self.requested, self.asked

    def __str__(self) -> str:
        if self.why is not None:
            return self.why
        chosen = f"degree {self.degree}: " if self.asked is None else ""
        true = "" if self.true is None else f", true {self.true:.1e}"
        return f"{chosen}{self.dofs:,}, {self.seconds:.2f} s{true}"


def requests() -> list[tuple[str, str, float]]:
    """All that is asked for, the energy norm first."""
    every = accuracy.REQUESTS.items()
    return [
        (name, quantity, asked)
        for quantity in accuracy.READABLE
        for name, quantities in every
        if quantity in quantities
        for asked in ACCURACIES
    ]


def measured(name: str, quantity: str, requested: float, asked: int | None, largest: int) -> Row:
    """One request, carried out, and at degree 2 checked."""
    _reached(name, quantity, 0.9, asked)
    start = time.process_time()
    reached = _reached(name, quantity, requested, asked)
    seconds = time.process_time() - start
    if reached.why is not None:
        why = f"{REFUSED}: {reached.why}"
        return Row(scene=name, quantity=quantity, requested=requested, asked=asked, seconds=seconds, why=why)
    true = None
    if asked == 2:
        true, _ = accuracy.true_error(reached, accuracy.exact(reached.level.solution.scene), requested, largest)
    return Row(
        scene=name,
        quantity=quantity,
        requested=requested,
        asked=asked,
        degree=reached.degree,
        estimated=reached.steps[-1].error,
        true=true,
        dofs=reached.steps[-1].dofs,
        seconds=seconds,
    )


def _reached(name: str, quantity: str, requested: float, asked: int | None) -> AccuracyResult:
    scene = read_scene(accuracy.ROOT / "demos" / f"{name}.toml").with_solver(degree=asked)
    goal = Goal(requested, quantity)
    return control.solve_to_goal(scene, MPI.COMM_WORLD, goal, accuracy.solver(), lambda line: None)


def in_a_process(key: Key, given: argparse.Namespace) -> Row:
    """One request in a process of its own."""
    words = [sys.executable, __file__, "--one", json.dumps(key), "--largest", str(given.largest)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    name, quantity, requested, asked = key
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=given.limit, env=environment)
    except subprocess.TimeoutExpired:
        why = f"{GIVEN_UP} after {given.limit:g} s"
        return Row(scene=name, quantity=quantity, requested=requested, asked=asked, why=why)
    return Row(**json.loads(done.stdout.splitlines()[-1]))


def stored() -> dict[Key, Row]:
    """The rows measured so far."""
    if not STORE.exists():
        return {}
    return {row.key: row for row in (Row(**row) for row in json.loads(STORE.read_text(encoding="utf-8")))}


def store(rows: Mapping[Key, Row]) -> None:
    """Keep the rows, in the order of the requests: one line each."""
    kept = [rows[key] for r in requests() for asked in DEGREES if (key := (*r, asked)) in rows]
    lines = ",\n".join(json.dumps(asdict(row)) for row in kept)
    aside = STORE.with_suffix(".part")
    aside.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    aside.replace(STORE)


def table(rows: Mapping[Key, Row]) -> str:
    """All requests, degree 1, 2 and the program's choice beside each other."""
    head = ("scene", "quantity", "requested", "degree 1", "degree 2", "chosen", "unknowns, ratio", "time, ratio")
    lines = []
    for request in requests():
        if all((*request, asked) in rows for asked in DEGREES):
            one, two, chosen = (rows[*request, asked] for asked in DEGREES)
            ratios = [_ratio(one.dofs, chosen.dofs), _ratio(one.seconds, chosen.seconds)]
            known = one.why is None and chosen.why is None
            shown = [f"{r:.3g}" if r is not None and known else "" for r in ratios]
            lines.append([request[0], request[1], f"{request[2]:g}", one, two, chosen, *shown])
    return common.table(head, lines)


def gains(rows: Mapping[Key, Row], requested: float) -> Iterator[tuple[str, float, float]]:
    """Degree 1 over the program's choice by scene, in the energy norm: scene, unknowns, time."""
    for name in accuracy.REQUESTS:
        pair = [rows.get((name, "energy", requested, asked)) for asked in (1, None)]
        if all(row is not None and row.why is None for row in pair):
            one, chosen = pair
            yield name, _ratio(one.dofs, chosen.dofs) or 1.0, _ratio(one.seconds, chosen.seconds) or 1.0  # type: ignore[union-attr]


def _ratio(one: float | None, other: float | None) -> float | None:
    return one / other if one and other else None


def mean(values: Sequence[float]) -> float:
    """The geometric mean."""
    return math.exp(sum(map(math.log, values)) / len(values))


def summary(rows: Mapping[Key, Row]) -> str:
    """The geometric means of the gains in the energy norm."""
    head = ("accuracy", "scenes", "unknowns, geometric mean", "time, geometric mean")
    lines = []
    for requested in ACCURACIES:
        if found := list(gains(rows, requested)):
            names, dofs, seconds = zip(*found, strict=True)
            lines.append([f"{requested:g}", ", ".join(names), f"{mean(dofs):.3g}", f"{mean(seconds):.3g}"])
    return common.table(head, lines)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--only", choices=accuracy.REQUESTS, help="one scene")
    options.add_argument("--quantity", choices=accuracy.READABLE, help="one quantity")
    options.add_argument("--again", action="store_true", help="what is in the store too")
    options.add_argument("--limit", type=float, default=1200.0, metavar="S", help="after which a request is given up")
    options.add_argument("--largest", type=int, default=300_000, help="unknowns of a reference")
    options.add_argument("--write", action="store_true", help="tables into docs/accuracy.md, of all that is stored")
    options.add_argument("--one", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.one:
        print(json.dumps(asdict(measured(*json.loads(given.one), given.largest))))
        return
    for name, quantity, requested in requests():
        for asked in DEGREES:
            key, chosen = (name, quantity, requested, asked), (given.only, given.quantity)
            if all(c in (None, k) for c, k in zip(chosen, key, strict=False)) and (given.again or key not in stored()):
                found = in_a_process(key, given)
                print(*key, found, flush=True)
                store({**stored(), key: found})
    if given.write:
        common.insert(accuracy.PAGE, "degrees", table(stored()))
        common.insert(accuracy.PAGE, "gains", summary(stored()))


if __name__ == "__main__":
    main()
