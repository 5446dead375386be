"""The laws provided: polylines by their `TractionGraph`, and laws that weaken smoothly from a peak.

Displacements in m, tractions in N/m² (or any consistent units); `name` is the scene file's `law = "name"`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from typing_extensions import override

from ..errors import InputError
from ..typing import Array
from .base import DEFAULT, ConvexPart, DifferentiablePart, Directional, Superpotential, Units
from .polyline import PolylineLaw, PolylinePart
from .registry import require_number, require_ordered, require_positive
from .traction_graph import TractionGraph


class _PositiveLaw(PolylineLaw):
    """A law all of whose parameters are > 0."""

    def __post_init__(self) -> None:
        require_positive(self._title, **vars(self))


@dataclass(frozen=True)
class _QuadraticLinearLaw(_PositiveLaw, register=False):
    """The parameters of the paper's law: γ1, γ2 and δ."""

    units: ClassVar[Units] = {"gamma1": "traction", "gamma2": "traction", "delta": "length"}
    gamma1: float
    gamma2: float
    delta: float


@dataclass(frozen=True)
class QuadraticLinear(_QuadraticLinearLaw):
    """j(x) = min{γ1/(2δ) x², γ2 |x|}: the traction rises to γ1 at δ, drops to γ2 = γ1/2 and stays there.

    Ovcharova and Gwinner, section 5.1, read as an even law. The two pieces cross at 2 δ γ2/γ1; only with
    γ1 = 2 γ2 is that δ, and InputError is raised otherwise.
    """

    name = "quadratic_linear"

    @override
    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.gamma1 - 2.0 * self.gamma2) > 1e-12 * self.gamma1:
            raise InputError(
                f"{self._title}: gamma1 = {self.gamma1!r} must be 2 gamma2 = {2 * self.gamma2!r}: then "
                f'the drop lies at delta. For any other drop state the graph: law = "graph", points = '
                f"[[0, 0], [{self.delta!r}, {self.gamma1!r}], [{self.delta!r}, {self.gamma2!r}]]"
            )

    @override
    def build(self) -> TractionGraph:
        return TractionGraph.from_points([(0.0, 0.0), (self.delta, self.gamma1), (self.delta, self.gamma2)])


@dataclass(frozen=True)
class QuadraticLinearLiteral(_QuadraticLinearLaw):
    """j(x) = min{γ1/(2δ) x², γ2 x}, the formula of Ovcharova and Gwinner read literally, on the whole line.

    For x < 0 the traction is +γ2 and pushes the body on; at 0 it drops to 0 (a concave kink), then rises to
    2 γ2 at 2 δ γ2/γ1 and drops to γ2. Here c4 = γ2, the constant of the paper's existence condition.
    """

    name = "quadratic_linear_literal"

    @override
    def build(self) -> TractionGraph:
        crossing, slope = 2.0 * self.delta * self.gamma2 / self.gamma1, self.gamma1 / self.delta
        return TractionGraph(
            np.array([0.0, crossing]),
            np.array([self.gamma2, 2.0 * self.gamma2]),
            np.array([0.0, self.gamma2]),
            np.array([0.0, slope, 0.0]),
        )


@dataclass(frozen=True)
class Tresca(_PositiveLaw):
    """j(x) = yield_traction |x|: no slip below the yield traction, slip at it. The kink at 0 is convex.

    The law has no length of its own; `reference_slip` (m) serves its energy scale and so the relative
    smoothing only.
    """

    name = "tresca"
    units: ClassVar[Units] = {"yield_traction": "traction"}
    yield_traction: float
    reference_slip: float = 1e-6

    @override
    def build(self) -> TractionGraph:
        return TractionGraph.from_points([(0.0, self.yield_traction)])


