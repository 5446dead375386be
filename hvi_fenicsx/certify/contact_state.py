"""The state of Γc at a given displacement: gaps, slips, tractions, pieces of the laws; from (u, problem) alone.

Tractions are nodal residual forces over lumped areas. Where a component is prescribed, the residual holds
the support's reaction too, so there the law's own traction stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..effects import Direction
from ..laws import Length, Superpotential
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..problem.references import References, elastic_forces
from ..problem.vectors import nodal_values
from ..typing import Array, Integers, Mask, magnitude
from . import force_attribution
from .thresholds import DEFAULT


@dataclass(frozen=True)
class Forces:
    """Forces by vertex (owned), nondimensional, (blocks, d); those on the unknowns where bodies meet.

    Attributes:
        reaction: internal forces minus loads, the reaction of whatever holds the body: zero off supports, contact and
            laws.
        load: the loads.
        pushing: those that do work on rigid motions: without given strains.
    """

    reaction: Array
    load: Array
    pushing: Array


@dataclass(frozen=True, kw_only=True)
class ContactState:
    """The vertices of one part (m), nondimensional.

    Attributes:
        surface: the part.
        bounds: of its normal displacement, or None.
        laws: the states of its laws.
        values: the displacement at the nodes, (m, d).
        normal: u·n of the coefficients, on which bounds and laws act, (m,).
        slip: u·t of the coefficients, (m, d-1).
        gap: distance to the lower bound of -u·n, (m,), infinite where there is none.
        pressure: σ_n, (m,).
        contact_pressure: the part of σ_n that contact carries, (m,).
        friction: -σ_t, (m, d-1).
        on_lower: whether u·n is on its lower bound, (m,).
        on_upper: whether u·n is on its upper bound, (m,).
    """

    surface: Surface
    bounds: Bounds | None
    laws: tuple[LawState, ...]
    values: Array
    normal: Array
    slip: Array
    gap: Array
    pressure: Array
    contact_pressure: Array
    friction: Array
    on_lower: Mask
    on_upper: Mask

    @property
    def normal_displacement(self) -> Array:
        """u·n at the nodes, (m,)."""
        return np.sum(self.values * self.surface.normals, axis=1)

    @property
    def tangential_displacement(self) -> Array:
        """u·t at the nodes, (m, d-1)."""
        return np.einsum("mkd,md->mk", self.surface.tangents, self.values)

    @property
    def contact(self) -> Mask:
        """Whether u·n is on a bound, (m,)."""
        return self.on_lower | self.on_upper

    @property
    def resultant(self) -> Array:
        """The resultant of :attr:`pressure` on this rank's nodes, in units of force, (d,)."""
        return (self.surface.weights[:, None] * self.pressure[:, None] * self.surface.normals).sum(axis=0)

    def branch(self, *directions: Direction) -> Integers | None:
        """The active piece of the law in one of these directions, (m,); None where there is no such law."""
        for law in self.laws:
            if law.term.direction in directions:
                return law.term.law.branch(law.argument, law.near)
        return None

    @property
    def resists_slip(self) -> bool:
        """Whether a law acts on the slip, alone or with an opening."""
        return any(law.term.direction.tangential for law in self.laws)

    @property
    def of_both_modes(self) -> LawState | None:
        """The law of opening and slip together; None where there is none."""
        return next((law for law in self.laws if law.term.direction is Direction.SEPARATION), None)


def forces(problem: Problem, u: fem.Function) -> Forces:
    """The forces at a displacement, reassembled from the forms. Collective.

    Args:
        problem: what is solved.
        u: nondimensional, ghosts updated.
    """
    internal = elastic_forces(problem, u)
    pushing, strains = np.zeros_like(internal), np.zeros_like(internal)
    for name, form in problem.loads.items():
        (strains if name in problem.bulk.strains else pushing)[:] += nodal_values(form)
    load = pushing + strains
    return Forces(*(problem.combined(force) for force in (internal - load, load, pushing)))


def states(references: References, u: fem.Function, reaction: Array) -> tuple[ContactState, ...]:
    """The state of each part with bounds or laws, in the problem's order. Collective.

    Args:
        references: of the problem that is solved.
        u: nondimensional, ghosts updated.
        reaction: internal forces minus loads at u, (blocks, d).
    """
    problem = references.problem
    values = problem.relative(u.x.array)
    near = DEFAULT.near * references.at(np.arange(len(reaction)))
    attribution = force_attribution.attribute(problem, values, reaction, near)
    laws = [
        _law_state(term, values, *tractions, references.traction_scale(term), term.reach(near[term.surface.blocks]))
        for term, tractions in zip(problem.terms, attribution.laws, strict=True)
    ]
    contact = attribution.contact
    return tuple(_state(problem, surface, values, reaction, laws, contact, near) for surface in problem.surfaces)


def _state(
    problem: Problem,
    surface: Surface,
    u: Array,
    reaction: Array,
    laws: Sequence[LawState],
    contact: Mapping[str, Array],
    near: Array,
) -> ContactState:
    """The state of one part at a local array u, from what its vertices feel and which of it contact carries."""
    bounds = next((b for b in problem.bounds if b.surface is surface), None)
    here = tuple(law for law in laws if law.term.surface is surface)
    normal = np.sum(surface.values(u) * surface.normals, axis=1)
    own = contact.get(surface.part, np.zeros(len(normal)))
    slip = np.einsum("mkd,md->mk", surface.tangents, surface.values(u))
    traction = reaction[surface.blocks] / surface.weights[:, None]
    nowhere = np.zeros(len(normal), dtype=bool)
    on = (nowhere, nowhere) if bounds is None else force_attribution.on_bounds(bounds, normal, near[surface.blocks])
    return ContactState(
        surface=surface,
        bounds=bounds,
        laws=here,
        values=surface.values(spaces.values(problem.space, u)),
        normal=normal,
        slip=slip,
        gap=np.full(len(normal), np.inf) if bounds is None else bounds.upper - normal,
        pressure=_pressure(here, bounds, surface, traction, own),
        contact_pressure=own,
        friction=_friction(here, surface, traction),
        on_lower=on[0],
        on_upper=on[1],
    )


