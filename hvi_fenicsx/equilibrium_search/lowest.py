"""The lowest energy with a proof: branch and bound over intervals of the unknowns and lengths with laws.

Of the open boxes the one with the lowest bound is divided, until no open box can hold a point below the lowest
energy found by more than the gap that is allowed. A box is made smaller by what strong convexity of its relaxation
leaves of it below the lowest energy found.

The first box holds all points whose energy is at most a known one. Strong convexity of the relaxation bounds
displacements other than rigid motions. How far a rigid motion c can go is bounded by the dual: c·x is at most
(E - min over x of (relaxation - τ c·x))/τ for each force τ > 0 at which that minimum exists.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import count

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .convex_programme import minimise, never
from .length_programme import LengthProgramme
from .relaxation import Minimum, Relaxation
from .scalar_problem import Box, ScalarProblem, clipped
from .thresholds import LIMITS

OpenBox = tuple[Array, Array, float]
"""Low and high of a box, and a bound of the laws' own energy in it."""


@dataclass(kw_only=True)
class LowestSearch:
    """A search for the lowest energy.

    Attributes:
        problem: the problem.
        gap: relative gap that is allowed.
        cut: whether what is begun is to be cut short, since the search stops.
        x: the lowest point found.
        upper: its energy.
        boxes: bounded so far.
        waiting: a heap of open boxes by their bounds, with what their relaxations found.
        region: the ends of a box with all points that are lower than the lowest found, also of the laws themselves.
    """

    problem: ScalarProblem
    gap: float = 1e-8
    cut: Callable[[], bool] = never
    x: Array = field(init=False)
    upper: float = math.inf
    boxes: int = 0
    waiting: list[tuple[float, int, Box, Minimum]] = field(default_factory=list)
    region: tuple[Array, Array] = field(init=False)
    _numbers: Iterator[int] = field(default_factory=count)

    def __post_init__(self) -> None:
        self._relaxation = Relaxation(self.problem, self.cut)

    def start(self, points: Iterable[Array] = (), region: tuple[Array, Array] | None = None) -> None:
        """Bound the whole problem, or a box of it.

        Args:
            points: known points of low energy, each (n,).
            region: the ends of a box that is known to hold all lower points, (n + m,) each; None: none is known.

        Raises:
            SolverError: the energy is not bounded from below, or this cannot be shown.
            Cut: the search stops before this is known.
        """
        problem = self.problem
        self.region = low, high = problem.with_lengths(*problem.ends) if region is None else region
        self.x = clipped(np.zeros(problem.size), low, high)
        for x in (self.x, *points):
            self._try(x)
        first = self._relaxation.solve(Box.around(low, high, self.x))
        if self.cut():
            raise Cut
        if region is None and problem.is_far(first.x):
            raise SolverError("no lowest energy: it falls without limit, or only a limit far away was found")
        self._try(first.x)
        level = self.upper + 2.0 * problem.error + LIMITS.accuracy**0.5 * problem.energy_size(first.x)
        self.region = self._level_box(first, level)
        self._enter(replace(Box.around(*self.region, first.x), bound=first.bound))

    def _level_box(self, found: Minimum, energy: float) -> tuple[Array, Array]:
        """The ends of a box, (n + m,) each, with all points of the region of at most an energy.

        Args:
            found: the minimum of the relaxation in the region.
            energy: the energy.
        """
        problem, n, (begin, end) = self.problem, self.problem.size, self.region
        root = np.sqrt(2.0 * max(energy - found.bound, 0.0))
        reach = root * found.curvature.radii[:n]
        free = ~np.isfinite(reach)
        if free.any():
            motions = _separated(problem, self._relaxation.kernel)
            ways = np.array([max(self._way(found, energy, c), self._way(found, energy, -c)) for c in motions.T])
            reach[free] = root * found.curvature.range_radii[:n][free] + np.abs(motions[free]) @ ways
        return problem.with_lengths(np.maximum(found.x - reach, begin[:n]), np.minimum(found.x + reach, end[:n]))

    def _way(self, found: Minimum, energy: float, c: Array) -> float:
        """How much larger c·x can be than at the minimiser, by forces each a quarter of the one before."""
        problem, best, tau = self.problem, np.inf, float(np.max(np.abs(self.problem.force), initial=1e-300))
        for _ in range(LIMITS.most_steps):
            pulled = Relaxation(problem.under(problem.force + tau * c), self.cut)
            least = pulled.solve(Box.around(*self.region, found.x))
            if self.cut():
                raise Cut
            if not problem.is_far(least.x):
                bound = (energy - least.bound) / tau
                if bound >= best:
                    break
                best = bound
            tau *= 0.25
        if not np.isfinite(best):
            raise SolverError("no lowest energy: a body can move away without end for all that can be shown")
        return float(best - c @ found.x)

    def resume(self, boxes: Iterable[OpenBox], point: Array) -> None:
        """Go on from open boxes and the lowest point.

        Args:
            boxes: from :meth:`open_boxes`.
            point: the lowest point found, (n,).
        """
        self.x, self.upper = point, self.problem.energy(point)
        listed = list(boxes)
        self.region = np.min([b[0] for b in listed], axis=0), np.max([b[1] for b in listed], axis=0)
        for low, high, bound in listed:
            self._enter(replace(Box.around(low, high, point), bound=bound - self.problem.error))

    def open_boxes(self) -> Iterator[OpenBox]:
        """The boxes that wait."""
        for bound, _, box, _ in self.waiting:
            yield box.low, box.high, bound - self.problem.error

    @property
    def lower(self) -> float:
        """No point has a lower energy."""
        return min(self.waiting[0][0], self.upper) if self.waiting else self.upper - self._allowed

    @property
    def open_gap(self) -> float:
        """What is open between the lowest energy found and the bound, relative to the energy."""
        return max(self.upper - self.lower, 0.0) / self._size

    @property
    def proven(self) -> bool:
        """Whether no point is lower than the lowest found, but for the gap allowed."""
        return not self.waiting or self.waiting[0][0] >= self.upper - self._allowed

    @property
    def _size(self) -> float:
        return max(abs(self.upper), 1e-6 * self._parts, 1e-300)

    @property
    def _allowed(self) -> float:
        """The gap as an energy; a little less, so that rounding lifts no told gap above it."""
        return max(LIMITS.nearly * self.gap * self._size, LIMITS.rounding * self._parts)

    @property
    def _parts(self) -> float:
        """The sizes of the parts of the energy, at the lowest point or, where it is at rest, in the region."""
        reach = np.max(np.abs(self.region), axis=0)[: self.problem.size]
        return self.problem.energy_size(self.x) or float(np.abs(self.problem.force) @ reach)

    def run(self, stop: Callable[[], bool], report: Callable[[LowestSearch], None]) -> bool:
        """Divide boxes until the proof is there; whether it is.

        Args:
            stop: asked before each division.
            report: told after each division.
        """
        while not self.proven:
            if stop():
                return False
            _, _, box, found = heapq.heappop(self.waiting)
            left, right = box.high.copy(), box.low.copy()
            left[found.argument] = right[found.argument] = found.place
            self._enter(replace(box, high=left))
            self._enter(replace(box, low=right))
            report(self)
        return True

    def _enter(self, box: Box) -> None:
        """Tighten and bound a box; it waits if it is still open."""
        self.boxes += 1
        found = None
        for _ in range(LIMITS.most_rounds):
            before = box.bound
            found = self._relaxation.solve(box)
            weights = 0.5 * (box.weights + found.spread) if box.weights.any() else found.spread
            box = replace(box, x=found.x, bound=max(before, found.bound), weights=weights)
            if box.bound >= self.upper - self._allowed or np.any((box := self._smaller(box, found)).low > box.high):
                return
            if not found.gap or box.bound - before < LIMITS.worthwhile * (self.upper - box.bound):
                break
            if self.cut():
                break
        assert found is not None
        self._try(found.x)
        if not found.gap:  # the minimum is the energy of a point, but for what the programme is off
            i = int(np.argmax(box.high - box.low))
            found = replace(found, argument=i, place=0.5 * float(box.low[i] + box.high[i]))
        heapq.heappush(self.waiting, (box.bound, next(self._numbers), box, found))

    def _smaller(self, box: Box, found: Minimum) -> Box:
        """What strong convexity leaves of a box below the lowest energy found."""
        reach = found.curvature.radii * math.sqrt(2.0 * max(self.upper - found.bound, 0.0)) * (1.0 + LIMITS.accuracy)
        at, n, wide = self.problem.arguments(found.x), self.problem.size, LIMITS.rounding
        low, high = np.maximum(box.low, at - reach), np.minimum(box.high, at + reach)
        least, most = self.problem.lengths.within(low[:n], high[:n])
        low[n:], high[n:] = np.maximum(low[n:], least * (1.0 - wide)), np.minimum(high[n:], most * (1.0 + wide))
        return replace(box, low=low, high=high)

    def _try(self, x: Array) -> None:
        """Descend from a point."""
        low, high = self.region
        goal = self.upper - self._allowed
        found, energy = descend(self.problem, low, high, clipped(x, low, high), goal, self.cut)
        if energy < self.upper:
            self.x, self.upper = found, energy


