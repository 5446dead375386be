"""When a vertex that a law of a length holds begins to move: where parts meet, several laws may hold one component."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..problem.law_term import LawTerm
from ..typing import Array, Integers, Mask
from .law_models import ExactLaw, Majorant


class Shared:
    """The forces that the kinks of all laws of a length have to carry together.

    Args:
        terms: all laws.
        models: what takes their place, by term.
        forces: what bounds and other kinks leave to them, (n,).
    """

    def __init__(self, terms: Sequence[LawTerm], models: Sequence[Majorant | ExactLaw], forces: Array) -> None:
        self._terms, self._models, self._forces = terms, models, forces
        self._spare = [self._spare_of(number) for number in range(len(terms))]

    def moves(self, number: int, argument: Array, excess: Array) -> Integers:
        """To which cell each vertex of a term moves: a stuck one goes if its kink cannot carry it, a slow one sticks.

        Args:
            number: of the term.
            argument: the length, (m,).
            excess: force by which the kink may be exceeded, (m,).
        """
        term, cells = self._terms[number], self._models[number].cells
        if not len(cells.kinks):
            return np.zeros(len(argument), dtype=np.int64)
        others = sum(self._spare[:number] + self._spare[number + 1 :], np.zeros_like(self._forces))
        needed = np.sign(self._forces) * np.maximum(np.abs(self._forces) - others, 0.0)
        go = (cells.index == 0) & (np.linalg.norm(_pulls(term, needed), axis=1) > self._disc(number) + excess)
        stick = (cells.index == 1) & (argument <= cells.ramp)
        return go.astype(np.int64) - stick.astype(np.int64)

    def _disc(self, number: int) -> Array:
        """The largest force that the kink of a term carries, (m,)."""
        weights = self._terms[number].weights
        return np.asarray(weights * self._models[number].law.convex.right(np.zeros_like(weights)))

    def _spare_of(self, number: int) -> Array:
        """What the kink of a term can carry of each component where it carries all of the others, (n,)."""
        spare, term, cells = np.zeros_like(self._forces), self._terms[number], self._models[number].cells
        if term.radial and len(cells.kinks):
            squares = _pulls(term, self._forces) ** 2
            rest = self._disc(number)[:, None] ** 2 - np.sum(squares, axis=1, keepdims=True) + squares
            room = np.sqrt(np.maximum(rest, 0.0)) * (cells.index == 0)[:, None] * _factors(term)
            room[:, _opens(term)] *= squares[:, _opens(term)] > 0.0
            spare[term.surface.dofs] = np.einsum("mkd,mk->md", np.abs(term.directions), room) * term.free
        return spare


def _pulls(term: LawTerm, forces: Array) -> Array:
    """The tractions that carry minus the forces (n,) along a law's components, each alone, times area, (m, k)."""
    along = -np.einsum("mkd,md->mk", term.directions, term.surface.values(forces) * term.free) / _factors(term)
    along[:, _opens(term)] = np.maximum(along[:, _opens(term)], 0.0)
    return np.asarray(along)


def _factors(term: LawTerm) -> Array:
    return np.ones(term.directions.shape[1]) if term.length is None else np.array(term.length.factors)


def _opens(term: LawTerm) -> Mask:
    """Which components are openings, that nothing holds the other way, (k,)."""
    return np.zeros(term.directions.shape[1], dtype=bool) if term.length is None else ~term.length.two_sided()