@dataclass(frozen=True)
class LinearSpring(_PositiveLaw):
    """j(x) = ½ stiffness x², stiffness in N/m³. There is no kink; `reference_slip` (m) gives the energy scale only."""

    name = "linear_spring"
    units: ClassVar[Units] = {"stiffness": "traction"}
    stiffness: float
    reference_slip: float = 1e-6

    @override
    def build(self) -> TractionGraph:
        zero = np.zeros(1)
        return TractionGraph(zero, zero, zero, np.full(2, float(self.stiffness)))


@dataclass(frozen=True)
class _Weakening(Superpotential, register=False):
    """A law that weakens from a peak to a residual traction over displacements of the size of delta."""

    units: ClassVar[Units] = {"peak_traction": "traction", "residual_traction": "traction", "delta": "length"}
    peak_traction: float
    residual_traction: float
    delta: float

    def __post_init__(self) -> None:
        require_positive(self._title, delta=self.delta)
        require_ordered(self._title, residual_traction=self.residual_traction, peak_traction=self.peak_traction)


@dataclass(frozen=True)
class Sawtooth(_Weakening, PolylineLaw):
    """A sawtooth with teeth of width delta: the traction rises to the k-th peak at k delta, then drops to the residual.

    The peaks descend evenly from peak_traction, the k-th of n = `drops` being
    residual + (peak - residual)(n + 1 - k)/n. With one drop it is the quadratic-linear law for any γ1 > γ2.
    The zigzag laws of Panagiotopoulos (delamination, Scanlon's diagram of concrete) have this form.
    """

    name = "sawtooth"
    drops: int

    @override
    def __post_init__(self) -> None:
        super().__post_init__()
        if self.residual_traction == self.peak_traction:
            raise InputError(
                f"{self._title}: residual_traction = peak_traction = {self.peak_traction!r} leaves no "
                f"drop; lower residual_traction"
            )
        most = DEFAULT.most_drops
        if isinstance(self.drops, bool) or not isinstance(self.drops, int) or not 1 <= self.drops <= most:
            raise InputError(f"{self._title}: drops = {self.drops!r} must be a whole number from 1 to {most}")

    @override
    def build(self) -> TractionGraph:
        points = [(0.0, 0.0)]
        for k in range(1, self.drops + 1):
            share = (self.drops + 1 - k) / self.drops
            height = self.residual_traction + (self.peak_traction - self.residual_traction) * share
            points += [(k * self.delta, height), (k * self.delta, self.residual_traction)]
        return TractionGraph.from_points(points)


@dataclass(frozen=True)
class Graph(PolylineLaw):
    """The graph of the traction: points (displacement, traction). Two points at one displacement are a jump.

    Displacements start at 0 and do not descend; after the last point the traction stays constant.
    The law is odd in the traction (even in the energy), or zero for negative displacements if one_sided. A
    nonzero traction at displacement 0 is a kink there (Tresca friction for the odd law).
    """

    name = "graph"
    units: ClassVar[Units] = {"points[][0]": "length", "points[][1]": "traction"}
    points: tuple[tuple[float, float], ...]
    one_sided: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", _checked_points(self._title, self.points))
        if not isinstance(self.one_sided, bool):
            raise InputError(f"{self._title}: one_sided = {self.one_sided!r} is not usable; give True or False")
        if not any(traction for _, traction in self.points):
            raise InputError(f"{self._title}: the traction of every point is 0; leave the law away")

    @override
    def build(self) -> TractionGraph:
        return TractionGraph.from_points(self.points, self.one_sided)