class Cut(Exception):
    """The search stops before there is a first box."""


def _separated(problem: ScalarProblem, motions: Array) -> Array:
    """The same motions, those that bounds cannot hold apart from others, as these may have no limit."""
    bounded = np.isfinite(problem.lower) | np.isfinite(problem.upper)
    return motions @ np.linalg.svd(motions[bounded])[2].T if bounded.any() else motions


def descend(
    problem: ScalarProblem,
    low: Array,
    high: Array,
    x: Array,
    goal: float = math.inf,
    cut: Callable[[], bool] = never,
) -> tuple[Array, float]:
    """A point of a box at which no convex step lowers the energy, and its energy.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        x: where to begin, (n,).
        goal: a descent that comes down too slowly to reach this energy is given up.
        cut: whether to end where it is, since the search stops.
    """
    energy = problem.energy(x)
    for _ in range(LIMITS.most_steps):
        if cut():
            break
        found = _minimiser(problem, low, high, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > LIMITS.rounding * size:
            break
        x, energy = found, after
        if energy - goal > LIMITS.most_steps * fall:
            break
    return x, energy


def _minimiser(problem: ScalarProblem, low: Array, high: Array, x: Array, cut: Callable[[], bool]) -> Array:
    """The minimiser of a majorant: with φ = h - g and both convex, g is replaced by its tangent at x."""
    lengths, n, at = problem.lengths, problem.size, problem.arguments(x)
    rising = problem.arcs.convex_part
    pull = rising.rates(at) - problem.arcs.rates(at)
    force = problem.force + pull[:n]
    begin = np.concatenate([np.minimum(low, at)[:n], np.zeros(len(lengths))])
    chains = rising.on(begin, np.maximum(high, at))
    if not len(lengths):
        return minimise(problem.stiffness, force, chains, x, cut=cut).x
    size, felt = at[n:], lengths.felt(lengths.vectors(x)) * lengths.factors
    along = np.divide(pull[n:], size, out=np.zeros_like(size), where=size > 0.0)[:, None] * felt
    force[lengths.members] += along[lengths.there]
    ends = [np.concatenate([end[:n], radial]) for end, radial in ((low, np.zeros_like(size)), (high, chains.last[n:]))]
    programme = LengthProgramme(
        problem=problem,
        a=problem.stiffness,
        b=force,
        laws=chains,
        shut=np.zeros_like(size),
        low=ends[0],
        high=ends[1],
        cut=cut,
    )
    return programme.minimiser(x)
