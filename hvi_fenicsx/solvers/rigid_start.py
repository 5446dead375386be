"""A start for bodies that contact alone holds: as rigid bodies, they rest on a few vertices of Γc.

From contact closed everywhere, the active set shrinks to the vertices that bear the load. Where a body rolls or tips on
the way, some of these sets do not hold it: the tangent is singular, and a step has any length. From the vertices on
which the rigid body rests, the active set grows instead. The rigid position of least potential energy is a linear
programme in the at most six motions of each body. Its multipliers are the reactions; where the support is statically
determinate, no elastic deformation changes them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..runtime.mpi import agree, on_root
from ..system import free_motions
from ..system.system import LawModel, System
from ..typing import Array, Entities, Integers
from .closed_start import contact_dofs
from .context import SolveContext
from .thresholds import Thresholds


@dataclass(frozen=True, kw_only=True)
class _RigidProgramme:
    """min work·a + Σ cost |slips a| subject to lower <= rows a <= upper, over the amplitudes a (k,) of rigid motions.

    Attributes:
        work: minus the work of the load, (k,).
        rows: contact displacements by amplitude, (m, k).
        lower: lower bounds of contact displacements, (m,).
        upper: upper bounds of contact displacements, (m,).
        slips: arguments of the laws by amplitude, (n, k).
        forward: cost of a positive slip, (n,).
        backward: cost of a negative slip, (n,).
    """

    work: Array
    rows: Array
    lower: Array
    upper: Array
    slips: Array
    forward: Array
    backward: Array

    def solve(self, thresholds: Thresholds) -> tuple[Array, npt.NDArray[np.intp]] | None:
        """The amplitudes, and k rows at most that bear the load; None where nothing stops the body."""
        size = max(float(np.max(np.abs(v[np.isfinite(v)]), initial=0.0)) for v in (self.lower, self.upper)) or 1.0
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        sides = np.concatenate([self.rows[high], -self.rows[low]])
        found = self._minimise(sides, np.concatenate([self.upper[high], -self.lower[low]]) / size)
        if found.status != 0:
            return None
        number = np.concatenate([np.flatnonzero(high), np.flatnonzero(low)])
        touching = np.flatnonzero(found.slack <= thresholds.touching)
        # multipliers are negative: the largest reactions first
        first = touching[np.argsort(found.ineqlin.marginals[touching], kind="stable")]
        return found.x[: len(self.work)] * size, number[_independent(sides, first, thresholds.independent)]

    def _minimise(self, sides: Array, limits: Array) -> Any:
        """Solve by HiGHS; unknowns are the amplitudes, then the positive and the negative parts of the slips."""
        from scipy import sparse
        from scipy.optimize import linprog

        n, k = self.slips.shape
        cost = np.concatenate([self.work, self.forward, self.backward])
        one = sparse.eye_array(n)
        return linprog(
            cost / (float(np.max(np.abs(cost))) or 1.0),
            A_ub=sparse.hstack([sides, sparse.csr_array((len(sides), 2 * n))]),
            b_ub=limits,
            A_eq=sparse.hstack([self.slips, -one, one]) if n else None,
            b_eq=np.zeros(n) if n else None,
            bounds=[(None, None)] * k + [(0, None)] * (2 * n),
            method="highs",
        )


def _independent(rows: Array, order: npt.NDArray[np.intp], least: float) -> npt.NDArray[np.intp]:
    """The rows, taken in this order, that the ones before do not span."""
    chosen: list[int] = []
    basis = np.zeros((0, rows.shape[1]))
    for i in order:
        rest = rows[i] - basis.T @ (basis @ rows[i])
        length = float(np.linalg.norm(rest))
        if length > least * float(np.linalg.norm(rows[i])):
            basis, chosen = np.vstack([basis, rest / length]), [*chosen, int(i)]
    return np.array(chosen, dtype=np.intp)


def at_rest(
    context: SolveContext, models: Callable[[PETSc.Vec], Sequence[LawModel]], rtol: float
) -> tuple[PETSc.Vec, int] | None:
    """The displacement of bodies at rest on their supports, and iterations of the linear solver. Collective.

    Args:
        context: the system, its solver, and the rigid motions that the supports leave.
        models: what takes the place of the laws at a displacement, by term.
        rtol: relative tolerance of the linear solve.

    Returns:
        None where contact does not hold the bodies, or where springs do: the tangent is then never singular.
    """
    system, modes = context.system, context.solvability.kernel
    bounded = all(np.isfinite([*astuple(term.law.growth)]).all() for term in system.terms)
    if not modes or not bounded or system.free_motions is not None or not system.bounds:
        return None
    motions = [system.unknowns(field) for field in free_motions.fields(system.problem, modes)]
    x = system.undisplaced()
    held = _rest(system, x, motions, context.options.thresholds)
    return None if held is None else (x, context.solver.newton_step(x, held, models(x), rtol).linear)


def _rest(system: System, x: PETSc.Vec, motions: Sequence[PETSc.Vec], thresholds: Thresholds) -> Entities | None:
    """Move x, rigidly, to where it rests; the owned unknowns that bear the load. Collective."""
    comm, dofs = system.comm, contact_dofs(system)
    programme, counts = _programme(system, x, motions, dofs)
    found = on_root(comm, lambda: programme.solve(thresholds))
    if found is None:
        return None
    for amplitude, motion in zip(found[0], motions, strict=True):
        x.axpy(float(amplitude), motion)
    start = sum(counts[: comm.rank])
    mine = np.sort(dofs[found[1][(found[1] >= start) & (found[1] < start + len(dofs))] - start]).astype(np.int32)
    low, high = system.lower.array_r[mine], system.upper.array_r[mine]
    x.array[mine] = np.where(x.array_r[mine] - low <= high - x.array_r[mine], low, high)
    return mine


def _programme(
    system: System, x: PETSc.Vec, motions: Sequence[PETSc.Vec], dofs: Integers
) -> tuple[_RigidProgramme, list[int]]:
    """The programme of all ranks, and how many rows each rank has. Collective."""
    rows = np.column_stack([motion.array_r[dofs] for motion in motions])
    bounds = [v.array_r[dofs] - x.array_r[dofs] for v in (system.lower, system.upper)]
    slips, forward, backward = _slips(system, motions)
    gathered = agree(system.comm, (rows, *bounds, slips, forward, backward))
    rows, lower, upper, slips, forward, backward = (np.concatenate(parts) for parts in zip(*gathered, strict=True))
    programme = _RigidProgramme(
        work=np.array([-float(system.load.dot(motion)) for motion in motions]),
        rows=rows,
        lower=lower,
        upper=upper,
        slips=slips,
        forward=forward,
        backward=backward,
    )
    return programme, [len(part[1]) for part in gathered]


def _slips(system: System, motions: Sequence[PETSc.Vec]) -> tuple[Array, Array, Array]:
    """The laws' arguments by each motion (n, k), and the resistance at infinity in both directions, (n,).

    Each component of a slip that is a vector counts as an argument of its own.
    """
    slips: list[Array] = [np.zeros((0, len(motions)))]
    forward: list[Array] = [np.zeros(0)]
    backward: list[Array] = [np.zeros(0)]
    for term in system.terms:
        by_motion = [term.slip(motion.array_r).ravel() for motion in motions]
        weights = term.surface.weights.repeat(term.directions.shape[1])
        slips.append(np.column_stack(by_motion))
        forward.append(weights * max(term.law.growth.plus, 0.0))
        backward.append(weights * max(term.law.growth.minus, 0.0))
    return np.concatenate(slips), np.concatenate(forward), np.concatenate(backward)
