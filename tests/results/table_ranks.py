"""Prints, as JSON, how tables that all ranks write compare with a gather of all rows on rank 0: an mpirun runs it."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import sys
import tempfile
import tracemalloc
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
from full_disk import room_for
from mpi4py import MPI
from scenes import STEEL, Table, model, quadratic_linear, two_blocks

from hvi_fenicsx import Scene, workflow
from hvi_fenicsx.errors import HviError, InputError, NotWrittenError
from hvi_fenicsx.mesh import nodes
from hvi_fenicsx.report.pictures.draw import PictureProcess
from hvi_fenicsx.report.solution_arrays import SolutionArrays, members
from hvi_fenicsx.results import (
    ResultFolder,
    arc_length,
    array_file,
    boundary_table,
    contact_rows,
    contact_table,
    gathering,
)
from hvi_fenicsx.results.whole import begin_whole
from hvi_fenicsx.runtime.mpi import in_turn, on_root
from hvi_fenicsx.runtime.row_order import RowOrder
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.workflow import Solution, prepare

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
    return workflow.finish(prepare(Scene.model_validate(scene), COMM), estimating=False)


def by_gather(solution: Solution) -> bytes:
    """``contact.csv`` from all rows of each part, gathered and sorted on rank 0; right there alone."""
    assert solution.examination is not None
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerow(contact_table.COLUMNS)
    for state in sorted(solution.examination.states, key=lambda state: state.surface.part):
        columns = {n: joined(v) for n, v in contact_table.columns(solution.problem, state).items()}
        local = solution.problem.space.dofmap.index_map.local_to_global(state.surface.blocks)
        numbers = joined(np.asarray(local, dtype=np.int64))
        edges = joined(arc_length.edges(solution.problem, state.surface)) if "z" not in columns else None
        if COMM.rank == 0:
            csv.writer(stream, lineterminator="\n").writerows(
                told(state.surface.part, in_order(columns, numbers, edges))
            )
    return stream.getvalue().encode()


def in_order(columns: dict[str, Any], numbers: Any, edges: Any) -> dict[str, Any]:
    """All rows of a part in the order of the table, in the plane with the arc length."""
    points = np.column_stack([columns[axis] for axis in "xyz" if axis in columns])
    if edges is None:
        order = np.lexsort(np.round(points / np.ptp(points, axis=0).max(), 9).T[::-1])
        return {n: v[order] for n, v in columns.items()}
    order, s = arc_length.along(points, numbers, edges)
    return {n: v[order] for n, v in columns.items()} | {"s": s}


def told(part: str, columns: dict[str, Any]) -> Iterator[list[str]]:
    """Rows as texts: whole numbers for what is counted, nothing where a value is missing."""
    for row in range(len(columns["x"])):
        values = [columns[name][row] if name in columns else np.nan for name in contact_table.COLUMNS[1:]]
        yield [part, *(text(n, v) for n, v in zip(contact_table.COLUMNS[1:], values, strict=True))]


def text(name: str, value: float) -> str:
    if not np.isfinite(value):
        return ""
    return f"{value:.0f}" if name.startswith(("contact", "branch")) else repr(float(value))


def joined(values: Any) -> Any:
    """The rows of all ranks on rank 0; elsewhere this rank's, with which nothing is compared."""
    pieces = COMM.gather(values)
    return values if pieces is None else np.concatenate(pieces)


def tables(folder: Path, solutions: dict[str, Solution]) -> dict[str, Any]:
    """By scene: whether the two files are the same as by a gather, and this table's rows and former rows by rank."""
    found = {}
    for name, solution in solutions.items():
        assert solution.examination is not None
        rows = contact_rows.of_parts(solution.problem, solution.examination.states)
        contact_table.write(COMM, folder / "contact.csv", rows)
        boundary_table.write(COMM, folder / "boundary.csv", boundary_table.rows(solution))
        wanted = by_gather(solution)
        had = sum(len(state.surface.blocks) for state in solution.examination.states)
        has = sum(len(part.vertices) for part in rows.values())
        same = on_root(COMM, lambda wanted=wanted: (folder / "contact.csv").read_bytes() == wanted)  # type: ignore[misc]
        found[name] = {"same": same, "ordered": on_root(COMM, lambda: ordered(folder / "boundary.csv"))}
        found[name] |= {"had": COMM.allgather(had), "has": COMM.allgather(has)}
    return found


def archives(folder: Path, solutions: dict[str, Solution]) -> dict[str, Any]:
    """By scene: the members of ``solution.npz`` that are not those of a gather, and the largest share of its rows."""
    found = {}
    for name, solution in solutions.items():
        states = solution.examination.states if solution.examination else ()
        own = gathering.own_arrays(solution, None, contact_rows.of_parts(solution.problem, states))
        array_file.write(COMM, folder / "solution.npz", members(own))
        cells = COMM.allgather(len(own.cells))
        every = gathered(solution, own)
        same = COMM.bcast(differing(folder / "solution.npz", every) if COMM.rank == 0 else [])
        found[name] = {"differing": same, "share": max(cells) / sum(cells)}
    return found


def gathered(solution: Solution, own: SolutionArrays) -> dict[str, Any]:
    """The same arrays by a gather of all that ranks know: facets that several know are found among all on rank 0."""
    assert solution.examination is not None
    space, arrays = solution.problem.space, {key: np.asarray(values) for key, values in members(own).items()}
    found = {key: joined(values) if values.ndim else values for key, values in arrays.items()}

    def facets(local: Any) -> Any:
        numbers = space.dofmap.index_map.local_to_global(nodes.linear_facets(space, local).ravel())
        every = joined(np.sort(np.asarray(numbers, dtype=np.int64).reshape(-1, own.points.shape[1]), axis=1))
        return np.unique(every, axis=0)

    found |= {f"side:{name}": facets(local) for name, local in solution.problem.part_facets.items()}
    for state in solution.examination.states:
        rows, every = found[f"part:{state.surface.part}:vertices"], facets(state.surface.facets)
        found[f"part:{state.surface.part}:facets"] = every[np.isin(every, rows).all(axis=1)]
    return found


