"""The convex kinks of the laws as bounds on slips, and which of them are overloaded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..laws import ConvexPart
from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..system.equations import Cells, VertexModel
from ..system.system import System
from ..typing import Array, Integers, Mask


def slip_bounds(system: System, cells: Sequence[Cells]) -> tuple[PETSc.Vec, PETSc.Vec]:
    """The system's bounds, with those that keep each vertex in its cell. Collective.

    Args:
        system: the assembled problem.
        cells: by term.

    Returns:
        Lower and upper bounds; the system's own vectors where no law has a convex kink.
    """
    if not any(len(c.kinks) for c in cells):
        return system.lower, system.upper
    lower, upper = system.lower.copy(), system.upper.copy()
    for term, c in zip(system.terms, cells, strict=True):
        hold = _hold_stuck if term.radial else _keep_in_cells
        hold(term, c, lower, upper)
    return lower, upper


def held_on(
    terms: Sequence[LawTerm], bounds: tuple[PETSc.Vec, PETSc.Vec], drops: Sequence[Array]
) -> tuple[PETSc.Vec, PETSc.Vec]:
    """The bounds, with those that hold some signed slips where they are to be.

    Args:
        terms: the laws.
        bounds: lower and upper ones.
        drops: where each slip is held, NaN where it is not, by term, (m,) each.
    """
    lower, upper = (bound.copy() for bound in bounds)
    for term, at in zip(terms, drops, strict=True):
        if term.radial:
            continue
        dofs, sign, free = _slip_dofs(term)
        on = free & np.isfinite(at)
        lower.array[dofs[on]] = upper.array[dofs[on]] = (sign * at * term.stretch)[on]
    return lower, upper


def _keep_in_cells(term: LawTerm, cells: Cells, lower: PETSc.Vec, upper: PETSc.Vec) -> None:
    """Keep the signed slip of each vertex in its cell."""
    dofs, sign, free = _slip_dofs(term)
    least, most = cells.lower * term.stretch, cells.upper * term.stretch
    low, high = np.where(sign > 0, least, -most), np.where(sign > 0, most, -least)
    lower.array[dofs[free]] = np.maximum(lower.array[dofs], low)[free]
    upper.array[dofs[free]] = np.minimum(upper.array[dofs], high)[free]


def overloaded(
    system: System, x: PETSc.Vec, residual: PETSc.Vec, models: Sequence[VertexModel], slack: float
) -> list[Integers]:
    """To which cell a vertex moves whose kink cannot carry its force: -1, 0 or 1, (m,) by term.

    Args:
        system: the assembled problem.
        x: the displacement.
        residual: of the convex step, H' being taken from inside of the cell: at the lower end the right derivative;
            the left one differs from it by the kink's jump.
        models: of the step, by term.
        slack: traction by which the kink may be exceeded, relative to the law's scale.
    """
    left = _left_to_radial(system, x, residual, models)
    moves, spare = [], [_spare(*pair, left) for pair in zip(system.terms, models, strict=True)]
    for number, (term, model) in enumerate(zip(system.terms, models, strict=True)):
        excess = slack * system.references.traction_scale(term) * term.weights
        argument = term.argument(x.array_r)
        if term.radial:
            others = sum(spare[:number] + spare[number + 1 :], np.zeros_like(left))
            needed = np.sign(left) * np.maximum(np.abs(left) - others, 0.0)
            moves.append(_radial_moves(term, model, argument, needed, excess))
        else:
            moves.append(_signed_moves(term, model, argument, residual, excess))
    return moves


def _left_to_radial(system: System, x: PETSc.Vec, residual: PETSc.Vec, models: Sequence[VertexModel]) -> Array:
    """The residual (n,) without what contact and the kinks of signed slips hold: laws of |u_t| need not carry that."""
    lower, upper = system.lower.copy(), system.upper.copy()
    for term, model in zip(system.terms, models, strict=True):
        if not term.radial:
            _keep_in_cells(term, model.cells, lower, upper)
    held = (x.array_r <= lower.array_r) & (residual.array_r > 0)
    held |= (x.array_r >= upper.array_r) & (residual.array_r < 0)
    return np.where(held, 0.0, residual.array_r)


def _signed_moves(term: LawTerm, model: VertexModel, argument: Array, residual: PETSc.Vec, excess: Array) -> Integers:
    """The moves for a law of a signed slip."""
    c, part, weight = model.cells, model.law.convex, term.weights
    force = np.einsum("md,md->m", term.directions[:, 0, :], term.surface.values(residual.array_r))
    _, _, free = _slip_dofs(term)
    down = free & (argument <= c.lower) & (force - weight * _jump(part, c.lower) > excess)
    up = free & (argument >= c.upper) & (force + weight * _jump(part, c.upper) < -excess)
    return up.astype(np.int64) - down.astype(np.int64)


def _hold_stuck(term: LawTerm, cells: Cells, lower: PETSc.Vec, upper: PETSc.Vec) -> None:
    """Keep the length of a stuck vertex's vector at zero: its components, but an opening only from growing."""
    if term.length is None or not len(cells.kinks):
        return
    both_ways = term.length.two_sided()
    free = (cells.index == 0)[:, None] & (term.free > 0)
    stuck = term.surface.dofs[free & np.any(np.abs(term.directions[:, both_ways]) > 0.5, axis=1)]
    lower.array[stuck] = upper.array[stuck] = 0.0
    for i in np.flatnonzero(~both_ways):
        dofs, sign = component_dofs(term.surface.blocks, term.directions[:, i])
        closed = free[np.arange(len(dofs)), dofs % free.shape[1]]
        above, below = dofs[closed & (sign > 0)], dofs[closed & (sign < 0)]
        upper.array[above] = np.minimum(upper.array[above], 0.0)
        lower.array[below] = np.maximum(lower.array[below], 0.0)


