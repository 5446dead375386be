"""The convex programmes of one scene, run one after the other on the rank that holds the reduced data."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar, cast

import numpy as np
from mpi4py import MPI

from ..errors import InputError, SolverError
from ..runtime.mpi import on_root
from ..typing import Array, magnitude
from .branch_and_bound import GlobalProgramme
from .cutting_planes import Functional, Minimum, Polytope, ball, cross
from .motions import DEFAULT, Mode, mode_of, modes, natural_basis, null_space, triangle
from .reduction import ReducedProblem, RigidProblem, reduce
from .solvability import ExistenceState, LoadFactors, PaperConditions, Solvability, held_up_to, undecided


@dataclass(frozen=True)
class Analysis:
    """Growth, peak and load of a scene on its rigid motions. Serial; not cached across scenes.

    Attributes:
        problem: the body and what it meets.
        reduced: the same on the kernel's basis.
    """

    problem: RigidProblem
    reduced: ReducedProblem

    @cached_property
    def growth(self) -> Functional:
        """∫ j^∞(y)."""
        return self.reduced.functional(tuple(part.growth for part in self.problem.resistances))

    @cached_property
    def peak(self) -> Functional:
        """∫ ĵ(y)."""
        return self.reduced.functional(tuple(part.peak for part in self.problem.resistances))

    @cached_property
    def work(self) -> Array:
        """Work of the whole load on the kernel's basis, (k,)."""
        return sum(self.reduced.loads.values(), np.zeros(self.reduced.frame.shape[1]))

    @cached_property
    def tie(self) -> float:
        """Works of less than this are zero: relative to the loads, without any to the laws."""
        return DEFAULT.rounding * (self.reduced.load_scale or self._law_scale or 1.0)

    @cached_property
    def programme(self) -> GlobalProgramme:
        """The shared cuts."""
        scale = self.reduced.load_scale + self._law_scale or 1.0
        return GlobalProgramme(self.reduced.frame, self.reduced.slips, scale)

    @cached_property
    def loose(self) -> Array:
        """Orthonormal basis (k, q) of the motions that nothing holds."""
        rows = np.vstack([self.reduced.contact, *self._resisted()])
        return null_space(triangle(rows))

    @cached_property
    def free(self) -> Array:
        """Orthonormal basis (k, q) of the motions that nothing holds and on which the load does no work."""
        loose = self.loose
        work = self.work @ loose
        return loose if magnitude(work) <= self.tie else loose @ null_space(work[None])

    @property
    def gives_way(self) -> bool:
        """Whether the load does more work along some motion than the growth resists."""
        rest = self.growth.minus(self.work)
        found = self.programme.minimise(rest, ball(self.reduced.frame), -self.tie)
        return found is not None and found.value < -self.tie

    def solvability(self) -> Solvability:
        """The whole verdict."""
        still = np.zeros_like(self.work)
        held, critical = self._factor(self.growth, self.work, still)
        peak, last = self._factor(self.peak, self.work, still)
        start = -self._factor(self.growth, -self.work, still)[0] if self._pushes else -np.inf
        margin = self._margin(self.growth)
        state = self._state(margin)
        return Solvability(
            state=state,
            margin=None if margin is None else self._flat(margin.value),
            lambda_held=held_up_to(start, held),
            held_from=start,
            lambda_peak=peak,
            direction=self._direction(
                state, margin, critical if self._limits(held) else None, last if self._limits(peak) else None
            ),
            critical=critical,
            kernel=modes(self.reduced.frame, self.problem.body),
            loose=self._named(self.loose),
            free=self._named(self.free),
            paper=self._paper(),
        )

    def _named(self, basis: Array) -> tuple[Mode, ...]:
        """The motions of a basis on the kernel's, as simple as they go."""
        natural = natural_basis(self.reduced.frame @ basis, self.problem.body.shifts)
        return modes(natural, self.problem.body)

    @property
    def _pushes(self) -> bool:
        """Whether a law drives the body: then a load may be too small to hold it."""
        return any(min(part.growth.minus, part.growth.plus) < 0.0 for part in self.problem.resistances)

    def _limits(self, factor: float) -> bool:
        """Whether a load factor between none and all of the load."""
        return DEFAULT.rounding < factor < 1.0

    def load_factors(self, loads: Collection[str]) -> LoadFactors:
        """The factors of some loads together, the others constant."""
        moved = np.asarray(sum((self.reduced.loads[name] for name in loads), np.zeros_like(self.work)))
        rest = self.work - moved
        held, mode = self._factor(self.growth, moved, rest)
        peak, peak_mode = self._factor(self.peak, moved, rest)
        start, first = (self._factor(f, -moved, rest)[0] for f in (self.growth, self.peak))
        return LoadFactors(-start, held, peak, mode, peak_mode, peak_from=-first)

    def _factor(self, f: Functional, moved: Array, rest: Array) -> tuple[float, Mode | None]:
        """The largest λ with <rest + λ moved, y> <= f(y) on the cone, and the motion that limits it."""
        f = f.minus(rest)
        factor, y = self.programme.ratio(f, moved, self.tie)
        if y is None:
            return np.inf, None
        return factor, self._mode(f.minus(moved, factor) if np.isfinite(factor) else f, y)

    def _state(self, margin: Minimum | None) -> ExistenceState:
        """The state, from the margin of the growth and, if that is negative, of the peak."""
        if margin is None or margin.value > self.tie:
            return "held"
        if margin.value >= -self.tie:
            return "borderline"
        peak = self._margin(self.peak)
        if peak is not None and peak.value < -self.tie:
            return "escapes"
        if self.free.shape[1]:
            peak = self._sphere(self.peak, self.free)  # a motion that is free both ways decides nothing
        return "metastable" if peak is None or peak.value > self.tie else "borderline"

    def _direction(
        self, state: ExistenceState, margin: Minimum | None, held: Mode | None, peak: Mode | None
    ) -> Mode | None:
        """The direction of escape: the motion that limits the load first, where load factors give one."""
        if state == "held" or margin is None:
            return None
        if state == "escapes":
            return peak or self._steepest(self.peak)
        if margin.value < -self.tie:
            return held or self._steepest(self.growth)
        return self._tied(margin) if state == "borderline" else None

    def _margin(self, f: Functional) -> Minimum | None:
        """Minimum of f - <g,·> over |y| = 1: if negative that over the ball, else one for each face."""
        inner = self._lowest(f, ball(self.reduced.frame))
        return inner if inner.value < -self.tie else self._sphere(f, self.free[:, :0], self.tie)

    def _lowest(self, f: Functional, region: Polytope) -> Minimum:
        """Minimum over a region that contains the origin."""
        return self.programme.minimise(f.minus(self.work), region) or Minimum(0.0, np.zeros_like(self.work), 0.0)

    def _sphere(self, f: Functional, across: Array, aim: float = -np.inf) -> Minimum | None:
        """Minimum over |y| = 1 and y orthogonal to `across` (k, q); None if the cone holds no such y."""
        return self.programme.sphere(f.minus(self.work), across.T, aim)

    def _steepest(self, f: Functional) -> Mode:
        """A direction of escape easy to name: on |y|_1 <= 1 the minimum is mostly at a pure motion."""
        return self._mode(f.minus(self.work), self._lowest(f, cross(self.reduced.frame)).y)

    def _tied(self, margin: Minimum) -> Mode:
        """The motion along which load and growth are equal; a free one only if there is no other."""
        y, strict = margin.y, self._sphere(self.growth, self.free)
        if self.free.shape[1] and (strict is None or strict.value > self.tie):
            y = self.free[:, 0]
        elif strict is not None:
            y = strict.y
        return self._mode(self.growth.minus(self.work), y)

    def _mode(self, f: Functional, y: Array) -> Mode:
        """The motion y in words, in its simplest form among those with the same value of f."""
        return mode_of(self._simplest(f, y), self.problem.body, signed=True)

    def _simplest(self, f: Functional, y: Array) -> Array:
        """Unit rigid coefficients (3|6,) of y, small ones dropped if f stays as low and y in the cone."""
        z = self.reduced.frame @ y
        z, limit = z / np.abs(z).max(), self.programme.evaluate(f, y) / np.abs(z).max() + self.tie
        for snap in np.geomspace(0.1, DEFAULT.rounding, 9):
            short = np.where(np.abs(z) <= snap, 0.0, z)
            trial = np.linalg.lstsq(self.reduced.frame, short, rcond=None)[0]
            off = max(np.abs(self.reduced.frame @ trial - short).max(), (f.cone @ trial).max(initial=0.0))
            if off <= DEFAULT.rounding and self.programme.evaluate(f, trial) <= limit:
                return short
        return z

    def _paper(self) -> PaperConditions:
        """The paper's conditions look at the load and the contact alone; the laws enter by c."""
        margin = self._margin(Functional(0.0 * self.work, 0.0 * self.growth.factors, self.reduced.contact))
        return PaperConditions(self.paper_c, None if margin is None else self._flat(margin.value), self.tie)

    @property
    def paper_c(self) -> float:
        """(Σ c4² area)^½ γ0; γ0 is bounded by the sizes of a motion's coefficients, whatever their signs."""
        c4 = np.array([part.c4 for part in self.problem.resistances])
        back = np.linalg.pinv(self.reduced.frame)
        return float(np.sqrt(c4**2 @ self.reduced.areas * np.abs(back.T @ self.reduced.trace @ back).sum()))

    def _flat(self, margin: float) -> float:
        return 0.0 if abs(margin) <= self.tie else margin

    @cached_property
    def _law_scale(self) -> float:
        """The largest resistance to a unit motion, roughly."""
        linear = max(magnitude(f.linear) for f in (self.growth, self.peak))
        return linear + max(float(np.abs(f.factors) @ self.reduced.areas) for f in (self.growth, self.peak))

    def _resisted(self) -> list[Array]:
        """Unit rows (m, k) of the slips that a law resists, on its way or at last."""
        sides = [(p.growth.minus, p.growth.plus, p.peak.minus, p.peak.plus) for p in self.problem.resistances]
        return [self.reduced.slip_rows(p) for p, values in enumerate(sides) if any(values)]


