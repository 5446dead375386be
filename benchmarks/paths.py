"""Follow the load paths that benchmarks/paths.toml lists, to the end of each; one line each, and a table.

    ./hvi exec python3 benchmarks/paths.py [--only WORDS] [--write]

``balance``: the work of forces on displacements of path.csv (trapezoidal sums; where a grip moves, the column ``work``)
"""

from __future__ import annotations

import argparse
import copy
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import common
import numpy as np
import numpy.typing as npt

import hvi_fenicsx as hvi
from hvi_fenicsx.api.following import ModelPath
from hvi_fenicsx.model.scene_file import override

LIST = Path(__file__).with_suffix(".toml")
PAGE = common.ROOT / "docs" / "benchmarks" / "paths.md"
HEAD = (
    "path",
    "vertices",
    "rows",
    "folds",
    "jumps",
    "largest factor",
    "end",
    "certified",
    "whole body",
    "balance",
    "processor time, s",
)


def scene(tables: dict[str, Any], name: str, changes: list[str]) -> hvi.Model:
    """A scene of the list, or a demo."""
    if name not in tables:
        return hvi.read_scene(common.DEMOS / f"{name}.toml", changes)
    table = copy.deepcopy(tables[name])
    for change in changes:
        override(table, change)
    return hvi.read_tables(table)


def imbalance(path: ModelPath) -> float:
    """The largest part of the work that is neither stored nor dissipated nor released, relative to the work."""
    contributions = path.run.prepared.problem.contributions
    moved = {where for where, _, contribution in contributions if contribution.conditions}
    sums, potential = np.zeros(len(path.rows)), np.zeros(len(path.rows))
    for part in (part for part in path.parts if part not in moved):
        force, u = path.force(part), path.displacement(part)
        sums[1:] += np.cumsum(0.5 * np.sum((force[1:] + force[:-1]) * np.diff(u, axis=0), axis=1))
        potential += np.sum(force * u, axis=1)
    gripped = any(np.any(path.displacement(part)) for part in moved & set(path.parts))
    work = np.array([row.work for row in path.rows]) if gripped else sums
    return _largest(path, work, potential)


def _largest(path: ModelPath, work: npt.NDArray[np.float64], potential: npt.NDArray[np.float64]) -> float:
    rows = path.rows
    stored = np.array([row.energy for row in rows]) + potential
    lost = np.array([row.dissipated for row in rows]) + np.cumsum([row.released for row in rows])
    left = work - (stored - stored[0]) - (lost - lost[0])
    return float(np.max(np.abs(left - left[0])) / max(np.max(np.abs(work)), np.ptp(stored), 1e-300))


def followed(name: str, given: hvi.Model) -> tuple[Any, ...]:
    """The row of one path."""
    start = time.process_time()
    path = hvi.follow(given)
    seconds = time.process_time() - start
    vertices = sum(len(s.blocks) for s in path.run.prepared.problem.surfaces)
    certified = "all" if not path.uncertified else f"**{len(path.rows) - path.uncertified}**"
    kinds = (len(path.folds), len(path.jumps), f"{path.peak_factor:.6g}")
    end = path.end if path.end in ("reached", "escapes") else f"**{path.end}** ({path.reason})"
    figures = (certified, path.examined, f"{imbalance(path):.0e}", f"{seconds:.1f}")
    return (name, vertices, len(path.rows), *kinds, end, *figures)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", default="", help="paths whose names contain this")
    parser.add_argument("--write", action="store_true", help="the table into docs/benchmarks/paths.md")
    options = parser.parse_args()
    tables = tomllib.loads(LIST.read_text(encoding="utf-8"))
    wanted = [entry for entry in tables.pop("paths") if options.only in entry[0]]
    rows = []
    for name, base, changes in wanted:
        rows.append(followed(name, scene(tables, base, changes)))
        print(*rows[-1], sep="\t", flush=True)
    lost = sum("**" in str(row[6]) for row in rows)
    print(f"{len(rows)} paths, {lost} lost", file=sys.stderr)
    if options.write:
        common.insert(PAGE, "paths", common.table(HEAD, rows))


if __name__ == "__main__":
    main()
