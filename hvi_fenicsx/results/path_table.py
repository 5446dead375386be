"""``path.csv``: a load path as a plain table, one row per state, SI."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from ..load_path import LoadPath, PathRow
from ..runtime import writing

COLUMNS = ("row", "factor", "event", "part", "x", "y", "z", "energy", "work", "dissipated", "stable")


def columns(path: LoadPath) -> tuple[str, ...]:
    """The names of the columns: force and mean displacement of each driven part follow the common ones.

    Args:
        path: the path.
    """
    axes = "xyz"[: path.dimension]
    return (*COLUMNS, *(f"{part}.{kind}{axis}" for part in path.parts for kind in "fu" for axis in axes))


def write_csv(file: Path, path: LoadPath) -> None:
    """Write the table. Rank 0 only.

    Args:
        file: where to.
        path: the path.
    """
    with writing.told(file), file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns(path))
        writer.writerows(_cells(path, number, row) for number, row in enumerate(path.rows))


def _cells(path: LoadPath, number: int, row: PathRow) -> list[Any]:
    point = [] if row.point is None else [repr(float(c)) for c in row.point]
    energies = [repr(float(e)) for e in (row.energy, row.work, row.dissipated)]
    measured = [v for part in path.parts for values in (row.forces[part], row.displacements[part]) for v in values]
    place = [row.part or "", *point, *[""] * (3 - len(point))]
    factor = repr(float(row.factor))
    return [number, factor, row.event, *place, *energies, int(row.stable), *(repr(float(v)) for v in measured)]
