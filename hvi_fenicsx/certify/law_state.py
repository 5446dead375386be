"""The state of one law at a given displacement: its arguments, its tractions, and how far they are from its graph."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..problem.law_term import LawTerm
from ..typing import Array, Mask
from . import force_attribution
from .force_attribution import ForceAttribution


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
        return float(np.max(np.abs(found / self.term.energies - 1.0), initial=0.0))

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
        second = term.law.convex.second(self.argument) - term.law.concave.second(self.argument)
        first, second = (np.where(kink, 0.0, values) for values in ((low + high) / 2, second / term.stretch))
        if term.length is None:
            return np.abs(second) * digits[:, 0]
        rates = np.abs(term.length.hessian(self.components, first, second))
        return np.linalg.norm(np.einsum("mkl,ml->mk", rates, digits), axis=1)

    def on_convex_kink(self) -> Mask:
        """Where it is on a kink of the law's convex part, (m,)."""
        return force_attribution.on_kink(self.term.law.convex, self.argument, self.near)


def of_term(attribution: ForceAttribution, number: int, term: LawTerm, u: Array, scale: Array) -> LawState:
    """The state of one law.

    Args:
        attribution: who carries which force.
        number: of the law among the problem's.
        term: the law.
        u: nondimensional, relative displacements on interfaces.
        scale: what its traction is judged by, (m,).
    """
    local = attribution.terms[number]
    argument, near = term.argument(u), term.reach(attribution.near[term.surface.blocks])
    low, high = term.law.interval(argument, near)
    parts, hidden = [], np.zeros(len(argument), dtype=bool)
    for dofs, sign in force_attribution.components(local):
        share = np.where(sign > 0, attribution.share[dofs], 1.0 - attribution.share[dofs])
        parts.append(low + share * (high - low) + sign * attribution.excess[dofs])
        hidden |= attribution.held[dofs]
    if len(parts) == 1:
        at, forces = attribution.shared.of_law(number, local)
        parts[0][at] = np.sum(forces * local.directions[at, 0], axis=1) / term.weights[at]
        traction, distance, given = parts[0], _away(parts[0], low, high), parts[0][:, None]
        allowed = np.clip(parts[0], low, high)[:, None]
    else:
        traction, distance, given, allowed = _of_length(attribution, number, term, u)
    return LawState(
        term=term,
        components=term.slip(u),
        argument=argument,
        traction=traction,
        given=given,
        distance=distance,
        allowed=allowed,
        scale=scale,
        hidden=hidden,
        near=near,
    )


def _of_length(
    attribution: ForceAttribution, number: int, term: LawTerm, u: Array
) -> tuple[Array, Array, Array, Array]:
    """A law of a length: its traction, how far the tractions are from what it allows, they, and the nearest allowed."""
    local, length = attribution.terms[number], term.length
    assert length is not None
    blocks, d = term.surface.blocks, term.free.shape[1]
    near, components = attribution.near[blocks], term.slip(u)
    low, high = term.law.interval(term.argument(u), term.reach(near))
    gradient = length.gradient(components)
    elsewhere = (attribution.held | attribution.contact).reshape(-1, d)[blocks]
    hidden = np.any((local.directions != 0.0) & elsewhere[:, None, :], axis=2)
    needed = np.einsum("mkd,md->mk", local.directions, attribution.needed.reshape(-1, d)[blocks])
    given = np.where(hidden, gradient * ((low + high) / 2)[:, None], needed / term.weights[:, None])
    at, forces = attribution.shared.of_law(number, local)
    given[at] = np.einsum("mkd,md->mk", local.directions[at], forces) / term.weights[at, None]
    allowed = length.allowed(components, given, (low, high), near)
    return length.traction(components, given, near), np.linalg.norm(given - allowed, axis=1), given, allowed


def _away(traction: Array, low: Array, high: Array) -> Array:
    return np.maximum(np.maximum(low - traction, traction - high), 0.0)
