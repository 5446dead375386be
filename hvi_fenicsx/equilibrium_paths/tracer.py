"""The equilibria of bounds and piecewise linear laws as a curve, followed from one end of a cell to the next.

In one cell the equations are linear: n equations for n coordinates τ and the factor λ. One of these n + 1 variables
drives, the others form a basis whose inverse is kept. Where a coordinate reaches the end of its segment, the unknown
goes on into the next one in the same direction along its graph, and its new coordinate drives: one column of the basis
changes, and whether λ then rises or falls follows. Never is a matrix singular where λ stands still. (Complementary
pivoting: Lemke 1965; Eaves 1976; for elastic-plastic frames Maier 1970.)

Where several unknowns reach ends at once, the load is imagined to be perturbed by ε q, with ε infinitesimal and q at
random: each coordinate then has a part of the order ε as well, which says who comes first.
"""

from __future__ import annotations

import numpy as np

from ..reduced.condensed_stiffness import CellInverse, CondensedStiffness
from ..typing import Array, Integers
from .basis import Basis
from .cells import Cells
from .segments import Segment
from .step import FACTOR, Step
from .thresholds import DEFAULT, ExactThresholds


class Tracer:
    """The curve from one of its points on.

    Args:
        stiffness: S.
        constant: f0, (n,).
        rate: f1, (n,).
        cells: where all unknowns are; changed.
        factor: λ.
        driver: the variable that drives.
        heading: its direction, 1 or -1.
        small: parts of the order ε of the coordinates, (n,); by default at random.
        inverse: of the cell's equations, where it is known and the factor drives.
        thresholds: what costs digits.

    Attributes:
        factor: λ.
        cells: where all unknowns are.
        heading: the direction of the variable that drives, 1 or -1.
        small: parts of the order ε of the coordinates, (n,).
        rates: how all coordinates change with the driving variable, (n,).
        factor_rate: how the factor does.
        stands: whether the factor stands still while unknowns move.
        trend: the sign of the factor's rate where it last did not stand, or with which the path set out; 0 before that.

    Raises:
        numpy.linalg.LinAlgError: the tangent is singular.
    """

    def __init__(
        self,
        stiffness: CondensedStiffness,
        constant: Array,
        rate: Array,
        cells: Cells,
        factor: float,
        *,
        driver: int = FACTOR,
        heading: int = 1,
        small: Array | None = None,
        inverse: CellInverse | None = None,
        thresholds: ExactThresholds = DEFAULT.exact,
    ) -> None:
        self._thresholds = thresholds
        self._stiffness, self._constant, self._rate = stiffness, constant, rate
        self.cells, self.factor, self.heading, self._size = cells, factor, heading, 0.0
        self._stiffest, self._dead, self._live = map(_largest, (stiffness.diagonal, constant, rate))
        self._generator = np.random.default_rng(0)
        self._perturb()
        if small is not None:
            self.small = np.array(small)
        cells.hold(rate)
        self.trend = 0
        if driver == FACTOR:
            driver = self._setting_out()
        self._basis = Basis(stiffness, rate, cells, driver, inverse, thresholds)
        self._find_direction()

    def _setting_out(self) -> int:
        """What drives where the path sets out with the factor: along a motion that nothing resists, the body does."""
        driven = self.cells.unresisted(self._rate).driven
        if not np.any(driven):
            return FACTOR
        first = int(np.argmax(np.abs(driven)))
        self.trend, self.heading = self.heading, self.heading * int(np.sign(driven[first]))
        return first

    # -- the perturbation

    def _perturb(self) -> None:
        """Coordinates of the order ε, inside the segments where a coordinate is at an end; q follows from them."""
        cells = self.cells
        self.small = self._generator.uniform(0.5, 1.5, len(cells))
        self.small[cells.tau == cells.high] *= -1.0
        self._lag = self._generator.uniform(0.5, 1.5, len(cells))
        self._behind = self._lag.copy()

    # -- linear algebra

    @property
    def driver(self) -> int:
        """The variable that drives."""
        return self._basis.driver

    def inverse(self) -> CellInverse | None:
        """The inverse of the present cell's equations; None where it is not known to enough digits."""
        return self._basis.inverse()

    def _find_direction(self) -> None:
        """How all variables change with the driving one."""
        self._basis.renew()
        rates = -self.heading * self._basis.column
        if self.driver == FACTOR:
            self.factor_rate = float(self.heading)
        else:
            self.factor_rate = float(rates[self.driver])
            rates[self.driver] = self.heading
        held = self.cells.held
        self.rates: Array = rates - held.T @ (held @ rates)
        self.stands = self._factor_stands()
        if not self.stands:
            self.trend = int(np.sign(self.factor_rate))

    def _residual(self) -> Array:
        cells = self.cells
        self.elastic = self._stiffness @ cells.x
        return np.asarray(self.elastic + cells.force - self._constant - self.factor * self._rate)

    def refine(self) -> None:
        """Take out what rounding has left in the equations, and find the direction."""
        residual = self._residual()
        loads = self._dead, abs(self.factor) * self._live
        self._size = max(self._size, _largest(self.elastic), _largest(self.cells.force), *loads)
        self._find_direction()
        self._correct(self._basis.roughly(residual))

    def _correct(self, change: Array) -> None:
        """Take a change off, the driving variable held; if that is a slow one, to the nearest point of the curve."""
        if self.driver != FACTOR:
            along = np.where(self.cells.moving, self.rates, 0.0)
            scale = _largest(along) or 1.0
            along, rate, own = along / scale, self.factor_rate / scale, float(change[self.driver])
            change[self.driver] = 0.0
            slow = abs(self.rates[self.driver]) < self._thresholds.slow * scale
            way = float(along @ change) / (float(along @ along) or 1.0) if slow else 0.0
            change -= way * self.rates / scale
            self.factor -= own - way * rate
        self.cells.tau -= change

    # -- events

    def advance(self, aim: float) -> Step:
        """Go to the end of the cell, or until the factor reaches its aim; there, on into the next cell.

        Args:
            aim: the factor at which to stop.
        """
        chosen = self._first_end(aim)
        if chosen is None:
            return Step(variable=None)
        variable, length, small, tied = chosen
        self._move(length, small)
        if variable == FACTOR:
            self.factor = aim
            return Step(variable=FACTOR)
        before, turned = self.cells.segment(variable), self._turns(variable)
        return Step(variable=variable, before=before, tied=tied, reversed=turned)

    def _turns(self, i: int) -> bool:
        return bool(self.rates[i] * self.cells.outward[i] < 0.0)

    def _move(self, length: float, small: float) -> None:
        self.cells.tau += length * self.rates
        self.factor += length * self.factor_rate
        self.small += small * self.rates
        inward = self.cells.outward * self.rates < 0.0
        self._behind = np.where(inward, self._behind - small * np.abs(self.rates), self._lag)

    def _first_end(self, aim: float) -> tuple[int, float, float, int] | None:
        """Which variable reaches its end first, the way to there, that of the order ε, and how many tie."""
        numbers, slack, small, speed, allowed = self._ends()
        if not numbers.size and not self._approaches(aim):
            return None
        if self._approaches(aim):
            until = (aim - self.factor) / self.factor_rate
            reach = float(np.min((slack + allowed) / speed, initial=np.inf))
            if until <= reach:
                return FACTOR, max(until, 0.0), 0.0, 1
        ways = slack / speed
        near = np.flatnonzero(ways <= np.min((slack + allowed) / speed))
        first = near[np.argmin(small[near] / speed[near])]
        return int(numbers[first]), float(ways[first]), float(small[first] / speed[first]), len(near)

    def _approaches(self, aim: float) -> bool:
        return bool((aim - self.factor) * self.factor_rate > 0.0) and not self.stands

    def _ends(self) -> tuple[Integers, Array, Array, Array, Array]:
        """The variables that approach an end: numbers, distances, those of the order ε, speeds, what may be passed."""
        cells, rates = self.cells, self.rates
        speed, size = np.abs(rates), self.sizes()
        inward = cells.outward * rates < 0.0
        distance = np.where(rates > 0.0, cells.high - cells.tau, cells.tau - cells.low)
        small = np.where(rates > 0.0, -self.small, self.small)
        distance, small = np.where(inward, 0.0, distance), np.where(inward, self._behind, small)
        steep = self._steepness()
        rounding = self._thresholds.neutral if self.stands else self._thresholds.still
        moves = speed * steep > rounding * self._fastest(speed)
        at = np.flatnonzero(moves & np.isfinite(distance))
        slack, beyond = np.maximum(distance[at], 0.0), np.maximum(-distance[at], 0.0)
        return at, slack, small[at], speed[at], np.maximum(1e-11 * (size / steep)[at] - beyond, 0.0)

    def _steepness(self) -> Array:
        """The slopes of pieces over the largest stiffness, 1 at least, (n,): there a short way is a large force."""
        cells, stiffest = self.cells, self._stiffest or np.inf
        return np.asarray(np.maximum(np.where(cells.moving, np.abs(cells.slope), 0.0) / stiffest, 1.0))

    def _fastest(self, speed: Array) -> Array:
        """The greatest speed of the same kind, of displacements or of forces, (n,).

        Where a body moves as a whole, the forces' speeds are what rounding leaves of stiffness times displacement.
        """
        moving = self.cells.moving
        kinds = [float(np.max(speed[kind], initial=0.0)) for kind in (moving, ~moving)]
        elastic = 0.1 * self._stiffest * kinds[0]
        return np.asarray(np.where(moving, kinds[0], max(kinds[1], elastic)))

    def sizes(self) -> Array:
        """What coordinates are measured by: displacements or forces, (n,)."""
        cells = self.cells
        moving = cells.moving
        lengths = np.where(np.isfinite(cells.high - cells.low), cells.high - cells.low, 0.0)
        kinds = [
            max(float(np.max(lengths[kind], initial=0.0)), float(np.max(np.abs(cells.tau[kind]), initial=0.0)))
            for kind in (moving, ~moving)
        ]
        return np.asarray(np.where(moving, kinds[0], kinds[1]))

    def enter(self, i: int, number: int, coordinate: float, chain: tuple[Segment, ...] | None = None) -> None:
        """Let an unknown go on, in its present direction along its graph, on another segment.

        Args:
            i: the unknown.
            number: of the segment.
            coordinate: τ there.
            chain: the segments, where they have changed.
        """
        direction = 1 if self.rates[i] > 0.0 else -1
        if chain is None:
            self.cells.enter(i, number, coordinate)
        else:
            self.cells.replace_chain(i, chain, number, coordinate)
        if self.cells.hold(self._rate):
            self._set_out()
        else:
            self.heading = self._heading_on(i, direction)
        self.small[i] = 0.0
        self._behind[i] = self._lag[i]
        self.refine()

    def _set_out(self) -> None:
        """Set out anew with the factor, as it went: other motions are held."""
        self.heading = self.trend or 1
        self._basis = Basis(self._stiffness, self._rate, self.cells, self._setting_out(), None, self._thresholds)

    def _heading_on(self, i: int, direction: int) -> int:
        """Choose what drives from an unknown's new segment on; its direction for the unknown to go in a given one.

        The unknown itself drives, unless it is so slow that the variable that drives already keeps more digits.
        """
        if i == self.driver:
            return direction
        if onward := self._basis.replace(i):
            return onward * self.heading
        self._basis.exchange(i)
        return direction

    def _factor_stands(self) -> bool:
        """Whether the factor stands still, but for rounding, while unknowns move."""
        cells, rates = self.cells, self.rates
        forces = _largest(np.where(cells.moving, cells.slope, cells.rise) * rates)
        size = self._stiffest * _largest(np.where(cells.moving, rates, 0.0)) + forces
        return abs(self.factor_rate) * self._live < self._thresholds.neutral * size

    def at_end(self, aim: float) -> bool:
        """Whether another unknown is at the end of its segment already.

        Args:
            aim: the factor at which to stop.
        """
        chosen = self._first_end(aim)
        numbers, slack, _, _, allowed = self._ends()
        return chosen is not None and bool(np.any((slack <= allowed)[numbers == chosen[0]]))

    def at_rest(self, peak: float) -> bool:
        """Whether loads and forces have gone back to nothing: where nothing else holds a body, it is free.

        Args:
            peak: the greatest factor so far.
        """
        small = 1e-9 * self._size
        return abs(self.factor) <= 1e-9 * peak and bool(np.all(np.abs(self.cells.force) <= small))

    def turn(self) -> None:
        """Go back."""
        self.heading, self.trend = -self.heading, -self.trend
        self._find_direction()


def _largest(values: Array) -> float:
    """The largest absolute value, 0 of none."""
    return float(np.abs(values).max(initial=0.0))
