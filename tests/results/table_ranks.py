"""Prints, as JSON, what the ranks write of some scenes, and what they raise where a disk is full: an mpirun runs it."""

from __future__ import annotations

import contextlib
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from full_disk import room_for
from mpi4py import MPI
from scenes import STEEL, Table, model, quadratic_linear, two_blocks

from hvi_fenicsx import read_tables
from hvi_fenicsx.errors import HviError, NotWrittenError
from hvi_fenicsx.report import reader
from hvi_fenicsx.results import ResultFolder
from hvi_fenicsx.results.whole import write_whole
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.workflow import Solution, finish, prepare

COMM = MPI.COMM_WORLD
SPRING = {"law": "linear_spring", "stiffness": 1e10}
TWO_PARTS = model(7, 3e6, 1e6, quadratic_linear(1e6))
TWO_PARTS["boundary"]["beside"] = {"on": "right", "support": SPRING}
del TWO_PARTS["boundary"]["pull"]
RING: Table = {
    "domain": {"shape": "disk", "radius": 0.5, "mesh_size": 0.15},
    "material": STEEL,
    "body": {"force": [1.0e3, -8.0e4]},
    "boundary": {"ring": {"on": ["lower_arc", "upper_arc"], "friction": SPRING, "support": SPRING}},
}
CUBE: Table = {
    "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [3, 2, 2]},
    "material": STEEL | {"model": "three_dimensional"},
    "boundary": {
        "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
        "press": {"on": "top", "traction": ["1e6*x", 0.0, "-1e6*(1.2 - 1.8*x)"]},
        "floor": {"on": "bottom", "contact": {"gap": "1e-7*x*y"}, "friction": quadratic_linear(1e6)},
    },
}
SCENES = {
    "two parts": TWO_PARTS,
    "ring": RING,
    "cube of degree 2": CUBE | {"solver": {"degree": 2}},
    "bodies": two_blocks("rectangle", [1.0], [[8, 12], [9, 12]], "plane_stress"),
}


def solved(scene: Table) -> Solution:
    """Without an estimate of the error."""
    return finish(prepare(read_tables(scene), COMM), estimating=False)


def written(folder: Path, scene: Table) -> dict[str, Any] | None:
    """The tables of a result; of its arrays the sums, by which numbers of vertices do not count. None but on rank 0."""
    with ResultFolder(COMM, folder) as target:
        write_whole(target, solved(scene), {}, Timer(), print, pictures=False)
        target.commit(read_tables(scene))
    if COMM.rank:
        return None
    arrays = reader.read(folder).arrays
    assert arrays.displacement is not None
    facets = arrays.sides | {part.name: part.facets for part in arrays.parts.values()}
    return {
        "tables": {name: (folder / f"{name}.csv").read_text(encoding="utf-8") for name in ("contact", "boundary")},
        "moments": [float(np.sum(arrays.points[arrays.cells] ** 2)), float(np.sum(arrays.displacement**2))],
        "facets": {name: [len(f), float(np.sum(arrays.points[f] ** 2))] for name, f in facets.items()},
        "parts": {p.name: [float(p.weight.sum()), *(p.weight @ p.normal**2)] for p in arrays.parts.values()},
    }


def without_room(folder: Path) -> list[Any]:
    """What each rank raises where the disk of rank 0 is full."""
    solution = solved(TWO_PARTS)
    try:
        with (
            ResultFolder(COMM, folder / "full") as target,
            room_for(1 << 10) if COMM.rank == 0 else contextlib.nullcontext(),
        ):
            write_whole(target, solution, {}, Timer(), print, pictures=False)
    except NotWrittenError as error:
        return [COMM.allgather(error.reason), sorted(file.name for file in folder.glob("*full*"))]
    raise AssertionError


def main() -> None:
    """All of it, as one line."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(COMM.bcast(name))
        results = {name: written(folder / name, scene) for name, scene in SCENES.items()}
        found = {"results": results, "full": without_room(folder)}
        COMM.barrier()
    if COMM.rank == 0:
        print(json.dumps(found))


if __name__ == "__main__":
    try:
        main()
    except HviError as error:
        sys.exit(str(error))
