"""The laws of a condensed problem, vertex by vertex: on one unknown or the length of two, with what each remembers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...laws import Mixity, Superpotential, TractionGraph
from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array, Mask
from ..graphs import Passed, graph_of, on_corner, remembering, turned, was_passed


@dataclass(slots=True, kw_only=True)
class VertexLaw:
    """A law at one vertex. Its coordinate is its unknown, or the length of its unknowns.

    Attributes:
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

    @property
    def curved(self) -> bool:
        """Whether its traction is not piecewise linear."""
        return self.polyline is None

    def graph(self) -> TractionGraph:
        """Traction over the coordinate, with memory; of a curved law the chords between its breaks."""
        return self._plain if self.passed is None else remembering(self._plain, self.passed)

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

    def remember(self, x: float, traction: float) -> None:
        """Note a coordinate and its traction.

        Args:
            x: the coordinate.
            traction: along it.
        """
        if self.passed is not None:
            x, traction = on_corner(self._plain, x, traction, 1e-11)
            self.passed = self.passed.reached(x, traction, even=self.law.even)

    def memory(self) -> list[float]:
        """What it remembers: least and greatest coordinate, and the tractions there; zeros without memory."""
        return (self.passed or Passed()).row

    def restore(self, memory: Array) -> None:
        """Take over what it remembered.

        Args:
            memory: as :meth:`memory`, (4,).
        """
        if self.passed is not None:
            self.passed = Passed.of(memory)


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
    return [
        law
        for number, group in enumerate(problem.bonds)
        for law in _of_group(problem, number, remembers=number in remember and not group.law.is_linear)
    ]


def _of_group(problem: CondensedProblem, number: int, *, remembers: bool) -> Iterator[VertexLaw]:
    group = problem.bonds[number]
    graph, ends = graph_of(group.law), np.column_stack([problem.lower, problem.upper])
    for row, weight in enumerate(group.weights):
        unknowns, sign = tuple(int(i) for i in group.unknowns[row, :]), float(np.sign(group.signs[row, 0]))
        yield VertexLaw(
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
    at = np.array([x])
    left, right = (np.array([float(law.traction(at, side)[0]) for law in laws]) for side in ("left", "right"))
    weights = np.array([law.weight for law in laws])
    jump = float(weights @ (right - left))
    share = 0.0 if jump == 0.0 else min(max((force - float(weights @ left)) / jump, 0.0), 1.0)
    return [float(t) for t in left + share * (right - left)]