def _checked_points(owner: str, points: Sequence[Sequence[float]]) -> tuple[tuple[float, float], ...]:
    """The points as pairs of floats; InputError where they are not the graph of a law."""
    try:
        pairs = tuple((x, t) for x, t in points)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: points = {points!r} is not a list of pairs [displacement, traction]") from None
    for x, t in pairs:
        require_number(owner, displacement=x, traction=t)
    table = np.array(pairs, dtype=float).reshape(-1, 2)
    places, tractions = table.T
    if not pairs or places[0] != 0.0:
        raise InputError(f"{owner}: the first point must have the displacement 0, for example [0, 0]")
    steps, rises = np.diff(places), np.diff(tractions)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        steep = (steps > 0.0) & ~np.isfinite(rises / steps)
    jumps = steps == 0.0
    for wrong, why in (
        (steps < 0.0, "the displacement falls; order the points"),
        (steep, "the segment is too steep for a float; make it vertical, which is a jump"),
        (jumps & np.append(jumps[1:], False), "three points at one displacement; leave out the one in between"),
        (jumps & (places[:-1] == 0.0) & (tractions[:-1] != 0.0), "a jump at the displacement 0 starts at [0, 0]"),
    ):
        if np.any(wrong):
            i = int(np.argmax(wrong))
            raise InputError(f"{owner}: from {list(pairs[i])} to {list(pairs[i + 1])}: {why}")
    return tuple((float(x), float(t)) for x, t in pairs)


@dataclass(frozen=True)
class WeakeningLaw(_Weakening):
    """Traction sign(x) [peak - (peak - residual) w(|x|/delta)], weakening from ±peak to ±residual.

    A subclass gives a name and the shape w: w(0) = 0, rising monotonically to w(∞) = 1, with its integral W
    and derivative w'. Split: H = peak |x| and G = (peak - residual) delta W(|x|/delta), which is smooth.
    Tractions in N/m², delta in m; InputError unless 0 ≤ residual ≤ peak, peak > 0 and delta > 0.
    """

    @abstractmethod
    def shape(self, z: Array) -> tuple[Array, Array, Array]:
        """W(z) = ∫₀ᶻ w, w(z) and w'(z) at slips z = |x|/delta ≥ 0, shape (m,), dimensionless."""

    @override
    @cached_property
    def convex(self) -> ConvexPart:
        return PolylinePart(TractionGraph.from_points([(0.0, self.peak_traction)]))

    @override
    @cached_property
    def concave(self) -> ConvexPart:
        return _Weakened(self)

    @override
    def value(self, x: Array) -> Array:
        return self.convex.value(x) - self.concave.value(x)

    @override
    @cached_property
    def growth(self) -> Directional:
        return Directional(self.residual_traction, self.residual_traction)

    @cached_property
    def _extremes(self) -> tuple[Directional, float]:
        """The traction's size falls with the slip's: it is largest at the onset, and never acts along the slip."""
        return Directional(self.peak_traction, self.peak_traction), 0.0

    @override
    @property
    def energy_scale(self) -> float:
        return self.peak_traction * self.delta

    @override
    @property
    def length_scale(self) -> float:
        return self.delta

    @override
    @property
    def even(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class _Weakened(DifferentiablePart):
    """G of a weakening law."""

    law: WeakeningLaw

    @override
    def value(self, x: Array) -> Array:
        return (self._drop * self.law.delta) * self._shape(x)[0]

    @override
    def right(self, x: Array) -> Array:
        return self._drop * np.sign(x) * self._shape(x)[1]

    @override
    def second(self, x: Array) -> Array:
        return (self._drop / self.law.delta) * self._shape(x)[2]

    @property
    def _drop(self) -> float:
        return self.law.peak_traction - self.law.residual_traction

    def _shape(self, x: Array) -> tuple[Array, Array, Array]:
        with np.errstate(over="ignore"):
            return self.law.shape(np.abs(x) / self.law.delta)


@dataclass(frozen=True)
class Exponential(WeakeningLaw):
    """Exponential slip weakening: traction sign(x) [residual + (peak - residual) exp(-|x|/delta)]."""

    name = "exponential"

    @override
    def shape(self, z: Array) -> tuple[Array, Array, Array]:
        decay = np.exp(-z)
        return z + np.expm1(-z), -np.expm1(-z), decay

    @override
    @property
    def steepest_fall(self) -> float:
        return (self.peak_traction - self.residual_traction) / self.delta