def _pressure(
    laws: Sequence[LawState], bounds: Bounds | None, surface: Surface, traction: Array, contact: Array
) -> Array:
    """σ_n of what acts on the part where something does, else of the residual."""
    pressure = contact.copy() if bounds is not None else np.sum(traction * surface.normals, axis=1)
    normal_laws = [law for law in laws if law.term.direction.normal]
    if normal_laws and bounds is None:
        pressure = np.zeros_like(pressure)
    for law in normal_laws:
        pressure = pressure - np.sum(law.term.directions[:, 0] * surface.normals, axis=1) * law.carried[:, 0]
    return pressure


def _friction(laws: Sequence[LawState], surface: Surface, traction: Array) -> Array:
    """-σ_t of what acts on the part where something does, else of the residual."""
    friction = -np.einsum("mkd,md->mk", surface.tangents, traction)
    for law in laws:
        if law.term.direction.tangential:
            alone = law.hidden if law.term.radial else np.ones(len(friction), dtype=bool)
            friction = np.where(alone[:, None], law.carried[:, -friction.shape[1] :], friction)
    return friction


@dataclass(frozen=True, kw_only=True)
class LawState:
    """One law at the vertices (m) of its part, nondimensional. Its tractions are those of j, without the multiplier.

    Attributes:
        term: the law.
        components: the displacement along its directions, (m, k).
        argument: what it acts on, (m,).
        traction: the traction it gives, (m,); this and the following over the energies of the term.
        given: the tractions along its directions, (m, k).
        distance: how far that is from Clarke's subdifferential, (m,).
        allowed: the nearest traction along its directions that the law allows, (m, k).
        scale: what its traction is judged by, (m,).
        hidden: where a support hides what the law gives, (m,).
        near: distance of arguments from a kink that counts as being on it, (m,).
    """

    term: LawTerm
    components: Array
    argument: Array
    traction: Array
    given: Array
    distance: Array
    allowed: Array
    scale: Array
    hidden: Mask
    near: Array

    def true_distance(self) -> Array:
        """How far the traction is from the unsmoothed law's subdifferential, (m,)."""
        return self.term.exact.distance(self.argument, self.traction, self.near)

    @property
    def unsettled(self) -> float:
        """The largest relative change of the energies of the term if they were frozen anew."""
        found = self.term.energies_of(self.components, self._near_rest)
        return magnitude(found / self.term.energies - 1.0)

    @property
    def carried(self) -> Array:
        """The tractions along its directions that it puts on the body: the given ones times its multiplier, (m, k)."""
        return self.term.multiplier[:, None] * self.given

    @property
    def slip_share(self) -> Array:
        """The share of the slip in the square of a length of both modes, 0 to 1, (m,); NaN where that is zero.

        Along a path on which it stays the same this is the share of mode II in the work of the law.
        """
        assert self.term.length is not None
        return self.term.length.slip_share(self.components, self._near_rest)

    @property
    def _near_rest(self) -> Array:
        """Distance of displacements that is none, (m,)."""
        return self.near * self.term.stretch

    def moved_by(self, digits: Array) -> Array:
        """How far the tractions that it gives move on their pieces, (m,); none on a kink, which gives a whole interval.

        Args:
            digits: by which the displacement along its directions moves, at most, (m, k).
        """
        term, kink = self.term, self.on_convex_kink()
        low, high = term.law.interval(self.argument)
        second = term.law.derivatives(self.argument)[1]
        first, second = (np.where(kink, 0.0, values) for values in ((low + high) / 2, second / term.stretch))
        if term.length is None:
            return np.abs(second) * digits[:, 0]
        rates = np.abs(term.length.hessian(self.components, first, second))
        return np.linalg.norm(np.einsum("mkl,ml->mk", rates, digits), axis=1)

    def on_convex_kink(self) -> Mask:
        """Where it is on a kink of the law's convex part, (m,)."""
        return force_attribution.on_kink(self.term.law.convex, self.argument, self.near)


def nearest(law: Superpotential, length: Length | None, slip: Array, traction: Array, near: float | Array) -> Array:
    """The admissible tractions of a law nearest to given ones, (m, k).

    Args:
        law: its superpotential j.
        length: the length that it acts on; None: the signed slip, k = 1.
        slip: the components of what it acts on, (m, k).
        traction: the given ones, (m, k).
        near: distance from a kink that counts as being on it, one for all or (m,).
    """
    ends = law.interval(slip[:, 0] if length is None else length.of(slip), near)
    if length is None:
        return np.clip(traction[:, 0], *ends)[:, None]
    return length.allowed(slip, traction, ends, near)


def _law_state(term: LawTerm, u: Array, given: Array, hidden: Mask, scale: Array, near: Array) -> LawState:
    """The state of a law that gives known tractions at a local array u."""
    components, traction = term.slip(u), given[:, 0]
    allowed = nearest(term.law, term.length, components / term.stretch[:, None], given, near)
    if term.length is not None:
        traction = term.length.traction(components, given, near * term.stretch)
    return LawState(
        term=term,
        components=components,
        argument=term.argument(u),
        traction=traction,
        given=given,
        distance=np.linalg.norm(given - allowed, axis=1),
        allowed=allowed,
        scale=scale,
        hidden=hidden,
        near=near,
    )
