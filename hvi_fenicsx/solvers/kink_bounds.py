"""The convex kinks of the laws as bounds on slips, and which of them are overloaded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..laws import ConvexPart
from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..system.system import System
from ..typing import Array, Integers, Mask
from .law_models import Cells, Full, Majorant


def boxes(system: System, cells: Sequence[Cells]) -> tuple[PETSc.Vec, PETSc.Vec]:
    """The system's bounds cut with the cells of the laws; the very same where no law has a convex kink.

    Args:
        system: the assembled problem.
        cells: by term.
    """
    if not any(len(c.kinks) for c in cells):
        return system.lower, system.upper
    lower, upper = system.lower.copy(), system.upper.copy()
    for term, c in zip(system.terms, cells, strict=True):
        if term.radial:
            _hold_stuck(term, c, lower, upper)
            continue
        dofs, sign, free = _slip_dofs(term)
        low, high = np.where(sign > 0, c.lower, -c.upper), np.where(sign > 0, c.upper, -c.lower)
        lower.array[dofs[free]] = np.maximum(lower.array[dofs], low)[free]
        upper.array[dofs[free]] = np.minimum(upper.array[dofs], high)[free]
    return lower, upper


def overloaded(
    system: System, x: PETSc.Vec, residual: PETSc.Vec, models: Sequence[Majorant | Full], tolerance: float
) -> list[Integers]:
    """Per vertex -1, 0 or 1: where it goes if the kink it sits on cannot carry its force.

    Args:
        system: the assembled problem.
        x: the displacement.
        residual: that of the convex step, H' being taken from within the cell: at the lower end the right derivative,
            from which the kink's jump leads to the left one.
        models: of the step, by term.
        tolerance: relative, of a traction.
    """
    moves = []
    for term, model in zip(system.terms, models, strict=True):
        c, part = model.cells, model.law.convex
        argument = term.argument(x.array_r)
        if term.radial:
            moves.append(_radial_moves(term, model, argument, residual, tolerance))
            continue
        force = np.einsum("md,md->m", term.directions[:, 0, :], term.surface.values(residual.array_r))
        weight = term.surface.weights
        slack = 0.1 * tolerance * term.traction_scale * weight
        _, _, free = _slip_dofs(term)
        down = free & (argument <= c.lower) & (force - weight * _jump(part, c.lower) > slack)
        up = free & (argument >= c.upper) & (force + weight * _jump(part, c.upper) < -slack)
        moves.append(up.astype(np.int64) - down.astype(np.int64))
    return moves


def _hold_stuck(term: LawTerm, cells: Cells, lower: PETSc.Vec, upper: PETSc.Vec) -> None:
    """Both components of a stuck vertex's slip are kept at zero."""
    dofs = term.surface.dofs
    stuck = (cells.index == 0)[:, None] & np.any(np.abs(term.directions) > 0.5, axis=1) & (term.free > 0)
    if len(cells.kinks):
        lower.array[dofs[stuck]] = upper.array[dofs[stuck]] = 0.0


def _radial_moves(
    term: LawTerm, model: Majorant | Full, argument: Array, residual: PETSc.Vec, tolerance: float
) -> Integers:
    """A law of |u_t|: a stuck vertex goes when the force leaves the kink's disc, a free one sticks below the ramp."""
    cells = model.cells
    if not len(cells.kinks):
        return np.zeros(len(argument), dtype=np.int64)
    force = np.einsum("mkd,md->mk", term.directions, term.surface.values(residual.array_r) * term.free)
    weight = term.surface.weights
    disc = weight * model.law.convex.right(np.zeros_like(argument))
    slack = 0.1 * tolerance * term.traction_scale * weight
    go = (cells.index == 0) & (np.linalg.norm(force, axis=1) > disc + slack)
    stick = (cells.index == 1) & (argument <= cells.ramp)
    return go.astype(np.int64) - stick.astype(np.int64)


def _slip_dofs(term: LawTerm) -> tuple[Integers, Array, Mask]:
    """The scalar dof of each slip, the sign of its direction, and whether it is not prescribed."""
    dofs, sign = component_dofs(term.surface.blocks, term.directions[:, 0, :])
    return dofs, sign, term.free[np.arange(len(dofs)), dofs % term.free.shape[1]] > 0


def _jump(part: ConvexPart, at: Array) -> Array:
    """The jump of H' at each position; 0 at infinity."""
    finite = np.where(np.isfinite(at), at, 0.0)
    return np.where(np.isfinite(at), part.right(finite) - part.left(finite), 0.0)
