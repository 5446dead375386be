"""Load paths of bounds and piecewise linear laws: exact, from event to event, with no step size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from typing_extensions import override

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, Integers
from .beginning import Beginning, at_rest
from .bonds import BondTable
from .books import EnergyBalance
from .cells import Cells
from .descent import Descent, Landing
from .onward import Way, chosen, ways_on
from .passing import Passing, classify, go_on
from .placing import place
from .programme import Follower, why_not_loaded
from .rounds import Round, Rounds
from .settling import Nowhere, settled
from .snap import snap
from .state import End, Event, Follow, PathOptions, PathState, Place, Position, place_of
from .step import FACTOR
from .tracer import Tracer
from .watch import Watch

EMPTY_JUMPS = 8
"""So many jumps in a row that release nothing are no way on."""


class ExactFollower(Follower):
    """The path of a problem whose laws are piecewise linear.

    Args:
        problem: the problem.
        options: what path is wanted.
        resume: the state after which to go on; by default the path begins at factor 0.
        watch: whether to stop, asked at each event and within jumps, and who is told of these.
        beginning: the first state, where it is known.

    Attributes:
        end: how the path ended; None before.
        reason: that in a sentence.
        tracer: the curve that is followed.

    Raises:
        InputError: a law is not piecewise linear, or acts on |u_t| in 3D.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None = None,
        watch: Watch | None = None,
        beginning: Beginning | None = None,
    ) -> None:
        super().__init__(problem, options, resume, watch)
        self._beginning = beginning
        self._bonds = BondTable(problem, options.remember, options.thresholds.exact)
        self._moved, self._direction, self._blocked = 0, 1, False
        self._empty_jumps = 0
        self._untried: tuple[Array, list[Way]] = np.empty(0), []
        self.tracer: Tracer

    @property
    @override
    def factor(self) -> float:
        return self.tracer.factor

    # -- beginning

    @override
    def _begun(self) -> Iterator[PathState]:
        programme, remember = self._options.programme, self._options.remember
        thresholds = self._options.thresholds
        start = self._beginning or at_rest(self._problem, remember, programme[0], thresholds)
        if start.constant is not None:
            start = self._loaded(start, start.constant)
        self._bonds.restore(start.memory)
        self._balance = EnergyBalance(self._problem, self._bonds)
        if start.cells is None:
            self._end_before(start.reason, escapes=start.escapes)
            return
        self._unstable = start.cells.unstable_directions()
        self._follow_from(start.cells, 0.0)
        self._begin_balance(anew=True)
        yield self._state(Event.START)

    def _loaded(self, start: Beginning, constant: CondensedProblem) -> Beginning:
        """From rest to the constant loads, as stable as it goes."""
        options = PathOptions(remember=self._options.remember, thresholds=self._options.thresholds)
        beginning = replace(start, constant=None)
        follower = ExactFollower(constant, options, watch=self._watcher, beginning=beginning)
        if reason := why_not_loaded(follower):
            off = follower.end is End.ESCAPES
            return Beginning(cells=None, memory=follower.memory, reason=reason, escapes=off)
        return Beginning(cells=follower.tracer.cells, memory=follower.memory)

    @override
    def _restore(self, state: PathState) -> None:
        if state.memory is not None:
            self._bonds.restore(state.memory)
        self._balance = EnergyBalance(self._problem, self._bonds, state.work, state.dissipated)
        self._unstable, self._leg = state.unstable, state.position.leg
        self._follow_from(self._placed(state.x, state.factor, state.position.numbers), state.factor, state.position)
        self._begin_balance(anew=False)

    def _placed(self, x: Array, factor: float, numbers: Integers | None = None) -> Cells:
        """The cell of an equilibrium."""
        problem = self._problem
        chains = [self._bonds.chain(i) for i in range(problem.size)]
        return place(problem.elastic, chains, x, problem.load(factor) - problem.elastic @ x, numbers)

    def _follow_from(
        self,
        cells: Cells,
        factor: float,
        position: Position | None = None,
        heading: int = 1,
        inverse: CellInverse | None = None,
    ) -> None:
        given, problem = position, self._problem
        self.tracer = Tracer(
            problem.elastic,
            problem.force,
            problem.force_rate,
            cells,
            factor,
            driver=FACTOR if given is None else given.driver,
            heading=heading if given is None else given.heading,
            small=None if given is None else given.small,
            inverse=inverse,
            thresholds=self._options.thresholds.exact,
        )

    def _begin_balance(self, *, anew: bool) -> None:
        cells = self.tracer.cells
        self._balance.begin(cells.x, cells.bond_force, self.tracer.factor, anew=anew)

    # -- one leg of the programme

    @override
    def _towards(self, aim: float) -> Iterator[PathState]:
        self._orient(aim)
        self._rounds = Rounds(self.tracer.cells.x, self._options.thresholds.exact.same_place)
        while self.end is None and self.tracer.factor != aim:
            if self._adrift or self._must_jump(aim):
                yield from self._taken_up() if self._adrift else self._jump(aim)
                continue
            step = self.tracer.advance(aim)
            cells = self.tracer.cells
            if step.variable is None:
                self._end_for_ever(stands=self.tracer.stands)
                yield self._state(Event.END)
                return
            self._balance.go(cells.x, cells.bond_force, self.tracer.factor)
            if step.variable != FACTOR:
                yield self._noted(self._pass(go_on(self.tracer, self._bonds, step)), aim)
            if self.end is None:
                self._watch()
            if self.end is not None:
                yield self._state(Event.END)

    def _orient(self, aim: float) -> None:
        wanted = np.sign(aim - self.tracer.factor)
        if not self._is_under_way() and (self.tracer.trend or self.tracer.factor_rate) * wanted < 0.0:
            self.tracer.turn()

    @override
    def _is_off(self) -> bool:
        tracer = self.tracer
        return tracer.at_rest(self._peak) and bool(np.any(tracer.cells.unresisted(self._problem.force_rate).driven))

    def _noted(self, state: PathState, aim: float) -> PathState:
        """The state after an event; where the path comes back to one, another way is taken, or the path ends."""
        found = self._rounds.note(state)
        if found is Round.BLOCKED and self._takes_another_way(aim):
            return self._state(state.event, state.place, bifurcation=True)
        if found is not None:
            self._go_round(found)
        return state

    def _takes_another_way(self, aim: float) -> bool:
        """On by another of all ways, of those not tried yet; a stable path that has none jumps."""
        tracer, stable = self.tracer, self._options.follow is Follow.STABLE
        at, ways = self._untried
        if not np.array_equal(at, self._rounds.came):
            ways = ways_on(self._problem, self._bonds, tracer.cells, tracer.sizes())
        way = chosen(ways, self._rounds.came, float(np.sign(aim - tracer.factor)), stable=stable)
        self._untried = self._rounds.came, [other for other in ways if other is not way]
        if way is not None:
            self._follow_from(way.cells, tracer.factor, heading=way.heading)
            self._unstable, (self._moved, self._direction) = way.unstable, way.leader
        self._blocked = stable and (way is None or way.unstable > 0)
        return way is not None or stable

    def _pass(self, passing: Passing) -> PathState:
        """The state after an event."""
        self._unstable += passing.unstable_change
        if passing.unstable_change > 0 or passing.neutral:
            self._moved, self._direction = passing.unknown, passing.direction
        if passing.neutral:
            self._unstable = self.tracer.cells.unstable_directions()
        here = self._bonds.at(passing.unknown)
        group = here[0].group if here and not passing.at_bound else None
        place = place_of(self._problem, passing.unknown, group)
        return self._state(classify(passing), place, bifurcation=passing.bifurcation)

    # -- jumps

    def _must_jump(self, aim: float) -> bool:
        if self._blocked:
            return True
        if self._options.follow is Follow.EXACT or self._unstable == 0:
            return False
        return not self.tracer.at_end(aim)

    def _jump(self, aim: float) -> Iterator[PathState]:
        """On to the next stable equilibrium at the same factor, or off."""
        cells, factor, memory = self.tracer.cells, self.tracer.factor, self._bonds.memory
        self._watcher.jumps(factor)
        load, step = self._problem.load(factor), self._watcher.step
        found = snap(self._bonds, load, self.tracer, self._moved, self._direction, step)
        if found is not None and found.cells is not None:
            yield from self._goes_on(self._landed(found.cells, factor, aim, found.inverse))
            return
        landing = self._descended() if found is None else Landing(x=cells.x, escapes=True, found=False)
        if landing.found:
            yield from self._goes_on(self._landed(self._placed(landing.x, factor), factor, aim))
            return
        if landing.escapes:
            self._bonds.restore(memory)
        self._end_jump(escapes=landing.escapes)
        yield self._state(Event.END)

    @override
    def _settled(self, towards: float) -> PathState | Nowhere:
        self._remember_all()
        loads = replace(self._problem, force_rate=towards * self._problem.force_rate)
        found = settled(self._bonds, loads, self.tracer.cells.x, self._options.thresholds.settling)
        return found if isinstance(found, Nowhere) else self._landed(found, 0.0, towards)

    def _descended(self) -> Landing:
        """Down by the branch iteration."""
        cells, rates = self.tracer.cells, self.tracer.rates
        self._remember_all()
        descent = Descent(self._bonds, self._problem.load(self.tracer.factor), self._watcher.step)
        return descent.land(descent.pushed(cells, rates), cells.x)

    def _landed(self, cells: Cells, factor: float, aim: float, inverse: CellInverse | None = None) -> PathState:
        self._blocked = False
        self._follow_from(cells, factor, inverse=inverse)
        self._unstable = 0 if cells.is_stable() else cells.unstable_directions()
        cells = self.tracer.cells
        released = self._balance.leap(cells.x, cells.bond_force)
        self._orient(aim)
        return replace(self._state(Event.JUMP), released=released)

    def _goes_on(self, landed: PathState) -> Iterator[PathState]:
        """A jump's state, and the end where jumps in a row have released nothing: their causes were rounding."""
        yield landed
        self._empty_jumps = 0 if landed.released > 1e-12 * abs(landed.energy) else self._empty_jumps + 1
        if self._empty_jumps > EMPTY_JUMPS:
            self._lose(self.factor, f"at the factor {self.factor:.6g} jumps release no energy: rounding alone leads on")
            yield self._state(Event.END)

    def _remember_all(self) -> None:
        cells = self.tracer.cells
        x, force = cells.x, cells.bond_force
        for i in self._bonds.with_memory:
            self._bonds.remember(i, float(x[i]), float(force[i]))

    @property
    def memory(self) -> Array:
        """What the bonds remember, (bonds, 4)."""
        return self._bonds.memory

    # -- reports

    @override
    def _state(self, event: Event, place: Place | None = None, *, bifurcation: bool = False) -> PathState:
        tracer, balance = self.tracer, self._balance
        return PathState(
            factor=tracer.factor,
            event=event,
            place=place,
            x=tracer.cells.x,
            energy=balance.energy,
            work=balance.work,
            dissipated=balance.dissipated,
            unstable=self._unstable,
            memory=self._bonds.memory if self._bonds.remembers else None,
            bifurcation=bifurcation,
            position=Position(
                leg=self._leg,
                numbers=tracer.cells.numbers.copy(),
                driver=tracer.driver,
                heading=tracer.heading,
                small=tracer.small.copy(),
            ),
        )
