"""A whole result: every file of a folder that is being written but its log, in the order in which one needs another.

Tables are comma-separated values, in SI: ``contact.csv``, ``boundary.csv``, ``path.csv``.
"""

from __future__ import annotations

import contextlib
import csv
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..certify import placed_forces
from ..model import Model, dump_scene
from ..paths.load_path import LoadPath, PathRow
from ..problem import references, spaces
from ..problem.contact_surface import own_nodes
from ..problem.stress import stress_of_parts
from ..problem.vectors import NodalForces
from ..report import page, solution_arrays
from ..report.solution_arrays import CONTACT_LENGTHS, CONTACT_STRESSES, ContactPart, ReportError, SolutionArrays
from ..runtime import writing
from ..runtime.cost import Timer
from ..runtime.mpi import joined, on_root
from ..typing import Array, Entities
from ..workflow import Solution
from . import gathering, vtk_fields
from .output_folder import ResultFolder
from .summary import summary

_WHOLE = ("contact", "branch_t", "branch_n")
CONTACT = ("part", "s", "x", "y", "z", *CONTACT_LENGTHS, *CONTACT_STRESSES, *_WHOLE)
"""The columns of ``contact.csv``."""
_QUANTITIES = ("", "u_", "traction_", "reaction_")
"""The vertex, its displacement, the part's load there, what the part's support, contact and laws put on the body."""
BOUNDARY = ("part", *(quantity + axis for quantity in _QUANTITIES for axis in "xyz"))
"""Those of ``boundary.csv``."""
_PATH = ("row", "factor", "event", "part", "x", "y", "z", "energy", "work", "dissipated", "stable")


def write_whole(
    folder: ResultFolder,
    solution: Solution,
    given: Mapping[str, Any],
    timer: Timer,
    tell: Callable[[str], None],
    *,
    pictures: bool = True,
    report: bool = True,
    process: page.PictureProcess | None = None,
) -> dict[str, Any]:
    """Write all files but ``run.log``. Collective.

    Args:
        folder: being written.
        solution: what was found.
        given: further entries of the summary.
        timer: where time goes.
        tell: is given a line on rank 0 where pictures or page cannot be made; that does not cost the run.
        pictures: whether pictures are drawn.
        report: whether the page is written.
        process: draws the pictures, on rank 0; by default one that begins here.

    Returns:
        The summary, on all ranks.
    """
    work, comm, solved = folder.work, folder.comm, solution.solve_result
    with timer("output"), contextlib.ExitStack() as stack:
        sigma = None if solved is None else stress_of_parts(solution.problem.bulk, solved.u)
        arrays, record = gathering.solution_arrays(solution, sigma), {**summary(solution), **given}
        on_root(comm, lambda: _write_basis(folder, solution.scene, arrays, record))
        if pictures and comm.rank == 0:
            process = process or stack.enter_context(page.picture_process(work))
            process.begin()
        _write_fields(work, solution, sigma)
        if pictures:
            on_root(comm, lambda: made("pictures", tell, lambda: process and process.finish()), asleep=True)
        record["time"] = timer.report()
        on_root(comm, lambda: write_record(work, record))
        if report:
            on_root(comm, lambda: made("report", tell, lambda: page.write(work)))
    record["time"] = timer.report()
    on_root(comm, lambda: write_record(work, record))
    return record


def _write_basis(folder: ResultFolder, scene: Model, arrays: SolutionArrays | None, record: dict[str, Any]) -> None:
    """Write what pictures are drawn from. Rank 0 only."""
    assert arrays is not None
    work = folder.work
    if arrays.parts:
        write_table(work / "contact.csv", CONTACT, contact_rows(arrays.parts))
    solution_arrays.save(work / solution_arrays.FILE, arrays)
    writing.text(work / "scene.toml", dump_scene(scene, folder.target))
    write_record(work, record)


def _write_fields(folder: Path, solution: Solution, sigma: Array | None) -> None:
    """Write the fields for ParaView and ``boundary.csv``. Collective."""
    problem, mode = solution.problem, solution.solvability.direction
    states = () if solution.examination is None else solution.examination.states
    if sigma is not None:
        vtk_fields.write_body(folder / "displacement.pvd", solution, sigma)
    elif mode is not None:
        vtk_fields.write_escape(folder / "displacement.pvd", problem, mode)
    if states:
        vtk_fields.write_contact(folder / "contact.pvd", problem, states)
    rows = list(boundary_rows(solution))
    on_root(problem.comm, lambda: write_table(folder / "boundary.csv", BOUNDARY, rows))


