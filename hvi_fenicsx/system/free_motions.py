"""Rigid motions that nothing holds and on which the loads are in balance: a singular problem that has solutions.

Along such a motion the whole problem is constant: contact, laws and conditions do not see it. Its field is the null
space of every tangent there is. It is attached to the matrix; preconditioners and direct solvers, which need a regular
one, get it with one unknown pinned for each motion. Any two solutions differ by such motions; the one returned is
orthogonal to them in L².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.problem import Problem
from ..problem.vectors import null_space
from ..rigid import Mode
from ..runtime.mpi import total
from ..typing import Array, Entities


@dataclass(frozen=True)
class Freedom:
    """The free motions of a system.

    Attributes:
        modes: what they are. null_space: their fields in the unknowns' components, orthonormal (Euclidean).
        pins: local owned dofs, sorted; with those held (one for each mode in all), no free motion is left.
    """

    modes: tuple[Mode, ...]
    null_space: PETSc.NullSpace
    pins: Entities


def build(vectors: list[PETSc.Vec], modes: Sequence[Mode]) -> Freedom:
    """The freedom of modes whose fields (consumed) are these vectors of unknowns. Collective."""
    spanned = null_space(vectors)
    return Freedom(tuple(modes), spanned, _pins(vectors[0].comm.tompi4py(), [v.array_r for v in vectors]))


def fields(problem: Problem, modes: Sequence[Mode]) -> list[fem.Function]:
    """The modes as displacements. Collective."""
    points = np.asarray(problem.points / problem.scales.length)
    found = []
    for mode in modes:
        field = fem.Function(problem.space)
        field.x.array[:] = problem.bodies.motion(points, mode).ravel()
        found.append(field)
    return found


def settle(problem: Problem, modes: Sequence[Mode], u: fem.Function) -> None:
    """Take out of u what it has, in L², of these modes: the least rigid motion. Collective."""
    free = fields(problem, modes)
    gram = np.array([[_product(a, b) for b in free] for a in free])
    parts = np.linalg.solve(gram, [_product(u, a) for a in free])
    for part, field in zip(parts, free, strict=True):
        u.x.array[:] -= part * field.x.array


def _product(u: fem.Function, v: fem.Function) -> float:
    """∫ u·v dx."""
    return total(u.function_space.mesh.comm, float(fem.assemble_scalar(fem.form(ufl.inner(u, v) * ufl.dx))))


def _pins(comm: MPI.Comm, columns: list[Array]) -> Entities:
    """Dofs at which the columns (orthonormal) are far from dependent: always the largest row of what is left.

    Collective.
    """
    rows = np.array(columns).T.copy()
    pins = []
    for _ in columns:
        size = np.linalg.norm(rows, axis=1)
        here = (float(size.max(initial=0.0)), comm.rank)
        there = comm.allreduce(here, op=MPI.MAXLOC)
        at = int(size.argmax()) if there[1] == comm.rank else None
        row = comm.bcast(rows[at] / size[at] if at is not None else None, root=there[1])
        pins += [] if at is None else [at]
        rows = rows - np.outer(rows @ row, row)
    return np.array(sorted(pins), dtype=np.int32)
