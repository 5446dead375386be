"""Whether a point is stationary, and whether it is a minimiser: arrays only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ..laws.traction_graph import Arc
from ..typing import Array, Integers, Mask
from .arcs import FREE, INF, Chain
from .lengths import Frames, Lengths, left_out
from .scalar_problem import ScalarProblem


class Kind(StrEnum):
    """What a stationary point is."""

    MINIMISER = "minimiser"
    SADDLE = "saddle"
    UNDECIDED = "undecided"


@dataclass(frozen=True, kw_only=True)
class Subdifferential:
    """What the laws and bounds allow at a point, and what they do.

    Attributes:
        low: least force, -inf at a lower bound, (n,).
        high: largest force, (n,).
        falls: whether the traction drops there, (n,).
        least: slope of the traction, the smaller one at a joint, (n,).
        most: the larger one, (n,).
    """

    low: Array
    high: Array
    falls: Mask
    least: Array
    most: Array


def subdifferential(problem: ScalarProblem, x: Array) -> Subdifferential:
    """∂φ and bounds at a point.

    Args:
        problem: the problem.
        x: the point, (n,).
    """
    arcs, accuracy = problem.arcs, problem.thresholds.points.accuracy
    near = accuracy * (1.0 + np.max(np.abs(x), initial=0.0))
    here = (arcs.low <= x[:, None] + near) & (arcs.high >= x[:, None] - near)
    at = np.clip(x[:, None], np.where(here, arcs.low, -np.inf), np.where(here, arcs.high, np.inf))
    t = arcs.tractions + arcs.slopes * (at - arcs.anchors)
    low, high = np.where(here, t, np.inf).min(axis=1), np.where(here, t, -np.inf).max(axis=1)
    drop = (
        here[:, :-1] & here[:, 1:] & (t[:, :-1] - t[:, 1:] > accuracy * np.max(np.abs(problem.force), initial=1e-300))
    )
    return with_bounds(
        problem,
        x,
        Subdifferential(
            low=low,
            high=high,
            falls=np.asarray(drop.any(axis=1)),
            least=np.where(here, arcs.slopes, np.inf).min(axis=1),
            most=np.where(here, arcs.slopes, -np.inf).max(axis=1),
        ),
    )


def with_bounds(problem: ScalarProblem, x: Array, laws: Subdifferential) -> Subdifferential:
    """What laws and bounds allow at a point; a drop that a bound keeps the unknown on is none.

    Args:
        problem: the stiffness, the force and the bounds.
        x: the point, (n,).
        laws: what the laws allow there.
    """
    near = problem.thresholds.points.accuracy * (1.0 + np.max(np.abs(x), initial=0.0))
    force = problem.force - problem.stiffness @ x
    below, above = x <= problem.lower + near, x >= problem.upper - near
    kept = (below & above) | (below & (force <= laws.low)) | (above & (force >= laws.high))
    low, high = np.where(below, -np.inf, laws.low), np.where(above, np.inf, laws.high)
    return replace(laws, low=low, high=high, falls=laws.falls & ~kept)


def imbalance_of_components(problem: ScalarProblem, x: Array) -> float:
    """The largest force that neither law nor bound can bear, relative to the largest force.

    Args:
        problem: the problem.
        x: the point, (n,).
    """
    force, allowed = problem.force - problem.stiffness @ x, subdifferential(problem, x)
    off = np.maximum(np.maximum(allowed.low - force, force - allowed.high), 0.0)
    return float(off.max(initial=0.0) / np.max(np.abs(problem.force), initial=1e-300))


def kind(problem: ScalarProblem, x: Array) -> Kind:
    """Whether a stationary point is a minimiser.

    On a drop it is none. Else displacements decide that keep those unknowns at their kinks and bounds which bear a
    force strictly inside what these can.

    Args:
        problem: the problem.
        x: a stationary point, (n,).
    """
    return kind_at(problem, x, subdifferential(problem, x))


def kind_at(problem: ScalarProblem, x: Array, here: Subdifferential) -> Kind:
    """As :func:`kind`, with laws of any form.

    Args:
        problem: the stiffness and the force.
        x: a stationary point, (n,).
        here: what the laws and bounds allow there.
    """
    if here.falls.any():
        return Kind.SADDLE
    surely, perhaps = _free(problem, x, here)
    if _definite(problem, perhaps, here.least[perhaps]) > 0:
        return Kind.MINIMISER
    return Kind.SADDLE if _definite(problem, surely, here.most[surely]) < 0 else Kind.UNDECIDED


def _free(problem: ScalarProblem, x: Array, here: Subdifferential) -> tuple[Integers, Integers]:
    """Unknowns that can move to first order for certain, and those that perhaps can."""
    force = problem.force - problem.stiffness @ x
    near = problem.thresholds.points.accuracy * max(float(np.max(np.abs(force), initial=0.0)), 1e-300)
    jumps = here.high - here.low > near
    inside = jumps & (force > here.low + near) & (force < here.high - near)
    return np.flatnonzero(~jumps), np.flatnonzero(~inside)


def _definite(problem: ScalarProblem, free: Integers, slopes: Array) -> int:
    """1: positive definite on these unknowns, 0: singular, -1: not semidefinite."""
    if not free.size:
        return 1
    values = np.linalg.eigvalsh(problem.stiffness[np.ix_(free, free)] + np.diag(slopes))
    limit = _zero(problem, float(values[-1]))
    return int(values[0] > limit) - int(values[0] < -limit)


def _zero(problem: ScalarProblem, largest: float) -> float:
    """Eigenvalues of at most this size are zero beside the largest."""
    return problem.thresholds.points.zero * max(abs(largest), float(np.trace(problem.stiffness)) / problem.size)


def kind_of(problem: ScalarProblem, x: Array) -> Kind:
    """Whether a stationary point is a minimiser.

    Args:
        problem: the problem.
        x: a stationary point, (n,).
    """
    return kind(*_alike(problem, x))


def imbalance(problem: ScalarProblem, x: Array) -> float:
    """The largest force that neither law nor bound can bear, relative to the largest force.

    Args:
        problem: the problem.
        x: the point, (n,).
    """
    return imbalance_of_components(*_alike(problem, x))


def _alike(problem: ScalarProblem, x: Array) -> tuple[ScalarProblem, Array]:
    """A problem with laws of one component each that is the same at a point, and the point; small vectors are zero."""
    if not len(problem.lengths):
        return problem, x
    near = problem.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
    lengths = problem.lengths
    vectors = lengths.vectors(x)
    rounded = x.copy()
    rounded[lengths.members] = np.where(np.abs(vectors) <= near, 0.0, x[lengths.unknowns])[lengths.there]
    return in_frames(problem, rounded)


def in_frames(problem: ScalarProblem, x: Array) -> tuple[ScalarProblem, Array]:
    """A problem that is the same to second order at a point, with laws of one component each, and the point.

    Args:
        problem: the problem.
        x: a point, (n,).
    """
    lengths, n = problem.lengths, problem.size
    along = lengths.along(problem.force - problem.stiffness @ x)
    out = left_out(lengths, x, along, (problem.lower, problem.upper))
    z, g = np.where(out, 0.0, lengths.vectors(x)), np.where(out, 0.0, along)
    size = np.linalg.norm(z, axis=1)
    frames = Frames.along(lengths, np.where((size > 0.0)[:, None], z, g))
    after, before = (t[n:] for t in problem.arcs.rates(np.concatenate([np.zeros(n), size])))
    pull = np.divide((z * g).sum(axis=1), size, out=np.zeros_like(size), where=size > 0.0)
    traction = np.clip(pull, np.minimum(after, before), np.maximum(after, before))
    chains = list(problem.chains[:n])
    for v, k in zip(*np.nonzero(lengths.there), strict=True):
        behind = bool(out[v, k] and lengths.opens[v] and k == 0)
        at = float(size[v])
        across = float(traction[v]) / at if at > 0.0 else _slope_at_zero(problem.chains[n + v])
        start = 0.0 if at > 0.0 else float(after[v])
        ahead = at > 0.0 and k == frames.axis[v]
        chains[lengths.unknowns[v, k]] = problem.chains[n + v] if ahead else _across(across, start, one_sided=behind)
    lower, upper = _bounds(problem, frames)
    framed = replace(
        problem,
        stiffness=frames.matrix(problem.stiffness),
        force=frames.forces(problem.force),
        lower=lower,
        upper=upper,
        chains=tuple(chains),
        lengths=Lengths.none(),
    )
    return framed, frames.into(x)


def _slope_at_zero(law: Chain) -> float:
    return next(a.slope for a in law if a.high > 0.0)


def _across(slope: float, start: float, *, one_sided: bool) -> Chain:
    """A law with a jump at zero and a slope on both sides of it, or on the positive side only."""
    positive = Arc(0.0, INF, 0.0, 0.0, start, slope)
    if one_sided:
        return (FREE[0]._replace(high=0.0), positive)
    return (Arc(-INF, 0.0, 0.0, 0.0, -start, slope), positive)


def _bounds(problem: ScalarProblem, frames: Frames) -> tuple[Array, Array]:
    """The bounds in the frames; none of components that are not along an axis."""
    lengths = problem.lengths
    factors = np.where(lengths.there, lengths.factors, 1.0)
    ends = np.sort([factors * b[lengths.unknowns] for b in (problem.lower, problem.upper)], axis=0)
    kept = np.diagonal(frames.turns, axis1=1, axis2=2) == 1.0
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[lengths.members] = np.where(kept, ends[0], -np.inf)[lengths.there]
    upper[lengths.members] = np.where(kept, ends[1], np.inf)[lengths.there]
    return lower, upper


@dataclass(frozen=True, kw_only=True)
class StationaryPoint:
    """A point that satisfies the inequality.

    Attributes:
        x: (n,).
        energy: there.
        kind: minimiser, saddle or undecided.
        isolated: False where it is one of a continuum.
    """

    x: Array
    energy: float
    kind: Kind
    isolated: bool


class PointList:
    """Different points.

    Args:
        size: number n of unknowns.
        same: points nearer than this share of the displacements are one.

    Attributes:
        listed: the points, as they were added.
    """

    def __init__(self, size: int, same: float) -> None:
        self._same = same
        self.listed: list[StationaryPoint] = []
        self._places: Array = np.empty((0, size))

    def __len__(self) -> int:
        return len(self.listed)

    def __iter__(self) -> Iterator[StationaryPoint]:
        return iter(self.listed)

    def distances(self, x: Array) -> Array:
        """The largest differences from each point, in their order.

        Args:
            x: a point, (n,).
        """
        return np.asarray(np.abs(self._places[: len(self)] - x).max(axis=1, initial=0.0))

    def has(self, x: Array) -> bool:
        """Whether a point is in the list.

        Args:
            x: the point, (n,).
        """
        return bool(np.any(self.distances(x) < self._same * (1.0 + float(np.max(np.abs(x), initial=0.0)))))

    def add(self, point: StationaryPoint) -> None:
        """Put a point at the end.

        Args:
            point: a new one.
        """
        count = len(self)
        if count == len(self._places):
            self._places = np.concatenate([self._places, np.empty((count + 1, len(point.x)))])
        self._places[count] = point.x
        self.listed.append(point)
