"""The laws of a condensed problem, vertex by vertex, over one coordinate each, with what each remembers."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..laws import Superpotential, TractionGraph, VertexLaws
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..reduced.condensed_stiffness import DenseStiffness
from ..typing import Array, magnitude
from .thresholds import ROUNDING


def is_straight(problem: CondensedProblem) -> bool:
    """Whether all equilibria form a piecewise linear curve: each law acts on one unknown and has a graph."""
    return all(not b.radial and b.law.graph is not None for b in problem.bonds)


@dataclass(slots=True, kw_only=True)
class VertexLaw:
    """A law at one vertex. Its coordinate is its unknown, or the length of its unknowns.

    Attributes:
        row: its number among all vertices' laws.
        group: number of its :class:`.Bonds`.
        bonds: these.
        laws: the laws of the group, with what they remember.
        number: of the vertex among them.
        bounds: finite bounds of its coordinate; there chords of a curved law have its traction.
    """

    row: int
    group: int
    bonds: Bonds
    laws: VertexLaws
    number: int
    bounds: tuple[float, ...]
    _present: TractionGraph | None = None

    @property
    def law(self) -> Superpotential:
        """The law."""
        return self.laws.law

    @property
    def unknowns(self) -> tuple[int, ...]:
        """What it acts on, one, or those of a length."""
        return tuple(int(i) for i in self.bonds.unknowns[self.number])

    @property
    def weight(self) -> float:
        """Lumped area."""
        return float(self.laws.weights[self.number])

    @property
    def curved(self) -> bool:
        """Whether its traction is not piecewise linear."""
        return self.law.graph is None

    @property
    def memory(self) -> Array:
        """What it remembers: the least and the greatest coordinate, and the tractions there; zeros without memory."""
        return np.zeros(4) if self.laws.memory is None else self.laws.memory[self.number]

    @property
    def passed(self) -> tuple[float, float] | None:
        """The least and the greatest coordinate so far; None without memory."""
        return None if self.laws.memory is None else (float(self.memory[0]), float(self.memory[1]))

    @property
    def graph(self) -> TractionGraph:
        """Traction over the coordinate, with memory; of a curved law the chords between its breaks."""
        if self._present is None:
            self._present = self.laws.graph(self.number, np.array(self.bounds))
        return self._present

    @property
    def _one(self) -> VertexLaws:
        return self.laws.at(slice(self.number, self.number + 1))

    def force(self, x: Array, side: str) -> Array:
        """The limit of the force on the graph from one side, (m,).

        Args:
            x: coordinates, (m,).
            side: "left" or "right".
        """
        return self.weight * self.graph.traction(x, side)

    def slope(self, x: float) -> float:
        """The slope of the force on the graph off its breaks."""
        return self.weight * float(self.graph.slopes[np.searchsorted(self.graph.breaks, x)])

    def has_passed(self, x: float) -> bool:
        """Whether it has nothing to remember at a coordinate, or has been there."""
        return self.passed is None or self.passed[0] < x < self.passed[1]

    def returns(self, x: float) -> bool:
        """Whether it returns on a line through 0 as it came, from a coordinate where it has not been."""
        line, slope = float(self.force(np.array([x]), "right")[0]), self.slope(x)
        return abs(line - slope * x) <= ROUNDING * (abs(line) + abs(slope * x))

    def changes(self, at: float) -> bool:
        """Whether the graph has another piece from a coordinate on.

        A piece of a curved law that has been passed ends where the bond has been, even if its chords go on.
        """
        graph, number = self.graph, int(np.searchsorted(self.graph.breaks, at))
        if number == len(graph.breaks) or graph.breaks[number] != at:
            return False
        if self.curved and self.passed is not None and at != 0.0 and at in self.passed:
            return True
        return bool(graph.left[number] != graph.right[number] or graph.slopes[number] != graph.slopes[number + 1])

    def limits(self, x: float) -> Array:
        """The limits of the traction along the coordinate from the left and from the right, with memory, (2,).

        Args:
            x: the coordinate.
        """
        return np.concatenate(self._one.limits(np.array([x])))

    def has_moved(self, x: float) -> bool:
        """Whether a coordinate is not rounding; where the traction jumps at 0 none is: no side is like the other.

        Args:
            x: the coordinate.
        """
        zero = np.zeros(1)
        jumps = self.law.left(zero)[0] != self.law.right(zero)[0]
        return bool(jumps or abs(x) > ROUNDING * self.law.length_scale)

    def remember(self, x: float, traction: float) -> None:
        """Note a coordinate and its traction.

        Args:
            x: the coordinate.
            traction: along it.
        """
        if self.laws.memory is not None:
            found = _on_corner(self.graph, x, traction, 1e-11)
            at, there = (np.array([value]) for value in found)
            self.laws.memory[self.number] = self._one.remembering(at, there).memory
        self.forget_graph()

    def forget_graph(self) -> None:
        """Make the graph anew, since something else is remembered."""
        self._present = None


def _on_corner(graph: TractionGraph, x: float, traction: float, rounding: float) -> tuple[float, float]:
    """A point of a graph; where it is an end of a piece or jump but for rounding, that end."""
    nearest = float(graph.breaks[np.argmin(np.abs(graph.breaks - x))])
    if abs(nearest - x) > rounding * abs(x):
        return x, traction
    ends = [float(graph.traction(np.array([nearest]), side)[0]) for side in ("left", "right")]
    size = magnitude([graph.left, graph.right])  # where a bond is broken, both ends are zero
    return nearest, next((end for end in ends if abs(end - traction) <= rounding * size), traction)


def vertex_laws(problem: CondensedProblem, remember: Collection[int]) -> list[VertexLaw]:
    """The laws of a problem at all vertices, in the order of its bonds.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds (groups) that remember; those of linear laws have nothing to remember.
    """
    found: list[VertexLaw] = []
    for group, bonds in enumerate(problem.bonds):
        laws = bonds.laws.with_memory if group in remember else bonds.laws
        first = bonds.unknowns[:, 0]
        ends = np.column_stack([problem.lower[first], problem.upper[first]])
        found += [
            VertexLaw(
                row=len(found) + number,
                group=group,
                bonds=bonds,
                laws=laws,
                number=number,
                bounds=() if bonds.radial else tuple(float(x) for x in ends[number] if np.isfinite(x)),
            )
            for number in range(len(bonds.weights))
        ]
    return found


def shares(laws: Sequence[VertexLaw], x: float, force: float) -> list[float]:
    """The tractions of laws on one coordinate that give a force together.

    Args:
        laws: the laws.
        x: their coordinate.
        force: of all of them.
    """
    if len(laws) == 1:
        return [force / laws[0].weight]
    breaks = np.concatenate([law.graph.breaks for law in laws])
    nearest = float(breaks[np.argmin(np.abs(breaks - x))])
    at = nearest if abs(nearest - x) <= ROUNDING * abs(nearest) else x
    left, right = np.array([law.limits(at) for law in laws]).T
    weights = np.array([law.weight for law in laws])
    jump = float(weights @ (right - left))
    share = 0.0 if jump == 0.0 else min(max((force - float(weights @ left)) / jump, 0.0), 1.0)
    return [float(t) for t in left + share * (right - left)]


def multiplied(problem: CondensedProblem) -> tuple[CondensedProblem, Array]:
    """The problem in unknowns on whose length laws act, and what they are multiplied by for that, (n,).

    Args:
        problem: the problem.
    """
    factors = np.ones(problem.size)
    if is_straight(problem):
        return problem, factors
    for bonds in problem.bonds:
        if bonds.radial:
            factors[bonds.unknowns] = bonds.signs
    ends = np.sort(np.stack([problem.lower * factors, problem.upper * factors]), axis=0)
    found = replace(
        problem,
        elastic=DenseStiffness(problem.stiffness / np.outer(factors, factors)),
        force=problem.force / factors,
        force_rate=problem.force_rate / factors,
        lower=ends[0],
        upper=ends[1],
        applied=problem.applied / factors,
        bonds=tuple(replace(b, signs=b.signs / factors[b.unknowns]) for b in problem.bonds),
    )
    return found, factors
