"""Points of a problem with laws of lengths, stationary or not, minimisers or not: by the same problem in its frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..laws.traction_graph import Arc
from ..typing import Array
from . import stationarity
from .arcs import FREE, INF, Chain
from .length_frames import Frames, left_out
from .lengths import Lengths
from .scalar_problem import ScalarProblem
from .stationarity import Kind, kind


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
    return stationarity.imbalance(*_alike(problem, x))


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
