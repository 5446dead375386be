"""Forces at vertices where a law of |u_t| shares a component with other laws or with contact, at edges in space.

Only their sum is known. Each carrier may give any force of a convex set: a law at rest a disc, any other law a segment,
contact a half-line. Forces of these sets whose sum comes nearest to the wanted one are found by minimising over one
carrier after the other. What then is left over, no attribution accounts for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds
from ..typing import Array, Integers, Mask
from .thresholds import DEFAULT, Thresholds

Projection = Callable[[Array], Array]


@dataclass(frozen=True)
class Carrier:
    """A law or a bound at those of its vertices that are shared (k of them).

    Attributes:
        rows: their numbers among the shared vertices, (k,).
        own: their numbers among its own vertices, (k,).
        nearest: gives the force of its set that is nearest to a given one, (k, d) both.
    """

    rows: Integers
    own: Integers
    nearest: Projection


@dataclass(frozen=True)
class SharedForces:
    """The forces of the laws and bounds at shared vertices, in local components.

    Attributes:
        laws: for each law that has shared vertices, by its number: their numbers among its own (k,), and its forces
            there with what is left over, (k, d).
        bounds: the same of bounds.
    """

    laws: Mapping[int, tuple[Integers, Array]]
    bounds: Mapping[int, tuple[Integers, Array]]

    def of_law(self, number: int, term: LawTerm) -> tuple[Integers, Array]:
        """A law's shared vertices by their numbers among its own (k,), and its forces there (k, d); k may be 0.

        Args:
            number: of the law.
            term: the law.
        """
        return self.laws.get(number) or _nothing(term.directions.shape[2])

    def of_bounds(self, number: int, bounds: Bounds) -> tuple[Integers, Array]:
        """The shared vertices of a bound by their numbers among its own (k,), and its forces there (k, d).

        Args:
            number: of the bounds.
            bounds: the bounds.
        """
        return self.bounds.get(number) or _nothing(bounds.surface.normals.shape[1])


def _nothing(d: int) -> tuple[Integers, Array]:
    return np.empty(0, dtype=np.int64), np.empty((0, d))


def components(term: LawTerm) -> Iterator[tuple[Integers, Array]]:
    """For each of a law's directions the scalar dof at every vertex and the direction's sign."""
    for i in range(term.directions.shape[1]):
        yield component_dofs(term.surface.blocks, term.directions[:, i])


def settle(
    terms: Sequence[LawTerm],
    bounds: Sequence[tuple[Bounds, Mask, Mask]],
    u: Array,
    needed: Array,
    held: Mask,
    near: Array,
    thresholds: Thresholds = DEFAULT,
) -> SharedForces:
    """The forces at shared vertices.

    Args:
        terms: the laws in local components.
        bounds: the bounds in local components, with where the lower and where the upper bound is reached, (m,) each.
        u: the displacement in local components, a local array.
        needed: the sum of the forces by owned scalar dof, (n,).
        held: which dofs are prescribed: there the support gives what is needed, (n,).
        near: distance from a kink that counts as being on it, by owned vertex, (blocks,).
        thresholds: when forces are settled.
    """
    if not any(term.radial for term in terms):
        return SharedForces({}, {})
    d = terms[0].directions.shape[2]
    blocks = _shared(terms, bounds, len(needed), d)
    free = ~held.reshape(-1, d)[blocks]
    row = np.full(len(near), -1)
    row[blocks] = np.arange(len(blocks))
    carriers = [_of_law(term, row, free, u, near) for term in terms]
    carriers += [_of_bounds(*one, row, free) for one in bounds]
    wanted = np.where(free, needed.reshape(-1, d)[blocks], 0.0)
    forces, left = _nearest_sum(carriers, wanted, thresholds)
    found = [(c.own, f + left[c.rows]) for c, f in zip(carriers, forces, strict=True)]
    return SharedForces(dict(enumerate(found[: len(terms)])), dict(enumerate(found[len(terms) :])))


def _shared(terms: Sequence[LawTerm], bounds: Sequence[tuple[Bounds, Mask, Mask]], dofs: int, d: int) -> Integers:
    """The vertices at which a component of a law of |u_t| has another carrier too."""
    carriers = np.zeros(dofs, dtype=np.int64)
    for term in terms:
        for own, _ in components(term):
            np.add.at(carriers, own, 1)
    for one, lower, upper in bounds:
        np.add.at(carriers, one.component()[0], (lower | upper).astype(np.int64))
    found = [own[carriers[own] > 1] // d for term in terms if term.radial for own, _ in components(term)]
    return np.unique(np.concatenate(found))


def _of_law(term: LawTerm, row: Integers, free: Mask, u: Array, near: Array) -> Carrier:
    rows = row[term.surface.blocks]
    own = np.flatnonzero(rows >= 0)
    rows = rows[own]
    argument, within = term.argument(u)[own], near[term.surface.blocks][own]
    weights = term.surface.weights[own, None]
    low, high = (weights * end[:, None] for end in term.law.interval(argument, within))
    axes = term.directions[own] * free[rows][:, None, :]
    moving = (argument > within)[:, None] | np.full((len(own), 1), not term.radial)
    unit: Array = np.ones((len(own), 1))
    if term.radial:
        unit = np.divide(term.slip(u)[own], argument[:, None], out=np.zeros((len(own), 2)), where=moving)
    along = np.einsum("mk,mkd->md", unit, axes)

    def nearest(force: Array) -> Array:
        inside = np.einsum("mkd,md->mk", axes, force)
        length = np.linalg.norm(inside, axis=1, keepdims=True)
        capped = inside * np.minimum(1.0, np.divide(high, length, out=np.ones_like(length), where=length > 0))
        disc = np.einsum("mk,mkd->md", capped, axes)
        segment = np.clip(np.sum(force * along, axis=1, keepdims=True), low, high) * along
        return np.where(moving, segment, disc)

    return Carrier(rows, own, nearest)


def _of_bounds(bounds: Bounds, lower: Mask, upper: Mask, row: Integers, free: Mask) -> Carrier:
    rows = row[bounds.surface.blocks]
    own = np.flatnonzero((rows >= 0) & (lower | upper))
    rows = rows[own]
    axes = bounds.surface.normals[own] * free[rows]
    least = np.where(lower[own], -np.inf, 0.0)[:, None]  # at the upper bound of u·n contact pushes inward
    most = np.where(upper[own], np.inf, 0.0)[:, None]

    def nearest(force: Array) -> Array:
        return np.clip(np.sum(force * axes, axis=1, keepdims=True), least, most) * axes

    return Carrier(rows, own, nearest)


def _nearest_sum(carriers: Sequence[Carrier], wanted: Array, thresholds: Thresholds) -> tuple[list[Array], Array]:
    """Forces of all carriers whose sum is nearest to the wanted one, and what is left over."""
    left = wanted.copy()
    forces: list[Array] = [np.zeros((len(c.rows), wanted.shape[1])) for c in carriers]
    settled = thresholds.settled * float(np.max(np.abs(wanted), initial=0.0))
    for _ in range(thresholds.sweeps):
        change = 0.0
        for i, carrier in enumerate(carriers):
            force = carrier.nearest(left[carrier.rows] + forces[i])
            step = force - forces[i]
            left[carrier.rows] -= step
            forces[i] = force
            change = max(change, float(np.max(np.abs(step), initial=0.0)))
        if change <= settled:
            break
    return forces, left
