"""The state of Γc at a given displacement: gaps, slips, tractions, pieces of the laws; from (u, problem) alone.

Tractions are nodal residual forces over lumped areas (design.md). Where a component is prescribed, the residual holds
the support's reaction too, so there the law's own traction stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..effects import Direction
from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..problem.vectors import nodal
from ..typing import Array, Integers, Mask
from . import force_attribution
from .force_attribution import NEAR, Ledger


@dataclass(frozen=True)
class Forces:
    """Internal forces minus loads, and the loads, by vertex (owned), nondimensional, shape (blocks, d).

    The first is the reaction of whatever holds the body: zero off supports, contact and laws.
    """

    reaction: Array
    load: Array


@dataclass(frozen=True)
class State:
    """The vertices of one part (m), nondimensional.

    Attributes:
        surface: the part. bounds: of its normal displacement, or None. terms: its laws.
        normal, slip: u·n (m,) and u·t (m, d-1). gap: to the lower bound of -u·n, (m,), inf where there is none.
        pressure: σ_n (m,). contact_pressure: what of it contact carries. friction: -σ_t (m, d-1).
        contact: on a bound, (m,).
        arguments, tractions, distances: of each law, by term: what it acts on, the traction it gives, and how far that
            is from Clarke's subdifferential; (m,) each.
        hidden: of each law, where a support hides what it gives; (m,) each.
    """

    surface: Surface
    bounds: Bounds | None
    terms: tuple[LawTerm, ...]
    normal: Array
    slip: Array
    gap: Array
    pressure: Array
    contact_pressure: Array
    friction: Array
    contact: Mask
    arguments: tuple[Array, ...]
    tractions: tuple[Array, ...]
    distances: tuple[Array, ...]
    hidden: tuple[Mask, ...]

    def branch(self, *directions: Direction) -> Integers | None:
        """The active piece of the law in one of these directions, (m,); None where there is no such law."""
        for term, argument in zip(self.terms, self.arguments, strict=True):
            if term.direction in directions:
                return term.law.branch(argument, NEAR)
        return None


def forces(problem: Problem, u: fem.Function) -> Forces:
    """Reassembled from the forms, whatever a solver believes. Collective."""
    internal = problem.bulk.force(u)
    load = sum((nodal(form) for form in problem.linear.values()), np.zeros_like(internal))
    return Forces(internal - load, load)


def states(problem: Problem, u: fem.Function, reaction: Array) -> tuple[State, ...]:
    """The state of each part with bounds or laws, in the problem's order. Collective."""
    book, terms, bounds = force_attribution.carried(problem, u.x.array, reaction)
    read = [_law(book, term, t, u.x.array) for term, t in zip(problem.terms, terms, strict=True)]
    contact = {id(b.surface): _contact(book, b) for b in bounds}
    originals = {id(b.surface): contact[id(t.surface)] for b, t in zip(problem.bounds, bounds, strict=True)}
    return tuple(
        _state(problem, s, u.x.array, reaction, dict(zip(map(id, problem.terms), read, strict=True)), originals)
        for s in problem.surfaces
    )


@dataclass(frozen=True)
class _Law:
    """What the ledger says of one law: argument, traction, distance, hidden; (m,) each."""

    argument: Array
    traction: Array
    distance: Array
    hidden: Mask


def _law(book: Ledger, term: LawTerm, local: LawTerm, u: Array) -> _Law:
    argument = term.argument(u)
    low, high = term.law.interval(argument, NEAR)
    parts, hidden = [], np.zeros(len(argument), dtype=bool)
    for dofs, sign in force_attribution.components(local):
        share = np.where(sign > 0, book.share[dofs], 1.0 - book.share[dofs])
        parts.append(low + share * (high - low) + sign * book.excess[dofs])
        hidden |= book.held[dofs]
    if len(parts) == 1:
        return _Law(argument, parts[0], _away(parts[0], low, high), hidden)
    return _radial(book, term, local, argument, u, hidden)


