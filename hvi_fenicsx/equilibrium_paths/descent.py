"""From a state that is not stable down to the next stable equilibrium at the same loads.

The branch iteration on Γc: of each law the falling parts are replaced by their tangents (a majorant), a small proximal
term keeps the problem strictly convex, and the minimiser of that is followed to exactly (:mod:`.tracer`), from the
present point: the energy falls at each step. As soon as the linear equations of one cell have a stable solution within
that cell, this is the equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .placing import place
from .segments import Component, Segment, chain
from .softest import softest
from .tracer import Tracer


@dataclass(frozen=True, kw_only=True)
class Landing:
    """Where a descent ended.

    Attributes:
        x: the displacements; of a body that escapes, far away, (n,).
        escapes: whether the energy falls without end.
        found: whether a stable equilibrium was found.
    """

    x: Array
    escapes: bool
    found: bool


class Descent:
    """The iteration at constant loads.

    Args:
        bonds: the problem with the present graphs of its laws.
        load: f, (n,).
        step: called before each step; it may end the iteration by an exception.
        proximal: stiffness of the proximal term, relative to the elastic one.
        most: steps at most.
        far: a displacement that is infinite, in units of all lengths of the problem.
    """

    def __init__(
        self,
        bonds: BondTable,
        load: Array,
        step: Callable[[], None] = lambda: None,
        *,
        proximal: float = 1e-6,
        most: int = 2_000,
        far: float = 1e3,
    ) -> None:
        self._bonds, self._load, self._step, self._most = bonds, load, step, most
        problem = bonds.problem
        self._stiffness, self._n = problem.elastic, problem.size
        self._proximal = proximal * float(np.max(self._stiffness.diagonal, initial=1e-300))
        self._held = self._stiffness.raised(self._proximal)
        self._true = [bonds.chain(i) for i in range(self._n)]
        self._split = [[(b.weight, *b.present.split()) for b in bonds.at(i)] for i in range(self._n)]
        self._convex = [self._convex_chain(i) for i in range(self._n)]
        self._far = far * self._length()

    def _convex_chain(self, i: int) -> tuple[Segment, ...]:
        rising = [Component(graph=h, weight=w) for w, h, _ in self._split[i]]
        problem = self._bonds.problem
        return chain(rising, float(problem.lower[i]), float(problem.upper[i]))

    def _length(self) -> float:
        ends = [s.x for segments in self._true for s in segments] + [1e-300]
        ends += [s.x + s.high for segments in self._true for s in segments if np.isfinite(s.high) and not s.rise]
        return float(np.max(np.abs(ends)))

    def energy(self, x: Array) -> float:
        """½ xᵀS x - fᵀx + Σ w j.

        Args:
            x: within its bounds, (n,).
        """
        return 0.5 * float(x @ (self._stiffness @ x)) - float(self._load @ x) + self._bond_energy(x)

    def _bond_energy(self, x: Array) -> float:
        return float(sum(b.weight * float(b.present.primitive(x[b.unknown])) for b in self._bonds.bonds))

    def pushed(self, cells: Cells, rates: Array) -> Array:
        """A point of lower energy beside a state that is not stable; the state itself where none is found.

        Args:
            cells: the state.
            rates: directions of its coordinates along the path, (n,).
        """
        best, lowest = cells.x, self.energy(cells.x)
        rounding = 1e-13 * (abs(lowest) + abs(float(self._load @ cells.x)))
        for direction in self._pushes(cells, rates):
            for length in self._far / 1e3 * 0.25 ** np.arange(1, 16):
                for side in (1.0, -1.0):
                    trial = self._within(cells.x + side * length * direction)
                    energy = self.energy(trial)
                    if energy < lowest - rounding:
                        best, lowest = trial, energy
        return best

    def _pushes(self, cells: Cells, rates: Array) -> Iterator[Array]:
        """Directions in which the energy may fall, of length 1 in the maximum norm."""
        along = np.where(cells.moving, rates, 0.0)
        if np.any(along):
            yield along / np.max(np.abs(along))
        with suppress(np.linalg.LinAlgError):
            found = softest(cells, cells.inverse(), np.ones(self._n), self._bonds.thresholds.softest)
            if np.any(found):
                yield found / np.max(np.abs(found))
        for i in np.flatnonzero((cells.rise < 0.0) & ~cells.bound):
            yield np.eye(1, self._n, i)[0]

    def _within(self, x: Array) -> Array:
        problem = self._bonds.problem
        return np.clip(x, problem.lower, problem.upper)

    def land(self, x: Array, before: Array) -> Landing:
        """The equilibrium below a point.

        Args:
            x: where to begin, (n,).
            before: where one comes from: at a drop, its other side counts, (n,).
        """
        last = x  # of the minimisers: what is done between them bends the body to and fro, however far it goes
        for _ in range(self._most):
            following = self._convex_minimiser(x, x - before)
            if self._gone(following, following - last):
                return Landing(x=following, escapes=True, found=False)
            settled = self._settled(following)
            if settled is not None:
                return Landing(x=settled, escapes=False, found=True)
            before, last, x = x, following, self._hastened(following, following - x)
            x = self._hastened(x, self._curved(x))
        return Landing(x=x, escapes=False, found=False)

    def _gone(self, x: Array, step: Array) -> bool:
        """Whether a rigid motion has taken the body out of all reach."""
        size = float(np.max(np.abs(step), initial=0.0))
        stiff = float(np.max(np.abs(self._stiffness @ step), initial=0.0))
        return bool(np.max(np.abs(x), initial=0.0) > self._far) and stiff <= 1e-4 * size * float(
            np.max(self._stiffness.diagonal, initial=0.0)
        )

    def _hastened(self, x: Array, step: Array) -> Array:
        """Farther along a direction, while the energy falls."""
        best, lowest = x, self.energy(x)
        for factor in 2.0 ** np.arange(-3, 20):
            trial = self._within(x + factor * step)
            energy = self.energy(trial)
            if energy >= lowest and factor >= 1.0:
                break
            if energy < lowest:
                best, lowest = trial, energy
        return best

    def _curved(self, x: Array) -> Array:
        """A Newton step in which falling laws count as rising ones."""
        cells = self._cell(x)
        columns = cells.columns(None, np.zeros(self._n))
        force = np.where(cells.moving, self._load - self._stiffness @ cells.x - cells.force, 0.0)
        step = self._held.inverse(replace(columns, slope=np.abs(columns.slope))).solve(force)
        return np.where(cells.moving, step, 0.0)

    def _subtracted(self, x: Array, direction: Array) -> Array:
        """The traction of the subtracted convex parts, on the side where one is going, (n,)."""
        found, at, sides = np.zeros(self._n), x[:, None], np.where(direction < 0.0, "left", "right")
        for i, parts in enumerate(self._split):
            found[i] = sum(w * float(g.traction(at[i], str(sides[i]))[0]) for w, _, g in parts)
        return found

    def _convex_minimiser(self, x: Array, direction: Array) -> Array:
        """The minimiser of the majorant at a point."""
        stiffness = self._held
        load = self._load + self._subtracted(x, direction) + self._proximal * x
        force = np.clip(load - stiffness @ x, *self._convex_forces(x))
        held = stiffness @ x + force
        cells = place(stiffness, self._convex, x, force)
        tracer = Tracer(stiffness, held, load - held, cells, 0.0, thresholds=self._bonds.thresholds)
        while True:
            self._step()
            step = tracer.advance(1.0)
            if step.variable is None or step.variable < 0:
                self._cells = tracer.cells
                return tracer.cells.x
            i, forward = step.variable, bool(tracer.rates[step.variable] > 0.0)
            tracer.enter(i, *tracer.cells.beyond(i, forward=forward))

    def _convex_forces(self, x: Array) -> tuple[Array, Array]:
        """The least and the greatest force of rising parts and bounds, (n,) each."""
        problem = self._bonds.problem
        ends = [
            [sum(w * float(h.traction(x[i : i + 1], side)[0]) for w, h, _ in self._split[i]) for i in range(self._n)]
            for side in ("left", "right")
        ]
        low, high = np.array(ends[0], dtype=float), np.array(ends[1], dtype=float)
        return np.where(x <= problem.lower, -np.inf, low), np.where(x >= problem.upper, np.inf, high)

    def _settled(self, x: Array) -> Array | None:
        """The stable solution of the equations of a point's cell, if it is within that cell."""
        cells = self._cell(x)
        if np.any((cells.rise < 0.0) & ~cells.bound):
            return None
        return self._solved(cells)

    def _cell(self, x: Array) -> Cells:
        """The cell of a point, with the unknowns held that the majorant held."""
        force = self._load - self._stiffness @ x
        numbers, held = np.zeros(self._n, dtype=np.int64), self._cells.rise != 0.0
        for i, segments in enumerate(self._true):
            numbers[i] = _number(segments, float(x[i]), held=bool(held[i]))
        coordinates = [
            s[k].coordinate(float(x[i]), float(force[i]))
            for i, (s, k) in enumerate(zip(self._true, numbers, strict=True))
        ]
        return Cells(self._stiffness, self._true, numbers, np.array(coordinates))

    def _solved(self, cells: Cells) -> Array | None:
        residual = self._stiffness @ cells.x + cells.force - self._load
        cells.hold(np.zeros(self._n))
        if cells.unstable_directions(0.0):
            return None
        try:
            cells.tau -= np.where(cells.moving, cells.inverse().solve(residual), 0.0)
        except np.linalg.LinAlgError:
            return None
        force = self._load - self._stiffness @ cells.x
        stands = ~cells.moving
        cells.tau[stands] = cells.rise[stands] * (force - cells.standing_force)[stands]
        slack = 1e-10 * (np.abs(cells.tau) + np.where(np.isfinite(cells.high - cells.low), cells.high - cells.low, 0.0))
        inside = (cells.tau >= cells.low - slack) & (cells.tau <= cells.high + slack)
        return cells.x if bool(np.all(inside)) and self._balances(cells) else None

    def _balances(self, cells: Cells) -> bool:
        """Whether the forces balance: in singular equations, which rounding makes regular, they do not."""
        elastic, force = self._stiffness @ cells.x, cells.force
        size = max(float(np.max(np.abs(f), initial=0.0)) for f in (elastic, force, self._load))
        left = float(np.max(np.abs(elastic + force - self._load), initial=0.0))
        return left <= self._bonds.thresholds.balanced * size


def _number(segments: tuple[Segment, ...], x: float, *, held: bool) -> int:
    """The segment of a displacement: one on which it stands, if it is held, else a piece."""
    away = np.array([abs(s.displacement(s.coordinate(x, s.force)) - x) for s in segments])
    fits = np.array([bool(s.rise) == held for s in segments])
    return int(np.argmin(np.where(fits, away, np.inf) if fits.any() else away))
