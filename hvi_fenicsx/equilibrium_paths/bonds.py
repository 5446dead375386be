"""The bonds of a condensed problem, one by one: their graphs along their unknowns, and what each remembers."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..laws import TractionGraph
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array
from .graphs import Passed, graph_of, on_corner, remembering, turned
from .segments import Component, Segment, chain
from .thresholds import DEFAULT, ExactThresholds

_ROUNDING = 1e-12
"""A displacement so small beside the length scale of a law is none."""


def is_piecewise_linear(problem: CondensedProblem) -> bool:
    """Whether all equilibria form a piecewise linear curve: each law acts on one unknown and has a graph."""
    return all(not b.radial and graph_of(b.law) is not None for b in problem.bonds)


@dataclass(slots=True, kw_only=True)
class Bond:
    """A law at one vertex.

    Attributes:
        group: number of its :class:`.Bonds`.
        unknown: what it acts on.
        graph: traction along the unknown, without memory.
        weight: lumped area.
        even: whether its law is.
        passed: what it remembers; None without memory.
        none: a displacement that is rounding; 0 where the traction jumps at 0, and no side is like the other.
        present: traction along the unknown, with memory.
    """

    group: int
    unknown: int
    graph: TractionGraph
    weight: float
    even: bool
    passed: Passed | None
    none: float
    present: TractionGraph

    @property
    def component(self) -> Component:
        """What it adds to the graph of its unknown."""
        ends = None if self.passed is None else self.passed.displacements
        return Component(graph=self.present, weight=self.weight, passed=ends)

    def remember(self, x: float, traction: float) -> None:
        """Note a displacement and its traction.

        Args:
            x: of the unknown.
            traction: along the unknown.
        """
        if self.passed is not None:
            self.passed = self.passed.reached(*on_corner(self.graph, x, traction), even=self.even)
            self.present = remembering(self.graph, self.passed)

    def dissipated(self, x: float, traction: float) -> float:
        """The energy that is lost for good once the bond has been at x, or where it was before.

        Args:
            x: of the unknown.
            traction: along the unknown.
        """
        if self.passed is None:
            return 0.0
        passed = self.passed.reached(x, traction, even=self.even)
        ends, tractions = np.array(passed.displacements), np.array(passed.tractions)
        lost = self.graph.primitive(ends) - 0.5 * ends * tractions
        return self.weight * float(lost[1] if self.even else lost.sum())


class BondTable:
    """All bonds of a problem, by unknown.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds (groups) that remember; those of linear laws have nothing to remember.
        thresholds: of the path.

    Attributes:
        thresholds: of the path.

    Raises:
        InputError: a law is not piecewise linear, or acts on |u_t| in 3D.
    """

    def __init__(
        self, problem: CondensedProblem, remember: Collection[int] = (), thresholds: ExactThresholds = DEFAULT.exact
    ) -> None:
        if not is_piecewise_linear(problem):
            raise InputError(
                "the exact path needs laws whose graph is piecewise linear, each along one component of the "
                "displacement; here one is smoothed or curved, or acts on |u_t| in space"
            )
        self.problem, self.bonds, self.thresholds = problem, self._made(problem, remember), thresholds
        self._at: list[list[Bond]] = [[] for _ in range(problem.size)]
        for bond in self.bonds:
            self._at[bond.unknown].append(bond)
        self._chains: dict[tuple[object, ...], tuple[Segment, ...]] = {}
        self.weights = np.array([sum(b.weight for b in bonds) for bonds in self._at], dtype=np.float64)
        with_memory = [[b.passed is not None for b in bonds] for bonds in self._at]
        self._remembering = {b.group for b in self.bonds if b.passed is not None}
        self._alone = np.array([i for i, kinds in enumerate(with_memory) if kinds and all(kinds)], dtype=np.int64)
        self._both = [i for i, kinds in enumerate(with_memory) if any(kinds) and not all(kinds)]

    @staticmethod
    def _made(problem: CondensedProblem, remember: Collection[int]) -> list[Bond]:
        found: list[Bond] = []
        for number, group in enumerate(problem.bonds):
            graph = graph_of(group.law)
            assert graph is not None
            ways = {1.0: graph, -1.0: turned(graph)}
            remembers = number in remember and not group.law.is_linear
            found += _bonds(number, group, ways, remembers=remembers)
        return found

    @property
    def remembers(self) -> bool:
        """Whether any bond has a memory."""
        return bool(self._remembering)

    @property
    def with_memory(self) -> list[int]:
        """The unknowns on which bonds with memory act."""
        return [*(int(i) for i in self._alone), *self._both]

    def at(self, unknown: int) -> list[Bond]:
        """The bonds that act on an unknown."""
        return self._at[unknown]

    def chain(self, unknown: int) -> tuple[Segment, ...]:
        """The segments of an unknown, with what its bonds remember now."""
        problem, components = self.problem, [b.component for b in self._at[unknown]]
        ends = float(problem.lower[unknown]), float(problem.upper[unknown])
        if len(components) != 1 or components[0].passed not in (None, (0.0, 0.0)):
            return chain(components, *ends)
        one = components[0]
        key = id(one.graph), one.passed, ends
        if key not in self._chains:
            self._chains[key] = chain([replace(one, weight=1.0)], *ends)
        return tuple(s.weighted(one.weight) for s in self._chains[key])

    def tractions(self, unknown: int, x: float, force: float) -> list[float]:
        """The tractions of an unknown's bonds that give a force together.

        Args:
            unknown: its number.
            x: its displacement.
            force: the force of all its bonds.
        """
        bonds = self._at[unknown]
        at = np.array([_on_break(x, bonds)])
        left = np.array([float(b.present.traction(at, "left")[0]) for b in bonds])
        right = np.array([float(b.present.traction(at, "right")[0]) for b in bonds])
        weights = np.array([b.weight for b in bonds])
        jump = float(weights @ (right - left))
        share = 0.0 if jump == 0.0 else min(max((force - float(weights @ left)) / jump, 0.0), 1.0)
        return list(left + share * (right - left))

    def remember(self, unknown: int, x: float, force: float) -> float:
        """Note where an unknown's bonds have been; the displacement, 0 where it is rounding, at which they are then.

        Args:
            unknown: its number.
            x: its displacement.
            force: the force of all its bonds.
        """
        x = x if any(abs(x) > bond.none for bond in self._at[unknown]) else 0.0
        for bond, traction in zip(self._at[unknown], self.tractions(unknown, x, force), strict=True):
            bond.remember(x, traction)
        return x

    def recoverable(self, x: Array, force: Array) -> float:
        """What the bonds give back on the way to zero: Σ w j, or the triangle under the secant of one with memory.

        Args:
            x: the unknowns, (n,).
            force: of the bonds of each, (n,).
        """
        plain = sum(g.energy(x) for n, g in enumerate(self.problem.bonds) if n not in self._remembering)
        return plain + 0.5 * float(x[self._alone] @ force[self._alone]) + self._mixed(x, force)

    def _mixed(self, x: Array, force: Array) -> float:
        """The triangles at unknowns where bonds with and without memory act."""
        found = 0.0
        for i in self._both:
            shares = zip(self._at[i], self.tractions(i, float(x[i]), float(force[i])), strict=True)
            found += sum(0.5 * b.weight * t * float(x[i]) for b, t in shares if b.passed is not None)
        return found

    def dissipated(self, x: Array, force: Array) -> float:
        """The energy that bonds with memory have lost for good.

        Args:
            x: the unknowns, (n,).
            force: of the bonds of each, (n,).
        """
        return sum(
            bond.dissipated(float(x[i]), traction)
            for i in self.with_memory
            for bond, traction in zip(self._at[i], self.tractions(i, float(x[i]), float(force[i])), strict=True)
        )

    @property
    def memory(self) -> Array:
        """What each bond remembers: displacements and tractions on either side, zero without memory, (bonds, 4)."""
        return np.array([(b.passed or Passed()).row for b in self.bonds]).reshape(-1, 4)

    def restore(self, memory: Array) -> None:
        """Take over what bonds remembered.

        Args:
            memory: as :attr:`memory` was, (bonds, 4).
        """
        for number, bond in enumerate(self.bonds):
            if bond.passed is not None:
                passed = Passed.of(memory[number, :])
                if passed != bond.passed:
                    bond.passed, bond.present = passed, remembering(bond.graph, passed)


def _on_break(x: float, bonds: list[Bond]) -> float:
    """The break of a graph that a displacement is but for rounding; else the displacement."""
    breaks = (float(b.present.breaks[np.argmin(np.abs(b.present.breaks - x))]) for b in bonds)
    return next((b for b in breaks if abs(b - x) <= 1e-12 * abs(b)), x)


def _bonds(number: int, group: Bonds, ways: dict[float, TractionGraph], *, remembers: bool) -> list[Bond]:
    """The bonds of one law."""
    zero = np.zeros(1)
    jumps = bool(group.law.left(zero)[0] != group.law.right(zero)[0])
    none = 0.0 if jumps else _ROUNDING * group.law.length_scale
    rows = zip(group.unknowns[:, 0], np.sign(group.signs[:, 0]), group.weights, strict=True)
    return [
        Bond(
            group=number,
            unknown=int(unknown),
            graph=ways[float(sign)],
            weight=float(weight),
            even=group.law.even,
            passed=Passed() if remembers else None,
            none=none,
            present=ways[float(sign)],
        )
        for unknown, sign, weight in rows
    ]