def _radial(book: Ledger, term: LawTerm, local: LawTerm, argument: Array, u: Array, hidden: Mask) -> _Law:
    """A law of |u_t|: the traction is a vector along the slip, at zero slip any within the kink's disc."""
    dofs = [d for d, _ in force_attribution.components(local)]
    signs = np.stack([s for _, s in force_attribution.components(local)], axis=1)
    carried_elsewhere = np.stack([book.held[d] | book.contact[d] for d in dofs], axis=1)
    needed = np.stack([book.needed[d] for d in dofs], axis=1) * signs / term.surface.weights[:, None]
    slip, moving = term.slip(u), argument > NEAR
    unit = np.divide(slip, argument[:, None], out=np.zeros_like(slip), where=moving[:, None])
    low, high = term.law.interval(argument, NEAR)
    needed = np.where(carried_elsewhere, unit * ((low + high) / 2)[:, None], needed)
    along = np.where(moving, np.sum(needed * unit, axis=1), np.linalg.norm(needed, axis=1))
    across = np.where(moving, np.linalg.norm(needed - along[:, None] * unit, axis=1), 0.0)
    return _Law(argument, along, np.hypot(_away(along, low, high), across), hidden)


def _away(traction: Array, low: Array, high: Array) -> Array:
    return np.maximum(np.maximum(low - traction, traction - high), 0.0)


def _contact(book: Ledger, bounds: Bounds) -> Array:
    """σ_n that contact carries, (m,); off the bounds what is left there, which should be nothing."""
    dofs, sign = bounds.component()
    weight = np.where(book.contact[dofs], book.contact_weight[dofs], bounds.surface.weights)
    return sign * book.contact_force[dofs] / weight


def _state(
    problem: Problem, surface: Surface, u: Array, reaction: Array, laws: dict[int, _Law], contact: dict[int, Array]
) -> State:
    bounds = next((b for b in problem.bounds if b.surface is surface), None)
    terms = tuple(t for t in problem.terms if t.surface is surface)
    read = tuple(laws[id(t)] for t in terms)
    traction = reaction[surface.blocks] / surface.weights[:, None]
    normal = np.sum(surface.values(u) * surface.normals, axis=1)
    own = contact.get(id(surface), np.zeros(len(normal)))
    slip = np.einsum("mkd,md->mk", surface.tangents, surface.values(u))
    pressure, friction = _tractions(terms, read, bounds, surface, traction, own, slip)
    return State(
        surface,
        bounds,
        terms,
        normal,
        slip,
        np.full(len(normal), np.inf) if bounds is None else bounds.upper - normal,
        pressure,
        own,
        friction,
        np.zeros(len(normal), dtype=bool) if bounds is None else force_attribution.touches(bounds, normal),
        tuple(r.argument for r in read),
        tuple(r.traction for r in read),
        tuple(r.distance for r in read),
        tuple(r.hidden for r in read),
    )


def _tractions(
    terms: Sequence[LawTerm],
    read: Sequence[_Law],
    bounds: Bounds | None,
    surface: Surface,
    traction: Array,
    contact: Array,
    slip: Array,
) -> tuple[Array, Array]:
    """σ_n and -σ_t: of what acts on the part where something does, else the residual."""
    pressure = contact.copy() if bounds is not None else np.sum(traction * surface.normals, axis=1)
    friction = -np.einsum("mkd,md->mk", surface.tangents, traction)
    normal_laws = [(t, r) for t, r in zip(terms, read, strict=True) if t.direction is not Direction.SLIP]
    if normal_laws and bounds is None:
        pressure = np.zeros_like(pressure)
    for term, law in normal_laws:
        pressure = pressure - np.sum(term.directions[:, 0] * surface.normals, axis=1) * law.traction
    for term, law in zip(terms, read, strict=True):
        if term.direction is Direction.SLIP:
            alone = law.hidden if term.radial else np.ones(len(friction), dtype=bool)
            friction = np.where(alone[:, None], _along(slip, law), friction)
    return pressure, friction


def _along(slip: Array, law: _Law) -> Array:
    """The law's traction as a vector: along a signed slip, or in the direction of a slip vector."""
    if slip.shape[1] == 1:
        return law.traction[:, None]
    moving = law.argument[:, None] > NEAR
    return law.traction[:, None] * np.divide(slip, law.argument[:, None], out=np.zeros_like(slip), where=moving)


def balanced(problem: Problem, reaction: Array, parts: Sequence[State]) -> Array:
    """The reaction less what supports, contact and laws may carry: zero in equilibrium; shape (blocks, d)."""
    rest = reaction.copy()
    rest.reshape(-1)[problem.fixed_here] = 0.0
    for state in parts:
        carried = [t.directions for t in state.terms]
        if state.bounds is not None:
            carried.append(state.surface.normals[:, None, :])
        for directions in carried:
            here = rest[state.surface.blocks]
            along = np.einsum("mkd,md->mk", directions, here)
            rest[state.surface.blocks] = here - np.einsum("mk,mkd->md", along, directions)
    return rest
