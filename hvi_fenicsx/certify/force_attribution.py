"""Which of laws, contact and prescribed displacements carry the residual force at a vertex of Γc.

At most vertices a component has one carrier, which gives what is needed. At corners, at the seam of two parts, and
where adhesion acts beside contact there are several, and only their sum is known: such forces are taken that each
carrier may give, with the sum nearest to what is needed. What is left is the error of all that meet there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..laws import ConvexPart, Length
from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..system import local_frames
from ..system.rigid_motions import SUMMATION
from ..typing import Array, Integers, Mask, magnitude
from .thresholds import DEFAULT


@dataclass(frozen=True)
class ForceAttribution:
    """What laws and contact carry.

    Attributes:
        laws: of each law the tractions along its directions, without its multiplier, (m, k), and where a support hides
            one of them, (m,).
        contact: of each part with bounds σ_n, (m,); off the bounds what is left there, which should be nothing.
    """

    laws: Sequence[tuple[Array, Mask]]
    contact: Mapping[str, Array]


def attribute(problem: Problem, u: Array, residual: Array, near: Array) -> ForceAttribution:
    """Attribute the residual force of a displacement to its carriers.

    Args:
        problem: the laws, bounds and supports.
        u: nondimensional, a local array.
        residual: internal forces minus loads at the owned blocks, (blocks, d).
        near: distance (of u0) from a kink or a bound that counts as being on it, at the owned blocks, (blocks,).
    """
    local = local_frames.frames_of(problem)
    u, residual = local.local_components(u), local.local_components(residual)
    terms, bounds = tuple(map(local.term, problem.terms)), tuple(map(local.bounds, problem.bounds))
    laws, pressed = np.zeros(residual.size, np.int64), np.zeros(residual.size, np.int64)
    for dofs, _ in (pair for term in terms for pair in components(term)):
        np.add.at(laws, dofs, 1)
    reached = [_reached(one, u, near) for one in bounds]
    for one, (lower, upper) in zip(bounds, reached, strict=True):
        np.add.at(pressed, one.component()[0], lower | upper)
    free = ~np.isin(np.arange(residual.size), problem.fixed)
    shape = residual.shape
    found = _Vertices(u, near, -residual, free.reshape(shape), laws.reshape(shape), pressed.reshape(shape))
    blocks = np.flatnonzero(np.any((found.laws + found.pressed > 1) & found.free, axis=1))
    row, shown = np.full(len(near), -1), found.free[blocks]
    row[blocks] = np.arange(len(blocks))
    carriers = [_of_law(term, row, shown, u, near) for term in terms]
    carriers += [_of_bounds(one, *on, row, shown) for one, on in zip(bounds, reached, strict=True)]
    forces, left = nearest_sum(carriers, np.where(shown, found.needed[blocks], 0.0))
    shared = iter([(c.own, force + left[c.rows]) for c, force in zip(carriers, forces, strict=True)])
    of_laws = [found.tractions(term, *next(shared)) for term in terms]
    return ForceAttribution(of_laws, {one.surface.part: found.pressure(one, *next(shared)) for one in bounds})


@dataclass(frozen=True)
class _Vertices:
    """What is known of the vertices in local components, (blocks, d) each, but for u and the distances near to a kink.

    The forces that are needed; where no support hides them; how many laws act there, and how many bounds are reached.
    """

    u: Array
    near: Array
    needed: Array
    free: Mask
    laws: Integers
    pressed: Integers

    def tractions(self, term: LawTerm, own: Integers, forces: Array) -> tuple[Array, Mask]:
        """The tractions of a law, and where a support hides one of them; its forces where its vertices are shared."""
        blocks = term.surface.blocks
        low, high = term.law.interval(term.argument(self.u), term.reach(self.near[blocks]))
        held, covered = (
            np.any((term.directions != 0.0) & where[blocks, None], axis=2)
            for where in (~self.free, ~self.free | (self.pressed > 0))
        )
        middle = term.gradient(term.slip(self.u)) * ((low + high) / 2)[:, None]
        given = np.einsum("mkd,md->mk", term.directions, self.needed[blocks]) / term.weights[:, None]
        given = np.where(covered, middle, given)
        given[own] = np.einsum("mkd,md->mk", term.directions[own], forces) / term.weights[own, None]
        return given, np.any(held, axis=1)

    def pressure(self, bounds: Bounds, own: Integers, forces: Array) -> Array:
        """σ_n of contact; its forces at those of its vertices that are shared."""
        (dofs, sign), weights = bounds.component(), bounds.surface.weights
        alone = self.free & (self.laws == 0) & (self.pressed < 2)
        carried = np.where(alone, -self.needed, 0.0).ravel()[dofs] * sign / weights
        carried[own] = -np.sum(forces * bounds.surface.normals[own], axis=1) / weights[own]
        return carried


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


def on_kink(part: ConvexPart, argument: Array, near: float | Array) -> Mask:
    """Whether a law's argument is on a kink, (m,).

    Args:
        part: the law's H or G.
        argument: what it acts on, (m,).
        near: distance that counts as being on a kink, one for all or (m,).
    """
    return np.any(np.abs(argument[:, None] - part.kinks) <= np.reshape(near, (-1, 1)), axis=1)


@dataclass(frozen=True, kw_only=True)
class Carrier:
    """A law or a bound at those of its vertices that are shared (k of them).

    Attributes:
        rows: their numbers among the shared vertices, (k,).
        own: their numbers among its own vertices, (k,).
        weights: by which it shares with others what all of them may give, (k,).
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
    weights: Array
    visible: Mask
    along: Array
    low: Array
    high: Array
    axes: Array
    counts: Mask
    length: Length
    radius: Array
    at_rest: Mask

    def nearest(self, wanted: Array) -> Array:
        """The force of its set that is nearest to a wanted one in visible components, (k, d).

        Args:
            wanted: (k, d).
        """
        found = np.clip(self._size(wanted), self.low, self.high) * self.along
        if not np.any(self.at_rest):
            return found
        disc, _ = self.length.nearest(self._inside(wanted), self.radius[:, 0])
        return np.where(self.at_rest, np.einsum("mk,mkd->md", disc, self.axes), found)

    def derivative(self, wanted: Array) -> Array:
        """The derivative of :meth:`nearest`, (k, d, d).

        Args:
            wanted: (k, d).
        """
        size, squares = self._size(wanted), self._squares
        inside = (self.low < size) & (size < self.high) & (squares > 0.0)
        share = np.divide(1.0, squares, out=np.zeros_like(squares), where=inside)
        found = share[:, :, None] * (self._shown[:, :, None] * self._shown[:, None])
        if np.any(self.at_rest):
            _, slope = self.length.nearest(self._inside(wanted), self.radius[:, 0])
            slope = slope * (self.counts[:, :, None] & self.counts[:, None, :])
            turned = np.einsum("mkd,mkl,mle->mde", self.axes, slope, self.axes)
            found = np.where(self.at_rest[:, :, None], turned, found)
        return found * (self.visible[:, :, None] & self.visible[:, None, :])

    @cached_property
    def _shown(self) -> Array:
        return self.along * self.visible

    @cached_property
    def _squares(self) -> Array:
        return np.sum(self._shown**2, axis=1, keepdims=True)

    def _size(self, wanted: Array) -> Array:
        """Where on the line of the segment a wanted force is, (k, 1)."""
        middle = np.clip(0.0, self.low, self.high)
        along = np.sum(wanted * self._shown, axis=1, keepdims=True)
        return np.divide(along, self._squares, out=middle, where=self._squares > 0.0)

    def _inside(self, wanted: Array) -> Array:
        """A wanted force along the axes of the disc, (k, q)."""
        return np.einsum("mkd,md->mk", self.axes, wanted * self.visible) * self.counts


