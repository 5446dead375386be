"""The law of a group of bonds at all its vertices, in arrays, with what each vertex remembers."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ...laws import Superpotential, TractionGraph
from ...reduced.condensed_problem import Bonds, CondensedProblem
from ...typing import Array
from ..graphs import graph_of, was_passed


@dataclass(frozen=True, kw_only=True)
class LawRows:
    """One law at r vertices.

    Attributes:
        bonds: the group.
        polyline: the traction graph of the law; None where it is curved.
        signs: the law's argument is that times the coordinate, (r,); of a length 1.
        remembers: whether the vertices remember.
    """

    bonds: Bonds
    polyline: TractionGraph | None
    signs: Array
    remembers: bool

    @property
    def law(self) -> Superpotential:
        """The law."""
        return self.bonds.law

    def traction(self, x: Array, side: str, memory: Array) -> Array:
        """The limits of the tractions along the coordinates, with memory, (r,).

        Args:
            x: coordinates, (r,).
            side: "left" or "right".
            memory: least and greatest coordinate so far, and the tractions there, (r, 4); zeros without memory.
        """
        found = self.signs * np.where(self.signs > 0.0, self._limit(x, side), self._limit(-x, _other(side)))
        low, high, low_traction, high_traction = memory.T
        inside = was_passed(x, low, high, side)
        end, there = np.where(x < 0.0, low, high), np.where(x < 0.0, low_traction, high_traction)
        secant = np.divide(there, end, out=np.zeros_like(x), where=end != 0.0) * x
        return np.where(inside, secant, found)

    def recoverable(self, x: Array, traction: Array) -> Array:
        """What the vertices give back on the way to zero: w j, or the triangle under the secant with memory, (r,).

        Args:
            x: coordinates, (r,).
            traction: along them, (r,).
        """
        plain = 0.5 * x * traction if self.remembers else self.law.value(self.signs * x)
        return np.asarray(self.bonds.weights * plain)

    def dissipated(self, x: Array, traction: Array, memory: Array) -> Array:
        """The energy that is lost for good once the vertices have been at x, or where they were before, (r,).

        Args:
            x: coordinates, (r,).
            traction: along them, (r,).
            memory: as above, (r, 4).
        """
        if not self.remembers:
            return np.zeros_like(x)
        turned = np.where(self.law.even & (x < 0.0), -1.0, 1.0)  # both sides of an even law remember the same
        at, there, ends, tractions = (turned * x)[:, None], (turned * traction)[:, None], memory[:, :2], memory[:, 2:]
        reached = ((at > 0.0) == [False, True]) & (np.abs(at) >= np.abs(ends) * (1.0 - 1e-12))
        ends, tractions = np.where(reached, at, ends), np.where(reached, there, tractions)
        taken = self.law.value((self.signs[:, None] * ends).ravel()) - self.law.value(np.zeros(1))  # smoothed: not 0
        lost = taken.reshape(ends.shape) - 0.5 * ends * tractions
        return np.asarray(self.bonds.weights * (lost[:, 1] if self.law.even else lost.sum(axis=1)))

    def _limit(self, x: Array, side: str) -> Array:
        if self.polyline is not None:
            return self.polyline.traction(x, side)
        return self.law.left(x) if side == "left" else self.law.right(x)


def _other(side: str) -> str:
    return "right" if side == "left" else "left"


def law_rows(problem: CondensedProblem, remember: Collection[int]) -> list[LawRows]:
    """The laws of all groups of a problem's bonds.

    Args:
        problem: the problem.
        remember: numbers of the groups that remember; those of linear laws have nothing to remember.
    """
    return [
        LawRows(
            bonds=bonds,
            polyline=graph_of(bonds.law),
            signs=np.ones(len(bonds.weights)) if bonds.radial else np.sign(bonds.signs[:, 0]),
            remembers=number in remember and not bonds.law.is_linear,
        )
        for number, bonds in enumerate(problem.bonds)
    ]
