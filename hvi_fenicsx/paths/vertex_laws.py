"""The laws of a condensed problem, vertex by vertex: on one unknown or the length of two, with what each remembers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..laws import Mixity, Superpotential, TractionGraph
from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array, Mask
from .graphs import Passed, graph_of, on_corner, remembering, turned, was_passed

_ROUNDING = 1e-12
"""A displacement so small beside the length scale of a law is none."""


@dataclass(slots=True, kw_only=True)
class VertexLaw:
    """A law at one vertex. Its coordinate is its unknown, or the length of its unknowns.

    Attributes:
        row: its number among all vertices' laws.
        group: number of its :class:`.Bonds`.
        unknowns: what it acts on, one, or those of a length.
        radial: whether it acts on a length.
        opens: whether the first of them is an opening, which counts only where it is positive.
        sign: the law's argument is that times the coordinate.
        law: j.
        polyline: the traction graph of the law; None where it is curved.
        weight: lumped area.
        bounds: finite bounds of its coordinate; there chords of a curved law have its traction.
        passed: what it remembers, along its coordinate; None without memory.
        mixity: how the energy of separation depends on the mode; None: it does not.
    """

    row: int
    group: int
    unknowns: tuple[int, ...]
    radial: bool
    opens: bool
    sign: float
    law: Superpotential
    polyline: TractionGraph | None
    weight: float
    bounds: tuple[float, ...]
    passed: Passed | None
    mixity: Mixity | None = None
    _present: TractionGraph | None = None

    @property
    def curved(self) -> bool:
        """Whether its traction is not piecewise linear."""
        return self.polyline is None

    def graph(self) -> TractionGraph:
        """Traction over the coordinate, with memory; of a curved law the chords between its breaks."""
        if self._present is None:
            self._present = self._plain if self.passed is None else remembering(self._plain, self.passed)
        return self._present

    @property
    def _plain(self) -> TractionGraph:
        """The same without memory."""
        graph = self.polyline if self.polyline is not None else chords(self.law, self.sign * self._ends)
        return graph if self.sign > 0.0 else turned(graph)

    @property
    def _ends(self) -> Array:
        return np.array([*self.bounds, *(() if self.passed is None else self.passed.displacements)])

    def traction(self, x: Array, side: str) -> Array:
        """The limit of the traction along the coordinate, with memory, (m,).

        Args:
            x: coordinates, (m,).
            side: "left" or "right".
        """
        return self.graph().traction(x, side) if not self.curved else self._curved_traction(x, side)

    def _curved_traction(self, x: Array, side: str) -> Array:
        same = (side == "right") == (self.sign > 0.0)
        limit = self.law.right if same else self.law.left
        found = self.sign * limit(self.sign * x)
        inside = self._inside(x, side)
        return np.where(inside, self.graph().traction(x, side), found) if np.any(inside) else found

    def _inside(self, x: Array, side: str) -> Mask:
        """Whether the limit is taken where the bond has been."""
        low, high = (self.passed or Passed()).displacements
        return was_passed(x, low, high, side)

    def has_moved(self, x: float) -> bool:
        """Whether a coordinate is not rounding; where the traction jumps at 0 none is: no side is like the other.

        Args:
            x: the coordinate.
        """
        zero = np.zeros(1)
        jumps = self.law.left(zero)[0] != self.law.right(zero)[0]
        return bool(jumps or abs(x) > _ROUNDING * self.law.length_scale)

    def remember(self, x: float, traction: float) -> None:
        """Note a coordinate and its traction.

        Args:
            x: the coordinate.
            traction: along it.
        """
        if self.passed is not None:
            x, traction = on_corner(self._plain, x, traction, 1e-11)
            self.passed, self._present = self.passed.reached(x, traction, even=self.law.even), None

    def memory(self) -> list[float]:
        """What it remembers: least and greatest coordinate, and the tractions there; zeros without memory."""
        return (self.passed or Passed()).row

    def restore(self, memory: Array) -> None:
        """Take over what it remembered.

        Args:
            memory: as :meth:`memory`, (4,).
        """
        if self.passed is not None:
            self.passed, self._present = Passed.of(memory), None


def chords(law: Superpotential, more: Array) -> TractionGraph:
    """The traction graph of a curved law with chords between its breaks, and zero slopes outside.

    Args:
        law: the law.
        more: displacements that are breaks as well.
    """
    breaks = np.union1d(law.breaks, more)
    left, right = law.left(breaks), law.right(breaks)
    slopes = (left[1:] - right[:-1]) / np.diff(breaks)
    return TractionGraph(breaks, left, right, np.concatenate([[0.0], slopes, [0.0]]))


def vertex_laws(problem: CondensedProblem, remember: Collection[int]) -> list[VertexLaw]:
    """The laws of a problem at all vertices, in the order of its bonds.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds (groups) that remember; those of linear laws have nothing to remember.
    """
    found: list[VertexLaw] = []
    for number, group in enumerate(problem.bonds):
        remembers = number in remember and not group.law.is_linear
        found += _of_group(problem, number, len(found), remembers=remembers)
    return found


def _of_group(problem: CondensedProblem, number: int, first: int, *, remembers: bool) -> Iterator[VertexLaw]:
    group = problem.bonds[number]
    graph, ends = graph_of(group.law), np.column_stack([problem.lower, problem.upper])
    for row, weight in enumerate(group.weights):
        unknowns, sign = tuple(int(i) for i in group.unknowns[row, :]), float(np.sign(group.signs[row, 0]))
        yield VertexLaw(
            row=first + row,
            group=number,
            unknowns=unknowns,
            radial=group.radial,
            opens=group.opens,
            sign=1.0 if group.radial else sign,
            law=group.law,
            polyline=graph,
            weight=float(weight),
            bounds=() if group.radial else tuple(float(x) for x in ends[unknowns[0]] if np.isfinite(x)),
            passed=Passed() if remembers else None,
            mixity=group.mixity,
        )


def shares(laws: Sequence[VertexLaw], x: float, force: float) -> list[float]:
    """The tractions of laws on one coordinate that give a force together.

    Args:
        laws: the laws.
        x: their coordinate.
        force: of all of them.
    """
    if len(laws) == 1:
        return [force / laws[0].weight]
    breaks = np.concatenate([law.graph().breaks for law in laws])
    nearest = float(breaks[np.argmin(np.abs(breaks - x))])
    at = np.array([nearest if abs(nearest - x) <= _ROUNDING * abs(nearest) else x])
    left, right = (np.array([float(law.traction(at, side)[0]) for law in laws]) for side in ("left", "right"))
    weights = np.array([law.weight for law in laws])
    jump = float(weights @ (right - left))
    share = 0.0 if jump == 0.0 else min(max((force - float(weights @ left)) / jump, 0.0), 1.0)
    return [float(t) for t in left + share * (right - left)]


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