def differing(file: Path, arrays: dict[str, Any]) -> list[str]:
    """The members of an archive whose bytes are not those that numpy writes of arrays; where they are others, all."""
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    with zipfile.ZipFile(file) as one, zipfile.ZipFile(stream) as other:
        if one.namelist() != other.namelist() or one.testzip() is not None:
            return other.namelist()
        return [name for name in other.namelist() if one.read(name) != other.read(name)]


def uneven_archive(folder: Path) -> list[Any]:
    """Of arrays of several blocks, some of them on one rank alone: what is not as a gather's, and the peak of rank 0.

    The memory that rank 0 has taken meanwhile is told as a part of the arrays.
    """
    chance, last = np.random.default_rng(COMM.rank), COMM.rank == COMM.size - 1
    own = {
        "long": chance.random((500_000 + 100_001 * COMM.rank, 3)),
        "of the last": chance.integers(0, 9, (1_000_001 * last, 2)),
        "singles": chance.random(7 * COMM.rank).astype(np.float32),
        "number": np.asarray(2 + COMM.rank),
        "none": np.empty((0, 4)),
    }
    tracemalloc.start()
    array_file.write(COMM, folder / "uneven.npz", own)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    every = {name: joined(values) if values.ndim else values for name, values in own.items()}
    size = sum(values.nbytes for values in every.values())
    return COMM.bcast([differing(folder / "uneven.npz", every) if COMM.rank == 0 else [], peak / size])


def without_room(folder: Path) -> list[Any]:
    """What each rank raises where the disk of rank 0 is full after a quarter of what the ranks send."""
    with room_for(1 << 22) if COMM.rank == 0 else contextlib.nullcontext():
        try:
            array_file.write(COMM, folder / "full.npz", {"values": np.ones((16 << 20) // COMM.size // 8)})
        except NotWrittenError as error:
            return [COMM.allgather(error.reason), sorted(file.name for file in folder.glob("*full*"))]
    raise AssertionError


def ordered(file: Path) -> bool:
    """Whether the rows of each part of a table are those of one vertex each, sorted by their points."""
    with file.open(encoding="utf-8") as stream:
        places = [(row["part"], *(float(row[axis] or 0.0) for axis in "xyz")) for row in csv.DictReader(stream)]
    parts = list(dict.fromkeys(place[0] for place in places))
    return [(parts.index(str(part)), *x) for part, *x in places] == sorted(
        {(parts.index(str(part)), *x) for part, *x in places}
    )


def orders() -> dict[str, Any]:
    """Of random rows, with equal ones, whether all ranks together have them sorted, and the longest stretch."""
    chance = np.random.default_rng(COMM.rank)
    found = {}
    for name, rows in {"none": 0, "few": 2, "uneven": 3000 * COMM.rank, "last alone": 5000 * (COMM.rank == 2)}.items():
        keys = chance.integers(0, 9, (rows, 3)).astype(float) * [1, -1, 0.5]
        order, ranks = RowOrder.of(COMM, keys), np.full(rows, COMM.rank)
        mine, of_rank = order.sorted(keys), order.sorted(ranks)
        every, every_rank, all_mine, all_of_rank = (joined(values) for values in (keys, ranks, mine, of_rank))
        by_key = np.lexsort(every.T[::-1])
        pairs = ((all_mine, every), (all_of_rank, every_rank))
        same = COMM.rank > 0 or all(np.array_equal(one, other[by_key]) for one, other in pairs)
        found[name] = [same, max(COMM.allgather(len(mine))), COMM.allreduce(rows)]
    return found


def failing() -> list[Any]:
    """Which ranks acted, and what each raised, where the second of them (the only one, if there is no second) fails."""
    acted = []

    def act() -> None:
        acted.append(COMM.rank)
        if COMM.rank == min(1, COMM.size - 1):
            raise OSError(28, "No space left on device", "contact.csv")

    try:
        in_turn(COMM, act)
    except InputError as error:
        return [COMM.allgather(len(acted)), COMM.allgather(str(error))]
    raise AssertionError


class Pen:
    """Stands for the process that draws: keeps whether it was told to begin."""

    begun = False

    def begin(self) -> None:
        """The line that lets it draw."""
        self.begun = True


def begun_early(folder: Path) -> bool:
    """Whether rank 0 lets pictures be drawn before the error is estimated."""
    pen = Pen() if COMM.rank == 0 else None
    solution = solved(model(2, friction=quadratic_linear(1e6)))
    with ResultFolder(COMM, folder / "r") as result:
        begin_whole(result, solution, Timer(), print, cast("PictureProcess | None", pen))
        result.discard()
    return bool(COMM.bcast(pen is not None and pen.begun))


def main() -> None:
    """All of it, as one line."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(COMM.bcast(name))
        solutions = {name: solved(scene) for name, scene in SCENES.items()}
        found = {"tables": tables(folder, solutions), "archives": archives(folder, solutions)}
        found |= {"begun": begun_early(folder), "uneven": uneven_archive(folder), "full": without_room(folder)}
        COMM.barrier()
    found |= {"orders": orders(), "failing": failing()}
    if COMM.rank == 0:
        print(json.dumps(found))


if __name__ == "__main__":
    try:
        main()
    except HviError as error:
        sys.exit(str(error))
