"""Free motions: rigid motions that nothing holds and on which the loads do no work. Solutions exist, but not one only.

Along such a motion the energy is constant: contact, laws and conditions do not change. Its field is in the null space
of every tangent. That null space is attached to the matrix; preconditioners and direct solvers need a regular matrix,
and get it with one unknown pinned for each motion. Two solutions differ by such motions; the one returned is orthogonal
to them in L².
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.problem import Problem
from ..problem.rigid_part import BodyMotions, RigidPart
from ..problem.vectors import null_space
from ..rigid import Mode
from ..runtime import forms
from ..runtime.mpi import total
from ..typing import Array, Entities
from . import existence


@dataclass(frozen=True)
class FreeMotions:
    """The free motions of a system.

    Attributes:
        modes: the motions.
        null_space: their fields in the components of the unknowns, orthonormal (Euclidean).
        pins: local owned dofs, sorted; where they are held (one for each mode, over all ranks), no motion is free.
    """

    modes: tuple[Mode, ...]
    null_space: PETSc.NullSpace
    pins: Entities


def create(vectors: list[PETSc.Vec], modes: Sequence[Mode]) -> FreeMotions:
    """The free motions of a system. Collective.

    Args:
        vectors: the modes' fields in the components of the unknowns; made orthonormal in place.
        modes: the motions.
    """
    spanned = null_space(vectors)
    return FreeMotions(tuple(modes), spanned, _pins(vectors[0].comm.tompi4py(), [v.array_r for v in vectors]))


def fields(problem: Problem, modes: Sequence[Mode]) -> list[fem.Function]:
    """Rigid motions as displacement fields. Collective.

    Args:
        problem: the problem.
        modes: the motions.
    """
    points = np.asarray(problem.points / problem.scales.length)
    found = []
    for mode in modes:
        field = fem.Function(problem.space)
        field.x.array[:] = problem.bodies.motion(points, mode).ravel()
        found.append(field)
    return found


def rigid_part(problem: Problem, unknowns: Callable[[fem.Function], PETSc.Vec], *, cartesian: bool) -> RigidPart | None:
    """That of the motions which conditions leave and the elastic operator does not see; None for none. Collective.

    Across an interface they leave no strain only up to the rounding of its integrals, so they are not taken there.

    Args:
        problem: the problem.
        unknowns: makes the unknowns of a displacement field.
        cartesian: whether these are Cartesian components at all vertices.
    """
    if problem.bulk.foundation is not None or problem.interfaces:
        return None
    if not cartesian:
        return _rigid_part(problem, unknowns)
    return problem.once("rigid part of unknowns", problem.fixed.tobytes(), lambda: _rigid_part(problem, unknowns))


def _rigid_part(problem: Problem, unknowns: Callable[[fem.Function], PETSc.Vec]) -> RigidPart | None:
    modes = existence.motions(problem, contact_closed=False)
    motions = [unknowns(field) for field in fields(problem, modes)]
    if not motions:
        return None
    for motion in motions:
        motion.array[problem.fixed_here] = 0.0
    values, moving = np.array([motion.array_r for motion in motions]), np.array([mode.body for mode in modes])
    labels, every = problem.bodies.labels[np.arange(values.shape[1]) // problem.scales.dimension], []
    for body in np.unique(moving):
        places = np.flatnonzero(labels == body)
        own = values[moving == body][:, places]
        every.append(BodyMotions(places=places, owned=len(places), values=own))
    return RigidPart(problem.domain.mesh.comm, every)


def remove_free_motions(problem: Problem, modes: Sequence[Mode], u: fem.Function) -> None:
    """Make a displacement orthogonal, in L², to the free motions. Collective.

    Args:
        problem: the problem.
        modes: the free motions.
        u: the displacement, changed in place.
    """
    free = fields(problem, modes)
    gram = np.array([[_product(a, b) for b in free] for a in free])
    parts = np.linalg.solve(gram, [_product(u, a) for a in free])
    for part, field in zip(parts, free, strict=True):
        u.x.array[:] -= part * field.x.array


def _product(u: fem.Function, v: fem.Function) -> float:
    """∫ u·v dx."""
    return total(u.function_space.mesh.comm, float(fem.assemble_scalar(forms.compiled(ufl.inner(u, v) * ufl.dx))))


def _pins(comm: MPI.Comm, columns: list[Array]) -> Entities:
    """Dofs at which the columns (orthonormal) are far from dependent: always the largest remaining row. Collective."""
    rows = np.array(columns).T.copy()
    pins: list[int] = []
    for _ in columns:
        size = np.linalg.norm(rows, axis=1)
        here = (float(size.max(initial=0.0)), comm.rank)
        there = comm.allreduce(here, op=MPI.MAXLOC)
        row = None
        if there[1] == comm.rank:
            pin = int(size.argmax())
            pins.append(pin)
            row = rows[pin] / size[pin]
        row = comm.bcast(row, root=there[1])
        rows = rows - np.outer(rows @ row, row)
    return np.array(sorted(pins), dtype=np.int32)
