"""Laws whose traction is piecewise linear: all follows from the table of a `TractionGraph`."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from ..errors import InputError
from ..typing import Array, Integers, magnitude
from .base import DEFAULT, ConvexPart, DerivedLaw, Directional, Superpotential
from .traction_graph import TractionGraph


class _OfGraph:
    """A function whose derivative is a traction graph. Arrays in and out have shape (m,)."""

    graph: TractionGraph

    def value(self, x: Array) -> Array:
        """The function."""
        return self.graph.primitive(x)

    def left(self, x: Array) -> Array:
        """Left derivative."""
        return self.graph.traction(x, "left")

    def right(self, x: Array) -> Array:
        """Right derivative."""
        return self.graph.traction(x, "right")


@dataclass(frozen=True, eq=False)
class PolylinePart(_OfGraph, ConvexPart):
    """A convex function whose derivative is a nondecreasing traction graph."""

    graph: TractionGraph

    @override
    @cached_property
    def kinks(self) -> Array:
        return self.graph.breaks[self.graph.jumps > 0.0]

    @override
    def second(self, x: Array) -> Array:
        return self.graph.slope(x)


class PolylineLaw(_OfGraph, Superpotential):
    """A law given by a `TractionGraph`. A subclass writes `build`; all else follows.

    `reference_slip` (m) is a displacement to be taken as typical where the graph has no break off zero.
    """

    reference_slip: float = 1e-6

    @abstractmethod
    def build(self) -> TractionGraph:
        """The graph of the traction over displacement."""

    @override
    @cached_property
    def graph(self) -> TractionGraph:  # type: ignore[override]
        """The table of the law; read `build` once."""
        return self.build()

    @override
    @cached_property
    def convex(self) -> ConvexPart:
        return PolylinePart(self.graph.split()[0])

    @override
    @cached_property
    def concave(self) -> ConvexPart:
        return PolylinePart(self.graph.split()[1])

    @override
    @cached_property
    def kinks(self) -> Array:
        return self.graph.breaks[self.graph.jumps != 0.0]

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
    @property
    def steepest_fall(self) -> float:
        return self.graph.steepest_fall

    @override
    @cached_property
    def growth(self) -> Directional:
        g = self.graph
        return Directional(_limit(-g.left[0], g.slopes[0]), _limit(g.right[-1], g.slopes[-1]))

    @cached_property
    def _extremes(self) -> tuple[Directional, float]:
        """In closed form: on each piece the traction is monotone."""
        g, growth = self.graph, self.growth
        limits = np.concatenate([g.left, g.right])
        ahead = np.append(g.left[g.zero + 1 :], g.right[g.zero :])
        behind = np.append(g.left[: g.zero + 1], g.right[: g.zero])
        peak = Directional(max(growth.minus, float(np.max(-limits)) + 0.0), max(growth.plus, float(np.max(limits))))
        return peak, float(max(0.0, np.max(-ahead), -growth.plus, np.max(behind), -growth.minus))

    @override
    @cached_property
    def length_scale(self) -> float:
        return self._scales[0]

    @override
    @cached_property
    def energy_scale(self) -> float:
        return self._scales[1]

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return PolylineInUnits(self, length, traction)

    @property
    def _corners(self) -> Array:
        """Displacements that mean something where the law has no kink off zero."""
        return self.graph.breaks

    @cached_property
    def _scales(self) -> tuple[float, float]:
        """The first kink off zero (else corner, else the reference length) by which the law does work.

        The energy is the triangle ½ a max |traction| over |x| ≤ a: for the quadratic-linear law γ2 δ.
        """
        candidates = [self.kinks, self._corners, np.array([self.reference_slip])]
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
        return magnitude(np.concatenate([g.left[inside], g.right[inside], self.left(ends), self.right(ends)]))


@dataclass(frozen=True)
class PolylineInUnits(DerivedLaw, PolylineLaw, register=False):
    """A polyline law in other units: its table in these.

    Attributes:
        law: the law.
        length: the unit of displacements.
        traction: the unit of tractions.
    """

    name = "scaled"
    law: PolylineLaw
    length: float
    traction: float

    @override
    def build(self) -> TractionGraph:
        return self.law.graph.scaled(self.length, self.traction)


def _limit(traction: npt.ArrayLike, slope: float) -> float:
    """Limit of a ray that starts at the given traction with the given slope."""
    return float(np.asarray(traction)) + 0.0 if slope == 0.0 else float(np.copysign(np.inf, slope))


class SampledLaw(PolylineLaw):
    """A law given by its traction at displacements x > 0 and the ends of its smooth pieces.

    The traction is interpolated linearly between `samples` + 1 points a piece, so it is off by at most
    max |traction''| (piece length / samples)² / 8; jumps, at ends only, are exact. What is solved and
    certified is this interpolated law. It is odd, or zero for x < 0 where `one_sided = True`, and constant
    after the last end.
    """

    samples: ClassVar[int] = 200
    one_sided: ClassVar[bool] = False

    @abstractmethod
    def traction(self, x: Array) -> Array:
        """Traction (m,) at displacements x (m,) > 0 inside the pieces."""

    @abstractmethod
    def ends(self) -> Sequence[float]:
        """Where pieces end, ascending, > 0: every jump, every break of slope, and the start of the tail."""

    @override
    def build(self) -> TractionGraph:
        return TractionGraph.from_points(_sampled(self.traction, self.ends(), self.samples), self.one_sided)

    def piece(self, x: Array) -> Integers:
        """Number (m,) of ends between 0 and x."""
        slip = np.maximum(x, 0.0) if self.one_sided else np.abs(x)
        return np.searchsorted(self.ends(), slip, side="right")

    @property
    @override
    def _corners(self) -> Array:
        # Not the samples: how finely the law is sampled is no scale of it.
        return np.asarray(self.ends(), dtype=np.float64)


def _sampled(traction: Callable[[Array], Array], ends: Sequence[float], samples: int) -> Array:
    """Points (displacement, traction) of the pieces between 0 and the ends, (k, 2); at a jump there are two."""
    stops = np.append(0.0, np.asarray(ends, dtype=float))
    if samples < 1 or stops.size < 2 or not np.all(np.isfinite(stops)) or np.any(np.diff(stops) <= 0.0):
        raise InputError(f"ends = {list(ends)!r}, samples = {samples}: give ascending finite ends > 0 and samples >= 1")
    x = np.linspace(stops[:-1], stops[1:], samples + 1, axis=1)
    inside = x.copy()  # at the ends of pieces the one-sided limits
    inside[:, 0], inside[:, -1] = np.nextafter(x[:, 0], x[:, -1]), np.nextafter(x[:, -1], x[:, 0])
    values = np.asarray(traction(inside.ravel()), dtype=np.float64)
    if values.shape != (x.size,) or not np.all(np.isfinite(values)):
        raise InputError(f"the traction function must return one finite value for each displacement, not {values!r}")
    values, kept = values.reshape(x.shape), np.ones(x.shape, dtype=bool)
    before = np.append(0.0, values[:-1, -1])
    joined = np.abs(values[:, 0] - before) <= DEFAULT.resolution * magnitude(values)
    values[0, 0] *= not joined[0]
    kept[1:, 0] = ~joined[1:]
    return np.column_stack([x[kept], values[kept]])
