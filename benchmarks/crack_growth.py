"""A double cantilever followed until the crack has grown over half of the glue, and the same by a loop of single runs.

    ./hvi exec python3 benchmarks/crack_growth.py [--vertices 63 125 250 500] [--increments 200] [--write]

Processor time of each path by phase, with the exponents of events and time over vertices. The loop solves one scene
for each of evenly spaced factors on the coarsest of the meshes, in one process, as `hvi run` does, and without its
start and files; one `hvi run` is measured beside it. What the loop does not see is counted from the path followed
exactly on the same mesh. ``--write`` puts the tables into docs/benchmarks/paths.md.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import DEMOS, ROOT, insert, table

import hvi_fenicsx as hvi
from hvi_fenicsx.modelling.following import ModelPath

PAGE = ROOT / "docs" / "benchmarks" / "paths.md"
HEAD = ("vertices", "rows", "jumps", "largest factor")
GROWN = 4.5
"""The factor at which half of the glue is broken."""


def scene(folder: Path, vertices: int) -> Path:
    """The demo with so many vertices on its glue and four cells through the arm."""
    geometry = (DEMOS / "double_cantilever.geo").read_text(encoding="utf-8")
    counts = {"= 61;": f"= {round((vertices - 1) * 3 / 7) + 1};", "= 351;": f"= {vertices};", "n = 12;": "n = 4;"}
    for old, new in counts.items():
        assert old in geometry
        geometry = geometry.replace(old, new)
    here = folder / str(vertices)
    here.mkdir()
    (here / "double_cantilever.geo").write_text(geometry, encoding="utf-8")
    file = here / "scene.toml"
    file.write_text((DEMOS / "double_cantilever.toml").read_text(encoding="utf-8"), encoding="utf-8")
    return file


def followed(file: Path, vertices: int) -> tuple[Any, ...]:
    """The row of one mesh."""
    start = time.process_time()
    path = hvi.follow(hvi.read_scene(file), to=GROWN)
    seconds = time.process_time() - start
    assert path.end == "reached", path.reason
    phases = path.run.prepared.timer.seconds
    certified = "all" if not path.uncertified else f"**{len(path.rows) - path.uncertified}**"
    figures = (f"{seconds:.1f}", f"{phases['solve'] / sum(phases.values()):.2f}")
    return (vertices, len(path.rows), len(path.jumps), f"{path.peak_factor:.4g}", certified, *figures)


def exponents(rows: list[tuple[Any, ...]]) -> tuple[str, str]:
    """Of events and time over vertices, between the two finest meshes, as a row."""
    (n0, e0, *_, t0, _), (n1, e1, *_, t1, _) = rows[-2:]
    events, seconds = (np.log(b / a) / np.log(n1 / n0) for a, b in ((e0, e1), (float(t0), float(t1))))
    return f"exponents of rows and processor time, {n0} to {n1} vertices", f"{events:.2f}; {seconds:.2f}"


def loop(file: Path, increments: int) -> dict[str, Any]:
    """Single runs at evenly spaced factors."""
    start, forces, failed = time.process_time(), [], 0
    for factor in GROWN * np.arange(1, increments + 1) / increments:
        given = hvi.read_scene(file, [f'boundary.pull.displacement=["free",{float(factor) * 1e-3!r}]'])
        solution = hvi.solve(given, estimate=False)
        failed += not solution.converged
        forces.append((factor, solution.resultant("pull")[1]))
    return {"seconds": time.process_time() - start, "failed": failed, "forces": forces}


def one_run(file: Path) -> float:
    """Processor time of one `hvi run`, with its start and files, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = file.parent / "run"
    words = ["python3", "-m", "hvi_fenicsx", "run", str(file), "--out", str(out)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compared(file: Path, increments: int) -> list[tuple[str, str]]:
    """What the loop costs, and what it does not see."""
    start = time.process_time()
    stable = hvi.follow(hvi.read_scene(file), to=GROWN)
    seconds = time.process_time() - start
    exact = hvi.follow(hvi.read_scene(file, ['path.follow="exact"']), to=GROWN)
    single = loop(file, increments)
    other = elsewhere(stable, single["forces"])
    unstable = sum(not row.stable for row in exact.rows)
    peak = max(abs(stable.force("pull")[:, 1]))
    return [
        ("path: processor time, s", f"{seconds:.1f}"),
        (f"loop of {increments}: processor time, s", f"{single['seconds']:.1f}"),
        (f"{increments} times `hvi run`, from one, s", f"{increments * one_run(file):.0f}"),
        ("loop: runs without a certified equilibrium", str(single["failed"])),
        ("loop: states that the path does not have at this factor", str(other)),
        ("path: jumps, which the loop does not see; energy that they release, J/m", released(stable)),
        ("exact path: unstable states, which no loop reaches; limit points", f"{unstable}; {len(exact.folds)}"),
        ("path: largest force, N/m", f"{peak:.1f}"),
    ]


def released(path: ModelPath) -> str:
    """How many jumps, and what they release, J/m."""
    return f"{len(path.jumps)}; {sum(row.released for row in path.rows):.3g}"


def elsewhere(path: ModelPath, forces: list[tuple[float, float]]) -> int:
    """How many forces, by factor, are not those of the path; between two rows these are linear in the factor."""
    along = path.force("pull")[:, 1]
    factors, straight = np.array([row.factor for row in path.rows]), [row.event != "jump" for row in path.rows[1:]]
    near = 1e-6 * np.max(np.abs(along))
    found = 0
    for factor, force in forces:
        here = np.flatnonzero((factors[:-1] <= factor) & (factor <= factors[1:]) & straight)
        share = (factor - factors[here]) / np.maximum(factors[here + 1] - factors[here], 1e-300)
        found += not np.any(np.abs(along[here] + share * (along[here + 1] - along[here]) - force) <= near)
    return found


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--vertices", type=int, nargs="+", default=[63, 125, 250, 500])
    words.add_argument("--increments", type=int, default=200)
    words.add_argument("--write", action="store_true")
    options = words.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = [scene(Path(folder), vertices) for vertices in options.vertices]
        rows = []
        for file, vertices in zip(files, options.vertices, strict=True):
            rows.append(followed(file, vertices))
            print(*rows[-1], sep="\t", flush=True)
        print(*exponents(rows), flush=True)
        beside = [exponents(rows), *compared(files[0], options.increments)]
    for row in beside:
        print(*row, sep="\t")
    if options.write:
        head = (*HEAD, "certified", "processor time, s", "share of the follower")
        insert(PAGE, "crack growth", table(head, rows))
        insert(PAGE, "single runs", table(("", ""), beside))


if __name__ == "__main__":
    main()
