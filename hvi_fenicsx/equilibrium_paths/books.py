"""The energies along a path: what the loads put in, what is stored, and what is lost."""

from __future__ import annotations

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable


class EnergyBalance:
    """Work and dissipation, added up from state to state.

    Args:
        problem: the problem.
        bonds: its bonds.
        work: done before.
        dissipated: before.

    Attributes:
        work: done by the loads and by what moves prescribed displacements.
        dissipated: in bonds with memory.
        energy: ½ a(u, u) - <g, u> + what the bonds would give back.
    """

    def __init__(self, problem: CondensedProblem, bonds: BondTable, work: float = 0.0, dissipated: float = 0.0) -> None:
        self._problem, self._bonds, self.work, self.dissipated = problem, bonds, work, dissipated
        self.energy = 0.0

    def begin(self, x: Array, force: Array, factor: float, *, anew: bool) -> None:
        """Start at a state.

        Args:
            x: the unknowns, (n,).
            force: of their bonds, (n,).
            factor: λ.
            anew: whether a path begins here; else one goes on.
        """
        self._note(x, force, factor)
        if anew:
            self.dissipated = self._bonds.dissipated(x, force)

    def _note(self, x: Array, force: Array, factor: float) -> None:
        problem = self._problem
        self._x, self._force, self._factor = x, force, factor
        self._recoverable = self._bonds.recoverable(x, force)
        self._potential = problem.potential(x, factor)
        elastic = 0.5 * float(x @ (problem.elastic @ x)) - float(problem.load(factor) @ x)
        self._constant = problem.constant_at(factor)
        self.energy = elastic + self._constant + self._recoverable

    def go(self, x: Array, force: Array, factor: float) -> None:
        """Along a straight part of the path.

        Args:
            x: the unknowns, (n,).
            force: of their bonds, (n,).
            factor: λ.
        """
        before, constant = (self._x, self._force, self._factor), self._constant
        potential, recoverable = self._potential, self._recoverable
        self._note(x, force, factor)
        change = self._constant - constant
        change -= 0.5 * float(self._problem.force_rate @ (x + before[0])) * (factor - before[2])
        self.work += change + self._potential - potential
        taken = 0.5 * float((force + before[1]) @ (x - before[0]))
        if self._bonds.remembers:
            self.dissipated += taken - (self._recoverable - recoverable)

    def leap(self, x: Array, force: Array) -> float:
        """To another state at the same factor; returns the energy that is released.

        Args:
            x: the unknowns, (n,).
            force: of their bonds, (n,).
        """
        before = self.energy + self.dissipated
        potential = self._potential
        self._note(x, force, self._factor)
        self.work += self._potential - potential
        self.dissipated = self._bonds.dissipated(x, force)
        return before - self.energy - self.dissipated