Result = TypeVar("Result")


def analyse(comm: MPI.Comm, problem: RigidProblem) -> Solvability:
    """The state of a scene and its margins, before anything is solved. Collective; the same on all ranks.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
    """
    held = Solvability(state="held", paper=PaperConditions(0.0, None))  # no motion is left: held under any load
    return _judged(comm, problem, held, lambda found: _verdict(problem, found))


def gives_way(comm: MPI.Comm, problem: RigidProblem) -> bool:
    """Whether the load does more work along a rigid motion than the growth resists. Collective; the same on all ranks.

    The growth does not hold the body then, whatever the peak does. One minimum tells, where the whole verdict takes one
    for each face of the unit ball; where the programmes broke down, nothing is known, and it is not said to give way.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
    """
    return _judged(comm, problem, False, lambda found: _gives_way(problem, found))


def _gives_way(problem: RigidProblem, reduced: ReducedProblem) -> bool:
    try:
        return Analysis(problem, reduced).gives_way
    except SolverError:
        return False


def _verdict(problem: RigidProblem, reduced: ReducedProblem) -> Solvability:
    analysis = Analysis(problem, reduced)
    try:
        return analysis.solvability()
    except SolverError as error:
        return undecided(modes(reduced.frame, problem.body), analysis.paper_c, str(error))


def load_factors(comm: MPI.Comm, problem: RigidProblem, *loads: str) -> LoadFactors:
    """Factors of some loads together, the others constant. Collective; the same on all ranks.

    Args:
        comm: the ranks of the mesh.
        problem: the body and what it meets.
        loads: their names; none: the whole load.

    Raises:
        InputError: there is no such load.
        SolverError: the linear programmes broke down.
    """
    names = loads or tuple(problem.loads)
    for name in names:
        if name not in problem.loads:
            raise InputError(f"there is no load {name!r}; there are: {', '.join(problem.loads) or 'none'}")
    unmoved = LoadFactors(-np.inf, np.inf, np.inf, None, None)
    return _judged(comm, problem, unmoved, lambda found: Analysis(problem, found).load_factors(names))


def _judged(
    comm: MPI.Comm,
    problem: RigidProblem,
    unmoved: Result,
    work: Callable[[ReducedProblem], Result],
) -> Result:
    """What the work finds of the reduced problem; the given result where no rigid motion is left. Collective."""
    basis, reduced = reduce(comm, problem)
    if basis.shape[1] == 0:
        return unmoved
    return on_root(comm, lambda: work(cast(ReducedProblem, reduced)))
