"""``contact.csv``: Γc as a plain table, one row per vertex of each part, SI, sorted along the part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ..certify.contact_state import ContactState
from ..effects import Direction
from ..problem.problem import Problem
from ..report.contact_part import ContactPart
from ..typing import Array
from . import table_file

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


def columns(problem: Problem, state: ContactState) -> dict[str, Array]:
    """What this rank knows of a part's columns, SI, (m,) each; NaN where the table is empty.

    Args:
        problem: what was solved.
        state: of the part.
    """
    scales, d = problem.scales, problem.scales.dimension
    u, p = scales.displacement, scales.stress
    found = {"x": state.surface.points[:, 0], "y": state.surface.points[:, 1]}
    if d == 3:
        found["z"] = state.surface.points[:, 2]
    found["u_n"] = state.normal_displacement * u
    for i in range(d - 1):
        found[f"u_t{i + 1}"] = state.tangential_displacement[:, i] * u
        if state.resists_slip:  # else σ_t is a support's, at a corner
            found[f"friction_t{i + 1}"] = state.friction[:, i] * p
    if state.bounds is not None:
        found["gap"] = np.where(np.isfinite(state.gap), state.gap * u, np.nan)
        found["contact"] = state.contact.astype(float)
    found["sigma_n"] = state.pressure * p
    for name, directions in (
        ("branch_t", [direction for direction in Direction if direction.tangential]),
        ("branch_n", [direction for direction in Direction if direction.normal]),
    ):
        branch = state.branch(*directions)
        if branch is not None:
            found[name] = branch.astype(float)
    return found


def write(comm: MPI.Comm, path: Path, rows: Mapping[str, ContactPart]) -> None:
    """Write the table. Collective.

    Args:
        comm: the ranks.
        path: the file.
        rows: this rank's stretch of the rows of each part of Γc, by its name, in the order of the table.

    Raises:
        InputError: on all ranks alike: it cannot be written.
    """
    table_file.write(comm, path, COLUMNS, (cells({name: own}) for name, own in rows.items()))


def cells(parts: Mapping[str, ContactPart]) -> Iterator[tuple[str, ...]]:
    """The table below its header, as texts.

    Args:
        parts: the parts of Γc by name, in the order of the table.
    """
    for name, part in parts.items():
        columns = ([_text(c, value) for value in part[c]] for c in COLUMNS[1:])
        yield from zip([name] * len(part), *columns, strict=True)


def _text(column: str, value: float) -> str:
    if not np.isfinite(value):
        return ""
    return str(int(value)) if column in ("contact", "branch_t", "branch_n") else repr(float(value))
