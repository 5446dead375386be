"""Which of laws, contact and prescribed displacements carry the residual force at a vertex of Γc, by component.

At most vertices a component has one carrier. At corners, at the seam of two parts, and where adhesion acts beside
contact there are several, and only their sum is known. Laws may then carry any value of the (weighted, Minkowski) sum
of their Clarke intervals; a bound that is reached, or a support, carries the rest; without one it is the laws' error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..laws import ConvexPart, Length
from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..system import local_frames
from ..system.rigid_motions import SUMMATION
from ..typing import Array, Integers, Mask
from .thresholds import DEFAULT, CertificateThresholds


@dataclass(frozen=True, kw_only=True)
class ForceAttribution:
    """The attribution, by owned scalar dof in local components; all arrays (n,).

    Attributes:
        terms: the problem's laws in local components.
        bounds: its bounds in local components.
        near: distance (of u0) from a kink or a bound that counts as being on it, at each owned vertex, (blocks,).
        needed: minus the residual, what the carriers give.
        low: lower end of the range of the laws' sum.
        high: its upper end.
        weight: area of the laws.
        contact: whether a bound is reached.
        held: whether it is prescribed.
        contact_weight: area of the parts whose bound is reached.
        shared: the forces at vertices where a law of |u_t| shares a component with others: they replace all above.
    """

    terms: tuple[LawTerm, ...]
    bounds: tuple[Bounds, ...]
    near: Array
    needed: Array
    low: Array
    high: Array
    weight: Array
    contact: Mask
    held: Mask
    contact_weight: Array
    shared: SharedForces

    @property
    def by_laws(self) -> Array:
        """What the laws carry within their range; the middle of it where a support hides their share."""
        return np.where(self.held, (self.low + self.high) / 2, np.clip(self.needed, self.low, self.high))

    @property
    def share(self) -> Array:
        """Where in their range the laws stand, from 0 to 1."""
        width = self.high - self.low
        return np.divide(self.by_laws - self.low, width, out=np.zeros_like(width), where=width > 0)

    @property
    def excess(self) -> Array:
        """What neither the laws' range nor contact nor a support accounts for, per area of the laws."""
        rest = np.where(self.contact | self.held, 0.0, self.needed - self.by_laws)
        return np.divide(rest, self.weight, out=np.zeros_like(rest), where=self.weight > 0)

    @property
    def contact_force(self) -> Array:
        """Residual force that bounds carry; off the bounds what they should not: the residual where no law acts."""
        alone = (self.weight == 0) | self.contact
        return np.where(self.held | ~alone, 0.0, self.by_laws - self.needed)

    def enter_law(self, term: LawTerm, u: Array) -> None:
        """Enter what a law may carry.

        Args:
            term: the law at its vertices.
            u: the displacement, nondimensional, a local array.
        """
        low, high = term.law.interval(term.argument(u), term.reach(self.near[term.surface.blocks]))
        for dofs, sign in components(term):
            ends = np.stack([sign * low, sign * high]) * term.weights
            np.add.at(self.low, dofs, ends.min(axis=0))
            np.add.at(self.high, dofs, ends.max(axis=0))
            np.add.at(self.weight, dofs, term.weights)

    def enter_bounds(self, bounds: Bounds, u: Array) -> None:
        """Enter which bounds are reached.

        Args:
            bounds: of one part.
            u: the displacement, nondimensional, a local array.
        """
        dofs, _ = bounds.component()
        lower, upper = _reached(bounds, u, self.near)
        reached = lower | upper
        self.contact[dofs] |= reached
        np.add.at(self.contact_weight, dofs, np.where(reached, bounds.surface.weights, 0.0))


