"""Which of laws, contact and prescribed displacements carry the residual force at a vertex of Γc, by component.

At most vertices a component has one carrier. At corners, at the seam of two parts, and where adhesion acts beside
contact there are several, and only their sum is known. Laws may then carry any value of the (weighted, Minkowski) sum
of their Clarke intervals; a bound that is reached, or a support, carries the rest; without one it is the laws' error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..laws import ConvexPart
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..system import local_frames
from ..typing import Array, Mask
from . import shared_forces
from .shared_forces import SharedForces


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
        for dofs, sign in shared_forces.components(term):
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
        shared=shared_forces.settle(terms, reached, u, needed, held, near),
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
