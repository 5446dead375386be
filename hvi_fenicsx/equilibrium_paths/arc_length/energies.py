"""The energies along a curve that is not straight: work by quadrature, what is stored and lost from the laws."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array
from .bond_energies import BondEnergies
from .equations import Place
from .events import Move
from .sites import Sites, Values

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, kw_only=True)
class Stored:
    """The energies of one state.

    Attributes:
        energy: ½ a(u, u) - <g, u> + what the bonds would give back.
        potential: <g, u>.
        dissipated: lost in bonds with memory.
        size: of the terms.
        elastic: ½ a(u, u).
        lost: by each bond with memory, for 1 at its mode, (b,).
        scales: of the bonds' energies by mode, (b,).
    """

    energy: float
    potential: float
    dissipated: float
    size: float
    elastic: float = 0.0
    lost: Array = field(default_factory=lambda: np.zeros(0))
    scales: Array = field(default_factory=lambda: np.zeros(0))


class Balance:
    """Work and dissipation, added up from state to state.

    Args:
        problem: the problem.
        sites: its sites.
        work: done before.
        dissipated: before.

    Attributes:
        work: done by the loads and by what moves prescribed displacements.
        stored: the energies of the last state.
    """

    def __init__(self, problem: CondensedProblem, sites: Sites, work: float = 0.0, dissipated: float = 0.0) -> None:
        self._problem, self._sites, self.work = problem, sites, work
        self._size = sum(float(b.weights.sum()) * b.law.energy_scale for b in problem.bonds)
        self._bonds = BondEnergies(problem, sites)
        self._potential, self._lost = all(b.mixity is None for b in problem.bonds), dissipated
        self.stored = Stored(energy=0.0, potential=0.0, dissipated=0.0, size=0.0)

    def at(self, values: Values, factor: float) -> Stored:
        """The energies of a state.

        Args:
            values: of the sites.
            factor: λ.
        """
        problem, x = self._problem, values.x
        elastic, load = 0.5 * float(x @ (problem.stiffness @ x)), float(problem.load(factor) @ x)
        constant = problem.constant_at(factor)
        plain = sum(b.energy(x) for n, b in enumerate(problem.bonds) if n not in self._bonds.numbers)
        back, lost, scales = self._bonds(values)
        all_lost = float(scales @ lost)
        return Stored(
            energy=elastic - load + constant + plain + back,
            potential=problem.potential(x, factor),
            dissipated=all_lost if self._potential else self._lost,
            size=abs(elastic) + abs(load) + abs(constant) + abs(plain) + abs(back) + all_lost,
            elastic=elastic,
            lost=lost,
            scales=scales,
        )

    def begin(self, values: Values, factor: float) -> None:
        """Start at a state.

        Args:
            values: of the sites.
            factor: λ.
        """
        self.stored = self.at(values, factor)

    def go(self, move: Move, unit: float) -> None:
        """Along a step.

        Args:
            move: the step.
            unit: of the factor.
        """
        after = self.at(move.after.values, float(move.after.y[-1]) * unit)
        done = after.potential - self.stored.potential + self._moved(move, unit)
        self.work += done
        if not self._potential:  # the bonds have no energy but the frozen one: what the work leaves is lost
            before = self.stored.energy + self.stored.potential
            self._lost += done - (after.energy + after.potential - before)
            after = replace(after, dissipated=self._lost)
        self._size = max(self._size, after.size)
        self.stored = after

    def leap(self, values: Values, factor: float) -> float:
        """To another state at the same factor; returns the energy that is released.

        Bonds whose energy depends on the mode lose what they break by at the mode of that state.

        Args:
            values: of the sites.
            factor: λ.
        """
        before, after = self.stored, self.at(values, factor)
        if not self._potential:
            self._lost += float(after.scales @ (after.lost - before.lost))
            after = replace(after, dissipated=self._lost)
        self.stored = after
        self.work += self.stored.potential - before.potential
        return before.energy + before.dissipated - self.stored.energy - self.stored.dissipated

    def disagreement(self, move: Move, unit: float) -> float:
        """By how much the work along a step misses what the energies say, 1 for all that is allowed.

        Args:
            move: the step.
            unit: of the factor.
        """
        if not self._potential:
            return 0.0
        ends = [self.at(place.values, float(place.y[-1]) * unit) for place in (move.before, move.after)]
        change = sum(sign * (e.energy - e.elastic + e.dissipated) for sign, e in zip((-1.0, 1.0), ends, strict=True))
        change += self._strained(move)
        size = max(self._size, *(e.size for e in ends))
        return abs(change - self._moved(move, unit)) / (self._sites.thresholds.curve.agreed * size or 1.0)

    def _strained(self, move: Move) -> float:
        """The change of ½ xᵀ S x, without the rounding that large displacements leave in each of its ends."""
        before, after = move.before.values.x, move.after.values.x
        return 0.5 * float((before + after) @ (self._problem.stiffness @ (after - before)))

    def _moved(self, move: Move, unit: float) -> float:
        """The change of the energy's constant less ∫ f1ᵀx dλ."""
        start, end = (float(place.y[-1]) * unit for place in (move.before, move.after))
        problem = self._problem
        change = problem.constant_at(end) - problem.constant_at(start)
        return change - self._product(move, unit)

    def _product(self, move: Move, unit: float) -> float:
        """∫ f1ᵀx dλ, both as cubic polynomials of the arc length."""
        length = float(np.linalg.norm(move.after.y - move.before.y))
        rate = self._problem.force_rate
        driven, factors = [], []
        for place in (move.before, move.after):
            driven += [float(rate @ place.values.x), length * float(rate @ displacement_rate(self._sites, place))]
            factors += [float(place.y[-1]) * unit, length * unit * float(place.tangent[-1])]
        t = 0.5 * (1.0 + _POINTS)
        return float(0.5 * _WEIGHTS @ (_cubic(t, driven) * _cubic_rate(t, factors)))


def displacement_rate(sites: Sites, place: Place) -> Array:
    """How the displacements change along the tangent at a place of the present cell, (n,).

    Args:
        sites: the sites.
        place: the place.
    """
    return sites.moved(place.values) @ place.tangent[:-1]


def _cubic(t: Array, ends: list[float]) -> Array:
    """The cubic polynomial with value and derivative at 0 and at 1."""
    a, da, b, db = ends
    return np.asarray(
        (1 + 2 * t) * (1 - t) ** 2 * a + t * (1 - t) ** 2 * da + t**2 * (3 - 2 * t) * b + t**2 * (t - 1) * db
    )


def _cubic_rate(t: Array, ends: list[float]) -> Array:
    a, da, b, db = ends
    return np.asarray(6 * t * (1 - t) * (b - a) + (1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db)