def attribute(problem: Problem, u: Array, residual: Array, near: Array) -> ForceAttribution:
    """Attribute the residual force of a displacement to its carriers.

    Args:
        problem: the laws, bounds and supports.
        u: nondimensional, a local array.
        residual: internal forces minus loads at the owned blocks, (blocks, d).
        near: distance (of u0) from a kink or a bound that counts as being on it, at the owned blocks, (blocks,).
    """
    local = local_frames.frames_of(problem)
    if local is not None:
        u, residual = local.local_components(u), local.local_components(residual)
    n = residual.size
    terms = problem.terms if local is None else tuple(local.term(t) for t in problem.terms)
    bounds = problem.bounds if local is None else tuple(local.bounds(b) for b in problem.bounds)
    needed, held = -residual.ravel(), np.isin(np.arange(n), problem.fixed)
    reached = [(b, *_reached(b, u, near)) for b in bounds]
    found = ForceAttribution(
        terms=terms,
        bounds=bounds,
        near=near,
        needed=needed,
        low=np.zeros(n),
        high=np.zeros(n),
        weight=np.zeros(n),
        contact=np.zeros(n, dtype=bool),
        held=held,
        contact_weight=np.zeros(n),
        shared=settle(terms, reached, u, needed, held, near),
    )
    for term in found.terms:
        found.enter_law(term, u)
    for one in found.bounds:
        found.enter_bounds(one, u)
    return found


def _reached(bounds: Bounds, u: Array, near: Array) -> tuple[Mask, Mask]:
    """Where the lower and where the upper bound is reached, (m,) each."""
    dofs, sign = bounds.component()
    return on_bounds(bounds, sign * u.ravel()[dofs], near[bounds.surface.blocks])


def on_bounds(bounds: Bounds, normal: Array, near: float | Array) -> tuple[Mask, Mask]:
    """Whether a normal displacement is on the lower and on the upper bound, (m,) each.

    Args:
        bounds: of u·n.
        normal: u·n, (m,).
        near: distance that counts as being on a bound, one for all or (m,).
    """
    return normal <= bounds.lower + near, normal >= bounds.upper - near


def touches(bounds: Bounds, normal: Array, near: float | Array) -> Mask:
    """Whether a normal displacement is on a bound, (m,).

    Args:
        bounds: of u·n.
        normal: u·n, (m,).
        near: distance that counts as being on a bound, one for all or (m,).
    """
    lower, upper = on_bounds(bounds, normal, near)
    return lower | upper


def on_kink(part: ConvexPart, argument: Array, near: float | Array) -> Mask:
    """Whether a law's argument is on a kink, (m,).

    Args:
        part: the law's H or G.
        argument: what it acts on, (m,).
        near: distance that counts as being on a kink, one for all or (m,).
    """
    return np.asarray(np.any(np.abs(argument[:, None] - part.kinks) <= np.reshape(near, (-1, 1)), axis=1))


