"""``contact.csv``: Γc as a plain table, one row per vertex of each part, SI, sorted along the part."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ..certify.contact_state import State
from ..effects import Direction
from ..problem.problem import Problem
from ..typing import Array, Integers
from . import arc_length

COLUMNS = (
    "part",
    "s",
    "x",
    "y",
    "z",
    "u_n",
    "u_t1",
    "u_t2",
    "gap",
    "sigma_n",
    "friction_t1",
    "friction_t2",
    "contact",
    "branch_t",
    "branch_n",
)


def rows(problem: Problem, states: Sequence[State]) -> list[tuple[str, dict[str, Array]]]:
    """The table by part, columns in SI (absent ones left out), gathered on rank 0 (elsewhere empty). Collective."""
    comm = problem.domain.mesh.comm
    found = []
    for state in sorted(states, key=lambda s: s.surface.part):
        columns = _gathered(comm, _columns(problem, state))
        if problem.scales.dimension == 2:
            chained = (
                {"number": arc_length.vertices(problem, state.surface)},
                {"pair": arc_length.edges(problem, state.surface)},
            )
            numbers, pairs = (_gathered(comm, pieces) for pieces in chained)
            if columns:
                found.append((state.surface.part, _along(columns, numbers["number"], pairs["pair"])))
        elif columns:
            found.append((state.surface.part, _sorted(columns)))
    return found


def _columns(problem: Problem, state: State) -> dict[str, Array]:
    scales, d = problem.scales, problem.scales.dimension
    u, p = scales.displacement, scales.stress
    columns = {"x": state.surface.points[:, 0], "y": state.surface.points[:, 1]}
    if d == 3:
        columns["z"] = state.surface.points[:, 2]
    columns["u_n"] = state.normal * u
    for i in range(d - 1):
        columns[f"u_t{i + 1}"] = state.slip[:, i] * u
        columns[f"friction_t{i + 1}"] = state.friction[:, i] * p
    if state.bounds is not None:
        columns["gap"] = state.gap * u
        columns["contact"] = state.contact.astype(float)
    columns["sigma_n"] = state.pressure * p
    for name, directions in (
        ("branch_t", (Direction.SLIP,)),
        ("branch_n", (Direction.OPENING, Direction.PENETRATION)),
    ):
        branch = state.branch(*directions)
        if branch is not None:
            columns[name] = branch.astype(float)
    return columns


def _gathered(comm: MPI.Comm, columns: dict[str, Any]) -> dict[str, Any]:
    pieces = comm.gather(columns, root=0)
    if pieces is None:
        return {}
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in columns}


def _along(columns: dict[str, Array], numbers: Integers, pairs: Integers) -> dict[str, Array]:
    """In 2D along the part, with the arc length s."""
    order, s = arc_length.along(np.column_stack([columns["x"], columns["y"]]), numbers, pairs)
    return {name: values[order] for name, values in columns.items()} | {"s": s}


def _sorted(columns: dict[str, Array]) -> dict[str, Array]:
    """In 3D lexicographically."""
    order = arc_length.lexicographic(np.column_stack([columns[a] for a in "xyz"]))
    return {name: values[order] for name, values in columns.items()}


def write_csv(path: Path, table: Sequence[tuple[str, dict[str, Array]]]) -> None:
    """The table as a file. Rank 0 only."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for part, columns in table:
            size = len(columns["x"])
            cells = [
                [part] * size,
                *([_text(c, v) for v in columns[c]] if c in columns else [""] * size for c in COLUMNS[1:]),
            ]
            writer.writerows(zip(*cells, strict=True))


def _text(column: str, value: float) -> str:
    if not np.isfinite(value):
        return ""
    return str(int(value)) if column in ("contact", "branch_t", "branch_n") else repr(float(value))