def components(term: LawTerm) -> Iterator[tuple[Integers, Array]]:
    """For each of a law's directions the scalar dof at every vertex and the direction's sign."""
    for i in range(term.directions.shape[1]):
        yield component_dofs(term.surface.blocks, term.directions[:, i])


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
        weights=term.weights[own],
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
        weights=bounds.surface.weights[own],
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


def nearest_sum(carriers: Sequence[Carrier], wanted: Array) -> tuple[list[Array], Array]:
    """Forces of all carriers whose sum is nearest to the wanted one, and what is left over.

    Args:
        carriers: at some vertices each.
        wanted: at all shared vertices, zero in hidden components, (vertices, d).

    Returns:
        The forces by carrier, (k, d) each, and what is left, (vertices, d).
    """
    parts = [c.weights[:, None] * np.sum(c.axes**2, axis=1) for c in carriers]  # of the components in which each acts
    every = np.full(wanted.shape, np.finfo(np.float64).tiny)
    for carrier, part in zip(carriers, parts, strict=True):
        every[carrier.rows] += part
    asked = [wanted[c.rows] * part / every[c.rows] for c, part in zip(carriers, parts, strict=True)]
    forces = [c.nearest(a) for c, a in zip(carriers, asked, strict=True)]
    left, settled = _left(carriers, forces, wanted), float(np.finfo(np.float64).eps) * magnitude(wanted)
    _sweep(carriers, asked, forces, left, settled)
    for _ in range(DEFAULT.shared_steps if any(np.any(c.at_rest) for c in carriers) else 0):
        left = _left(carriers, forces, wanted)
        if np.all(np.abs(left) <= settled) or not _newton(carriers, asked, forces, wanted, left):
            break
    return forces, _left(carriers, forces, wanted)