@dataclass(frozen=True, kw_only=True)
class Carrier:
    """A law or a bound at those of its vertices that are shared (k of them).

    Attributes:
        rows: their numbers among the shared vertices, (k,).
        own: their numbers among its own vertices, (k,).
        visible: the components that no support hides, (k, d).
        along: the direction of a segment of forces, (k, d).
        low: the end of the segment behind, (k, 1).
        high: the end ahead, (k, 1).
        axes: of a disc of forces, (k, q, d).
        counts: which of these count, (k, q).
        length: whose unit ball, turned into forces, the disc is.
        radius: of the disc, (k, 1).
        at_rest: where it may give the disc instead of the segment, (k, 1).
    """

    rows: Integers
    own: Integers
    visible: Mask
    along: Array
    low: Array
    high: Array
    axes: Array
    counts: Mask
    length: Length
    radius: Array
    at_rest: Mask

    def nearest(self, wanted: Array) -> tuple[Array, Array]:
        """The force of its set that is nearest to a wanted one, and its derivative, both in visible components.

        Args:
            wanted: (k, d).

        Returns:
            The force (k, d), on a segment with its hidden components, and the derivative (k, d, d).
        """
        seen, rest = wanted * self.visible, self.at_rest
        disc, turns = self._in_disc(seen)
        segment, moves = self._on_segment(seen)
        both = self.visible[:, :, None] & self.visible[:, None, :]
        return np.where(rest, disc, segment), np.where(rest[:, :, None], turns, moves) * both

    def _on_segment(self, wanted: Array) -> tuple[Array, Array]:
        shown = self.along * self.visible
        squares = np.sum(shown**2, axis=1, keepdims=True)
        middle = np.clip(0.0, self.low, self.high)
        size = np.divide(np.sum(wanted * shown, axis=1, keepdims=True), squares, out=middle, where=squares > 0.0)
        inside = (self.low < size) & (size < self.high) & (squares > 0.0)
        share = np.divide(1.0, squares, out=np.zeros_like(squares), where=inside)
        return np.clip(size, self.low, self.high) * self.along, share[:, :, None] * _squares(shown)

    def _in_disc(self, wanted: Array) -> tuple[Array, Array]:
        inside = np.einsum("mkd,md->mk", self.axes, wanted) * self.counts
        found, slope = self.length.nearest(inside, self.radius[:, 0])
        slope = slope * (self.counts[:, :, None] & self.counts[:, None, :])
        turned = np.einsum("mkd,mkl,mle->mde", self.axes, slope, self.axes)
        return np.einsum("mk,mkd->md", found, self.axes), turned


def _squares(vectors: Array) -> Array:
    """Squares v vᵀ of vectors (k, d), (k, d, d)."""
    return vectors[:, :, None] * vectors[:, None, :]


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
    thresholds: CertificateThresholds = DEFAULT,
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
    forces, left = nearest_sum(carriers, wanted, thresholds)
    found = [(c.own, f + left[c.rows]) for c, f in zip(carriers, forces, strict=True)]
    return SharedForces(dict(enumerate(found[: len(terms)])), dict(enumerate(found[len(terms) :])))


