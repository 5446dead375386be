"""Laws whose traction is piecewise linear: all follows from the table of a `TractionGraph`."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from ..errors import InputError
from ..typing import Array, Integers
from .base import Superpotential
from .convex_parts import ConvexPart, Directional
from .traction_bounds import Extremes
from .traction_graph import TractionGraph


@dataclass(frozen=True, eq=False)
class PolylinePart(ConvexPart):
    """A convex function whose derivative is a nondecreasing traction graph."""

    graph: TractionGraph

    @override
    @cached_property
    def kinks(self) -> Array:
        return self.graph.breaks[self.graph.jumps > 0.0]

    @override
    def value(self, x: Array) -> Array:
        return self.graph.primitive(x)

    @override
    def left(self, x: Array) -> Array:
        return self.graph.traction(x, "left")

    @override
    def right(self, x: Array) -> Array:
        return self.graph.traction(x, "right")

    @override
    def second(self, x: Array) -> Array:
        return self.graph.slope(x)

    @override
    def derivatives(self, x: Array) -> tuple[Array, Array]:
        return self.graph.right_and_slope(x)

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        return self.graph.slope_range(low, high)


class PolylineLaw(Superpotential):
    """A law given by a `TractionGraph`. A subclass writes `build`; all else follows.

    `reference_length` (m) is a displacement to be taken as typical where the graph has no break off zero.
    """

    @abstractmethod
    def build(self) -> TractionGraph:
        """The graph of the traction over displacement."""

    @property
    def reference_length(self) -> float:
        """Typical displacement of a graph without a break off zero, m."""
        return 1e-6

    @override
    @cached_property
    def graph(self) -> TractionGraph:
        """The table of the law; read `build` once."""
        return self.build()

    @cached_property
    def _split(self) -> tuple[TractionGraph, TractionGraph]:
        return self.graph.split()

    @override
    @cached_property
    def convex(self) -> ConvexPart:
        return PolylinePart(self._split[0])

    @override
    @cached_property
    def concave(self) -> ConvexPart:
        return PolylinePart(self._split[1])

    @override
    def value(self, x: Array) -> Array:
        return self.graph.primitive(x)

    @override
    def left(self, x: Array) -> Array:
        return self.graph.traction(x, "left")

    @override
    def right(self, x: Array) -> Array:
        return self.graph.traction(x, "right")

    @override
    def derivatives(self, x: Array) -> tuple[Array, Array]:
        return self.graph.right_and_slope(x)

    @override
    @cached_property
    def kinks(self) -> Array:
        return np.asarray(self.graph.breaks[self.graph.jumps != 0.0])

    @property
    @override
    def breaks(self) -> Array:
        return self.graph.breaks

    def piece(self, x: Array) -> Integers:
        """Number (m,) of breaks between 0 and x: the index of the segment, counted from 0 by |x|."""
        g = self.graph
        ahead = np.searchsorted(g.breaks[g.zero + 1 :], x, side="right")
        behind = np.searchsorted(-g.breaks[: g.zero][::-1], -x, side="right")
        return np.asarray(ahead + behind, dtype=np.int64)

    @override
    @cached_property
    def even(self) -> bool:
        g = self.graph
        return bool(
            np.array_equal(g.breaks, -g.breaks[::-1])
            and np.array_equal(g.left, -g.right[::-1])
            and np.array_equal(g.slopes, g.slopes[::-1])
        )

    @override
    @cached_property
    def is_linear(self) -> bool:
        g = self.graph
        return bool(np.all(g.left == g.right) and np.all(g.slopes == g.slopes[0]) and g.left[g.zero] == 0.0)

    @override
    @cached_property
    def steepest_fall(self) -> float:
        drops = bool(np.any(self.graph.jumps < 0.0))
        return np.inf if drops else max(0.0, -float(np.min(self.graph.slopes)))

    @override
    @cached_property
    def growth(self) -> Directional:
        g = self.graph
        return Directional(_limit(-g.left[0], g.slopes[0]), _limit(g.right[-1], g.slopes[-1]))

    @override
    @cached_property
    def peak(self) -> Directional:
        g = self.graph
        limits = np.concatenate([g.left, g.right])
        return Directional(
            max(self.growth.minus, float(np.max(-limits)) + 0.0), max(self.growth.plus, float(np.max(limits)))
        )

    @cached_property
    def _extremes(self) -> Extremes:
        """c3 and c4 in closed form: on each piece both quotients are monotone between their zeros."""
        g = self.graph
        sizes = np.maximum(np.abs(g.left), np.abs(g.right)) / (1.0 + np.abs(g.breaks))
        ahead = np.append(g.left[g.zero + 1 :], g.right[g.zero :])
        behind = np.append(g.left[: g.zero + 1], g.right[: g.zero])
        return Extremes(
            self.peak.minus,
            self.peak.plus,
            c3=float(max(sizes.max(), abs(g.slopes[0]), abs(g.slopes[-1]))),
            c4=float(max(0.0, np.max(-ahead), -self.growth.plus, np.max(behind), -self.growth.minus)),
        )

    @override
    @cached_property
    def length_scale(self) -> float:
        return self._scales[0]

    @override
    @cached_property
    def energy_scale(self) -> float:
        return self._scales[1]

    @property
    def _corners(self) -> Array:
        """Displacements that mean something where the law has no kink off zero."""
        return self.graph.breaks

    @cached_property
    def _scales(self) -> tuple[float, float]:
        """The first kink off zero (else corner, else the reference length) by which the law does work.

        The energy is the triangle ½ a max |traction| over |x| ≤ a: for the quadratic-linear law γ2 δ.
        """
        candidates = [self.kinks, self._corners, np.array([self.reference_length])]
        lengths = np.concatenate([np.unique(np.abs(c[c != 0.0])) for c in candidates])
        for a in lengths:
            traction = self._largest(float(a))
            if traction > 0.0:
                return float(a), 0.5 * float(a) * traction
        raise InputError(f"{self._title}: the traction is zero everywhere; leave the law away")

    def _largest(self, a: float) -> float:
        """Largest |traction| over [-a, a], the limits of the breaks in it included."""
        g = self.graph
        inside = np.abs(g.breaks) <= a
        ends = np.array([-a, a])
        return float(
            np.max(np.abs(np.concatenate([g.left[inside], g.right[inside], self.left(ends), self.right(ends)])))
        )


def _limit(traction: npt.ArrayLike, slope: float) -> float:
    """Limit of a ray that starts at the given traction with the given slope."""
    return float(np.asarray(traction)) + 0.0 if slope == 0.0 else float(np.copysign(np.inf, slope))