def _left(carriers: Sequence[Carrier], forces: Sequence[Array], wanted: Array) -> Array:
    """What the carriers' forces leave of the wanted ones, (vertices, d)."""
    left = wanted.copy()
    for carrier, force in zip(carriers, forces, strict=True):
        left[carrier.rows] -= force * carrier.visible
    return left


def _sweep(carriers: Sequence[Carrier], asked: list[Array], forces: list[Array], left: Array, settled: float) -> None:
    """Ask each carrier in turn for its force and what is left, until that stays."""
    for _ in range(DEFAULT.shared_steps):
        old = left.copy()
        for i, carrier in enumerate(carriers):
            before = forces[i] * carrier.visible
            asked[i] = left[carrier.rows] + before
            forces[i] = carrier.nearest(asked[i])
            left[carrier.rows] += before - forces[i] * carrier.visible
        if magnitude(left - old) <= settled:
            break


def _newton(carriers: Sequence[Carrier], asked: list[Array], forces: list[Array], wanted: Array, left: Array) -> bool:
    """One Newton step at each vertex where it leaves less; whether there was any."""
    d = wanted.shape[1]
    slopes = [c.derivative(a) for c, a in zip(carriers, asked, strict=True)]
    matrix = np.tile(SUMMATION * np.eye(d), (len(wanted), 1, 1))
    for carrier, slope in zip(carriers, slopes, strict=True):
        matrix[carrier.rows] += slope @ slope
    step = np.linalg.solve(matrix, left[:, :, None])
    steps = [(slope @ step[c.rows])[:, :, 0] for c, slope in zip(carriers, slopes, strict=True)]
    size, pending, length = np.linalg.norm(left, axis=1), np.ones(len(wanted), dtype=bool), 1.0
    for _ in range(DEFAULT.shared_steps):
        trial = [a + length * s for a, s in zip(asked, steps, strict=True)]
        given = [c.nearest(a) for c, a in zip(carriers, trial, strict=True)]
        better = pending & (np.linalg.norm(_left(carriers, given, wanted), axis=1) < (1 - 1e-3 * length) * size)
        for i, carrier in enumerate(carriers):
            here = better[carrier.rows, None]
            asked[i], forces[i] = np.where(here, trial[i], asked[i]), np.where(here, given[i], forces[i])
        pending, length = pending & ~better, length / 2
    return not np.all(pending)