def write_record(folder: Path, record: Mapping[str, Any]) -> None:
    """Write ``summary.json``. Rank 0 only.

    Args:
        folder: where to.
        record: the summary.
    """
    writing.text(folder / "summary.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def made(what: str, tell: Callable[[str], None], make: Callable[[], object]) -> None:
    """Make pictures or a page from the other files of a result; that they cannot be made costs a line. Rank 0 only.

    Args:
        what: what is made.
        tell: is given the line.
        make: makes it.

    Raises:
        NotWrittenError: a file could not be written: then the result is not whole.
    """
    try:
        make()
    except ReportError as error:
        tell(f"{what}: {error}")


def write_table(file: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table: numbers with all their digits, nothing where there is none. Rank 0 only.

    Args:
        file: where to.
        header: the names of the columns.
        rows: its cells.

    Raises:
        NotWrittenError: it cannot be written.
    """
    with writing.told(file), file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(header)
        table.writerows([_text(cell) for cell in row] for row in rows)


def _text(cell: Any) -> Any:
    return "" if isinstance(cell, float) and not math.isfinite(cell) else cell


def contact_rows(parts: Mapping[str, ContactPart]) -> Iterator[tuple[Any, ...]]:
    """The rows of ``contact.csv``, the parts one after the other. Rank 0 only.

    Args:
        parts: by their names, as :func:`.gathering.contact_parts` finds them.
    """
    for name, part in parts.items():
        yield from zip([name] * len(part), *(_column(part, column) for column in CONTACT[1:]), strict=True)


def _column(part: ContactPart, name: str) -> list[float | int | None]:
    """The cells of a column; whole numbers are counts and the numbers of pieces."""
    values: Any = part[name].tolist()
    return [int(v) if math.isfinite(v) else None for v in values] if name in _WHOLE else values


def boundary_rows(solution: Solution) -> Iterator[tuple[Any, ...]]:
    """The rows of ``boundary.csv``: vertices of every boundary table and of the sides of interfaces, by their points.

    To be asked for all of them on all ranks; those on rank 0 are the table's. Collective.

    Args:
        solution: what was found.
    """
    problem = solution.problem
    loads = placed_forces.loads(problem) if solution.forces is None else solution.forces.loads
    facets = {name: problem.part_facets[name] for name in solution.scene.parts}
    for one in problem.interfaces:
        facets[f"{one.name}{placed_forces.SECOND}"] = problem.domain.facets([one.sides.second])
    for name, own in facets.items():
        rows = joined(problem.comm, _at_vertices(solution, loads, name, own))
        order = np.lexsort(rows[:, problem.dimension - 1 :: -1].T)
        yield from ((name, *row) for row in rows[order].tolist())


def _at_vertices(solution: Solution, loads: Mapping[str, NodalForces], part: str, facets: Entities) -> Array:
    """The numbers at the vertices of a part that this rank owns, (m, 12); NaN: none. Collective."""
    problem, forces = solution.problem, solution.forces
    blocks = own_nodes(problem.space, facets)
    d, scales = problem.dimension, problem.scales
    found = np.full((len(blocks), len(_QUANTITIES), 3), np.nan)
    found[:, 0, :d] = problem.positions[blocks, :d]
    if part in loads:
        found[:, 2, :d] = loads[part].at(blocks) * scales.force / references.lumped(problem, facets)[blocks, None]
    if solution.solve_result is not None and forces is not None:
        found[:, 1, :d] = spaces.values(problem.space, solution.solve_result.u.x.array)[blocks] * scales.displacement
        reaction = forces.reactions.get(part)
        found[:, 3, :d] = 0.0 if reaction is None else reaction.at(blocks) * scales.force
    return found.reshape(len(blocks), len(BOUNDARY) - 1)


def write_path(file: Path, path: LoadPath) -> None:
    """Write ``path.csv``: force and mean displacement of each driven part follow the common columns. Rank 0 only.

    Args:
        file: where to.
        path: the path.
    """
    measured = (f"{part}.{kind}{axis}" for part in path.parts for kind in "fu" for axis in "xyz"[: path.dimension])
    rows = ((number, *_path_row(path, row)) for number, row in enumerate(path.rows))
    write_table(file, (*_PATH, *measured), rows)


def _path_row(path: LoadPath, row: PathRow) -> Iterator[Any]:
    point: Any = [] if row.point is None else row.point.tolist()
    yield from (float(row.factor), row.event, row.part, *point, *[None] * (3 - len(point)))
    yield from (float(row.energy), float(row.work), float(row.dissipated), int(row.stable))
    for part in path.parts:
        yield from (*map(float, row.forces[part]), *map(float, row.displacements[part]))