def _slip_dofs(term: LawTerm) -> tuple[Integers, Array, Mask]:
    """The scalar dof of each slip, the sign of its direction, and whether it is not prescribed."""
    dofs, sign = component_dofs(term.surface.blocks, term.directions[:, 0, :])
    return dofs, sign, term.free[np.arange(len(dofs)), dofs % term.free.shape[1]] > 0


def _jump(part: ConvexPart, at: Array) -> Array:
    """The jump of H' at each position; 0 at infinity."""
    finite = np.where(np.isfinite(at), at, 0.0)
    return np.where(np.isfinite(at), part.right(finite) - part.left(finite), 0.0)


def _radial_moves(term: LawTerm, model: VertexModel, argument: Array, needed: Array, excess: Array) -> Integers:
    """The moves for a law of a length: a stuck vertex goes if its kink cannot carry its force, a slow one sticks."""
    cells = model.cells
    if not len(cells.kinks):
        return np.zeros(len(argument), dtype=np.int64)
    go = (cells.index == 0) & (np.linalg.norm(_pulls(term, needed), axis=1) > _disc(term, model) + excess)
    stick = (cells.index == 1) & (argument <= cells.ramp)
    return go.astype(np.int64) - stick.astype(np.int64)


def _disc(term: LawTerm, model: VertexModel) -> Array:
    """The largest force that the kink of a law carries, (m,)."""
    return term.weights * model.law.convex.right(np.zeros_like(term.weights))


def _spare(term: LawTerm, model: VertexModel, forces: Array) -> Array:
    """What the kink of a law of a length can carry of each component where it carries all of the others, (n,)."""
    spare, cells = np.zeros_like(forces), model.cells
    if term.radial and len(cells.kinks):
        squares = _pulls(term, forces) ** 2
        rest = _disc(term, model)[:, None] ** 2 - np.sum(squares, axis=1, keepdims=True) + squares
        room = np.sqrt(np.maximum(rest, 0.0)) * (cells.index == 0)[:, None] * _factors(term)
        room[:, _opens(term)] *= squares[:, _opens(term)] > 0.0
        spare[term.surface.dofs] = np.einsum("mkd,mk->md", np.abs(term.directions), room) * term.free
    return spare


def _pulls(term: LawTerm, forces: Array) -> Array:
    """The tractions that carry minus the forces (n,) along a law's components, each alone, times area, (m, k)."""
    along = -np.einsum("mkd,md->mk", term.directions, term.surface.values(forces) * term.free) / _factors(term)
    along[:, _opens(term)] = np.maximum(along[:, _opens(term)], 0.0)
    return along


def _factors(term: LawTerm) -> Array:
    return np.ones(term.directions.shape[1]) if term.length is None else np.array(term.length.factors)


def _opens(term: LawTerm) -> Mask:
    """Which components are openings, that nothing holds the other way, (k,)."""
    return np.zeros(term.directions.shape[1], dtype=bool) if term.length is None else ~term.length.two_sided()
