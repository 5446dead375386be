"""Who carries the residual force at a vertex of Γc: laws, contact, prescribed displacements; component by component.

At most vertices a component has one carrier. At corners, at the seam of two parts, and where adhesion acts beside
contact there are several, and only their sum is known. Laws may then carry any value of the (weighted, Minkowski) sum
of their Clarke intervals; a bound that is reached, or a support, carries the rest; without one it is the laws' error.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..laws import ConvexPart
from ..problem.contact_surface import component_dofs
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..system import local_frames
from ..typing import Array, Integers, Mask

NEAR = 1e-10
"""Distance (of u0) from a kink or a bound that counts as being on it."""


@dataclass(frozen=True)
class Ledger:
    """The attribution, by owned scalar dof in local components; all arrays (n,).

    Attributes:
        needed: minus the residual, what the carriers give. low, high: range of the laws' sum. weight: of the laws.
        contact: a bound is reached. held: prescribed. contact_weight: of the parts whose bound is reached.
    """

    needed: Array
    low: Array
    high: Array
    weight: Array
    contact: Mask
    held: Mask
    contact_weight: Array

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


def carried(problem: Problem, u: Array, residual: Array) -> tuple[Ledger, Sequence[LawTerm], Sequence[Bounds]]:
    """The ledger of a displacement (local array) and its residual (owned); terms and bounds in local components."""
    local = local_frames.build(problem)
    terms = problem.terms if local is None else tuple(local.term(t) for t in problem.terms)
    bounds = problem.bounds if local is None else tuple(local.bounds(b) for b in problem.bounds)
    if local is not None:
        u, residual = local.turned(u), local.turned(residual)
    n = residual.size
    ledger = Ledger(
        -residual.ravel(),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n, dtype=bool),
        np.isin(np.arange(n), problem.fixed),
        np.zeros(n),
    )
    for term in terms:
        _enter_law(ledger, term, u)
    for b in bounds:
        _enter_bound(ledger, b, u)
    return ledger, terms, bounds


def _enter_law(ledger: Ledger, term: LawTerm, u: Array) -> None:
    low, high = term.law.interval(term.argument(u), NEAR)
    for dofs, sign in components(term):
        ends = np.stack([sign * low, sign * high]) * term.surface.weights
        np.add.at(ledger.low, dofs, ends.min(axis=0))
        np.add.at(ledger.high, dofs, ends.max(axis=0))
        np.add.at(ledger.weight, dofs, term.surface.weights)


def _enter_bound(ledger: Ledger, bounds: Bounds, u: Array) -> None:
    dofs, sign = bounds.component()
    normal = sign * u.ravel()[dofs]
    reached = touches(bounds, normal)
    ledger.contact[dofs] |= reached
    np.add.at(ledger.contact_weight, dofs, np.where(reached, bounds.surface.weights, 0.0))


def on_bounds(bounds: Bounds, normal: Array) -> tuple[Mask, Mask]:
    """Whether u·n (m,) is on the lower and on the upper bound."""
    return normal <= bounds.lower + NEAR, normal >= bounds.upper - NEAR


def touches(bounds: Bounds, normal: Array) -> Mask:
    """Whether u·n (m,) is on a bound."""
    lower, upper = on_bounds(bounds, normal)
    return lower | upper


def on_kink(part: ConvexPart, argument: Array) -> Mask:
    """Whether a law's argument (m,) is on a kink of its H or G."""
    return np.asarray(np.any(np.abs(argument[:, None] - part.kinks) <= NEAR, axis=1))


def components(term: LawTerm) -> Iterator[tuple[Integers, Array]]:
    """For each of a law's directions the scalar dof at every vertex and the direction's sign."""
    for i in range(term.directions.shape[1]):
        yield component_dofs(term.surface.blocks, term.directions[:, i])