def _shared(terms: Sequence[LawTerm], bounds: Sequence[tuple[Bounds, Mask, Mask]], dofs: int, d: int) -> Integers:
    """The vertices at which a component of a law of a length has another carrier too."""
    carriers = np.zeros(dofs, dtype=np.int64)
    for term in terms:
        for own, _ in components(term):
            np.add.at(carriers, own, 1)
    for one, lower, upper in bounds:
        np.add.at(carriers, one.component()[0], (lower | upper).astype(np.int64))
    found = [own[carriers[own] > 1] // d for term in terms if term.radial for own, _ in components(term)]
    return np.unique(np.concatenate(found))


def _of_law(term: LawTerm, row: Integers, free: Mask, u: Array, near: Array) -> Carrier:
    """What a law may carry at the vertices that have a row."""
    rows = row[term.surface.blocks]
    own = np.flatnonzero(rows >= 0)
    rows = rows[own]
    argument, within = term.argument(u)[own], term.reach(near[term.surface.blocks])[own]
    weights = term.weights[own, None]
    low, high = (weights * end[:, None] for end in term.law.interval(argument, within))
    moving = (argument > within)[:, None] | np.full((len(own), 1), not term.radial)
    unit = np.where(moving, term.gradient(term.slip(u)[own]), 0.0)
    return Carrier(
        rows=rows,
        own=own,
        visible=free[rows],
        along=np.einsum("mk,mkd->md", unit, term.directions[own]),
        low=low,
        high=high,
        axes=term.directions[own],
        counts=term.counts(u, near[term.surface.blocks])[own],
        length=term.length or Length.plain(1),
        radius=np.abs(high),
        at_rest=~moving,
    )


def _of_bounds(bounds: Bounds, lower: Mask, upper: Mask, row: Integers, free: Mask) -> Carrier:
    """What contact may carry at the vertices that have a row and are on a bound."""
    rows = row[bounds.surface.blocks]
    own = np.flatnonzero((rows >= 0) & (lower | upper))
    return Carrier(
        rows=rows[own],
        own=own,
        visible=free[rows[own]],
        along=bounds.surface.normals[own],
        low=np.where(lower[own], -np.inf, 0.0)[:, None],  # at the upper bound of u·n contact pushes inward
        high=np.where(upper[own], np.inf, 0.0)[:, None],
        axes=bounds.surface.normals[own, None],
        counts=np.ones((len(own), 1), dtype=bool),
        length=Length.plain(1),
        radius=np.zeros((len(own), 1)),
        at_rest=np.zeros((len(own), 1), dtype=bool),
    )


def nearest_sum(
    carriers: Sequence[Carrier], wanted: Array, thresholds: CertificateThresholds = DEFAULT
) -> tuple[list[Array], Array]:
    """Forces of all carriers whose sum is nearest to the wanted one, and what is left over.

    Args:
        carriers: at some vertices each.
        wanted: at all shared vertices, zero in hidden components, (vertices, d).
        thresholds: when forces are settled.

    Returns:
        The forces by carrier, (k, d) each, and what is left, (vertices, d).
    """
    asked: list[Array] = [np.zeros((len(c.rows), wanted.shape[1])) for c in carriers]
    _sweep(carriers, asked, wanted, thresholds.shared_steps)
    settled = np.finfo(np.float64).eps * float(np.max(np.abs(wanted), initial=0.0))
    for _ in range(thresholds.shared_steps):
        left = _left(carriers, asked, wanted)
        if np.all(np.abs(left) <= settled) or not _newton(carriers, asked, wanted, left, thresholds):
            break
    return [c.nearest(a)[0] for c, a in zip(carriers, asked, strict=True)], _left(carriers, asked, wanted)


def _left(carriers: Sequence[Carrier], asked: Sequence[Array], wanted: Array) -> Array:
    """What the carriers leave of the wanted forces, (vertices, d)."""
    left = wanted.copy()
    for carrier, a in zip(carriers, asked, strict=True):
        left[carrier.rows] -= carrier.nearest(a)[0] * carrier.visible
    return left


def _sweep(carriers: Sequence[Carrier], asked: list[Array], wanted: Array, count: int) -> None:
    """Ask each carrier in turn for its force and what is left."""
    left = _left(carriers, asked, wanted)
    for i, carrier in [pair for _ in range(count) for pair in enumerate(carriers)]:
        before = carrier.nearest(asked[i])[0] * carrier.visible
        asked[i] = left[carrier.rows] + before
        left[carrier.rows] += before - carrier.nearest(asked[i])[0] * carrier.visible


def _newton(
    carriers: Sequence[Carrier], asked: list[Array], wanted: Array, left: Array, thresholds: CertificateThresholds
) -> bool:
    """One Newton step at each vertex where it leaves less; whether there was any."""
    d = wanted.shape[1]
    slopes = [c.nearest(a)[1] for c, a in zip(carriers, asked, strict=True)]
    matrix = np.tile(SUMMATION * np.eye(d), (len(wanted), 1, 1))
    for carrier, slope in zip(carriers, slopes, strict=True):
        matrix[carrier.rows] += slope @ slope
    step = np.linalg.solve(matrix, left[:, :, None])
    steps = [(slope @ step[c.rows])[:, :, 0] for c, slope in zip(carriers, slopes, strict=True)]
    size, pending, length = np.linalg.norm(left, axis=1), np.ones(len(wanted), dtype=bool), 1.0
    for _ in range(thresholds.shared_steps):
        trial = [a + length * s for a, s in zip(asked, steps, strict=True)]
        better = pending & (np.linalg.norm(_left(carriers, trial, wanted), axis=1) < (1 - 1e-3 * length) * size)
        for i, carrier in enumerate(carriers):
            asked[i] = np.where(better[carrier.rows, None], trial[i], asked[i])
        pending, length = pending & ~better, length / 2
    return not np.all(pending)
