"""The path of a problem through a load history: from event to event, with jumps, memory and an energy balance."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, magnitude
from .branch import Branch, Move, Passage, Refused, StepEnd
from .contact_points import ContactPoints
from .curve import branch_from
from .energy_balance import EnergyBalance
from .initial_state import Nowhere, at_rest, settled
from .jumps import WAYS, Jump
from .state import Cycle, Cycles, End, Event, EventPlace, Follow, LoadHistory, PathOptions, PathState, Stopped
from .thresholds import DEFAULT
from .vertex_laws import multiplied


class Follower(LoadHistory):
    """The path of a problem, exact where all laws are piecewise linear, else by predictor and corrector.

    Args:
        problem: the problem.
        options: what path is wanted.
        resume: the state after which to go on; by default the path begins at factor 0.
        interrupted: whether to stop, asked at each state, at each step of a jump, and as each point passes.

    Attributes:
        end: how the path ended; None before.
        reason: that in a sentence.

    Raises:
        InputError: a law on a length shares an unknown with another law or a bound.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None = None,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(options)
        problem, self._factors = multiplied(problem)
        self._problem = problem
        self._resume, self._interrupted = resume, interrupted
        self._events, self._peak, self._adrift = 0, 0.0, False
        self._points = ContactPoints(problem, options.remember)
        self._points.check = self._check
        self._empty_jumps = 0
        self._blocked = False
        self._last: PathState
        self._branch: Branch
        self._cycles: Cycles

    @property
    def factor(self) -> float:
        """λ."""
        return self._branch.factor

    @property
    def _x(self) -> Array:
        """The displacements of the problem as it was given, (n,)."""
        return self._branch.values.x / self._factors

    def _check(self) -> None:
        """Go on, or not.

        Raises:
            Stopped: the path is to stop.
        """
        if self._interrupted():
            raise Stopped

    # -- the load history

    def states(self) -> Iterator[PathState]:
        """The states from start to end; the first one of a path that is resumed is the next one."""
        try:
            yield from self._all_states()
        except Stopped:
            self._finish(End.INTERRUPTED, "interrupted")
        except np.linalg.LinAlgError:
            self._finish(End.LOST, "after the last state the equations of the path are singular")

    def _all_states(self) -> Iterator[PathState]:
        programme = self._options.programme
        if self._resume is None:
            yield from self._begun()
        else:
            self._restore(self._resume)
            self._peak = max(map(abs, programme[: self._leg]), default=0.0)
            self._adrift = self._resume.event not in (Event.START, Event.JUMP) and self._is_adrift()
        while self.end is None and self._leg < len(programme):
            yield from self._gone_to(programme[self._leg])
            self._leg += 1
            if self.end is None and self._leg < len(programme):
                yield self._state(Event.TURN)
            elif self.end is None:
                self._finish(End.REACHED, "the programme is done")
                yield self._state(Event.END)
        if self.end is None:  # resumed from its last state
            self._finish(End.REACHED, "the programme is done")

    def _gone_to(self, aim: float) -> Iterator[PathState]:
        """A leg; none where no factor on it is borne."""
        limit, way = self._limit(self.factor), 1.0 if aim >= self.factor else -1.0
        if way * (aim - limit) > 0.0 and way * (self.factor - limit) >= -self._small:
            self._finish(End.ESCAPES, self._not_borne(limit))
            yield self._state(Event.END)
        else:
            yield from self._towards(aim)

    # -- beginning

    def _begun(self) -> Iterator[PathState]:
        """The first state; none where its factor is not borne, or the path ends before."""
        low, high = self._options.borne
        if low > self._small or high < -self._small:
            self._finish(End.ESCAPES, "no equilibrium bears the constant loads alone: a body comes off")
            return
        z = self._first()
        if z is None:
            return
        self._follow_from(z, 0.0)
        self._balance = EnergyBalance(self._problem, self._points, self._branch.values, 0.0)
        self._branch.unstable = self._points.unstable_directions(self._branch.values)
        yield self._state(Event.START)

    def _first(self) -> Array | None:
        """Where the points are at the factor 0; None: the path has ended."""
        rest, constant = at_rest(self._problem, self._points)
        if constant is not None:
            return self._loaded(constant)
        if self._points.is_held(self._points.values(rest)):
            return rest
        z = self._at_no_load(rest, self._options.programme[0])
        if isinstance(z, Nowhere):
            (self._come_off if z is Nowhere.AWAY else self._lose)(0.0, z.value)
            return None
        return z

    def _at_no_load(self, z: Array, towards: float) -> Array | Nowhere:
        held = self._is_held(DEFAULT.small * towards)
        return settled(self._problem, self._points, z, towards, held=held)

    def _loaded(self, constant: CondensedProblem) -> Array | None:
        """From rest to the constant loads, as stable as it goes; where the points are then."""
        options = PathOptions(remember=self._options.remember)
        follower = Follower(constant, options, interrupted=self._interrupted)
        for _ in follower.states():
            pass
        if follower.end is End.INTERRUPTED:
            raise Stopped
        if follower.end is not End.REACHED:
            reason = f"under the constant loads alone: {follower.reason}"
            (self._come_off if follower.end is End.ESCAPES else self._lose)(0.0, reason)
            return None
        self._points = follower._points
        return follower._branch.z

    def _follow_from(self, z: Array, factor: float, inverse: CellInverse | None = None) -> None:
        problem = self._problem
        self._branch = branch_from(self._points, problem.force, problem.force_rate, z, factor, inverse)
        self._branch.divides = any(bonds.mixity for bonds in problem.bonds)

    def _restore(self, state: PathState) -> None:
        """Go on after a state."""
        self._follow_from(self._points.take(state), state.factor)
        if self._points.straight or state.event not in (Event.START, Event.TURN):
            self._branch.resume(state.position)
        self._branch.unstable, self._leg, self._last = state.unstable, state.position.leg, state
        start = self._problem, self._points, self._branch.values, self.factor
        self._balance = EnergyBalance(*start, work=state.work, dissipated=state.dissipated)

    # -- one leg of the load history

    def _towards(self, aim: float) -> Iterator[PathState]:
        """From event to event until the factor reaches its aim or the path ends."""
        self._orient(aim)
        self._cycles = Cycles(self._x)
        while self.end is None and self.factor != aim:
            if self._adrift or self._must_jump(aim):
                yield from self._taken_up() if self._adrift else self._jump(aim)
                continue
            move = self._branch.advance(self._next(aim))
            if move.outcome in (StepEnd.AWAY, StepEnd.STUCK):
                self._ended(move.outcome)
                yield self._state(Event.END)
                return
            self._balance.go(self._branch, move)
            if move.outcome is not StepEnd.FACTOR or self.factor != aim:
                yield self._noted(move)
            if self.end is None:
                self._watch()
            if self.end is not None:
                yield self._state(Event.END)

    def _watch(self) -> None:
        """Count an event; end the path where it has a reason to."""
        self._events += 1
        self._peak = max(self._peak, abs(self.factor))
        self._adrift = self._is_adrift()
        if self._adrift and not self._is_held(self.factor):
            self._finish(End.ESCAPES, "the load is back at zero, and nothing holds the body any more")
        elif self._interrupted():
            self._finish(End.INTERRUPTED, "interrupted")
        elif self._events > self._options.most_events:
            self._lose(self.factor, f"no end after {self._options.most_events} events")

    def _is_adrift(self) -> bool:
        """Whether the load is back at zero and nothing would resist the next; where that is borne, it takes up all."""
        values, rate, none = self._branch.values, self._problem.force_rate, DEFAULT.none * self._peak
        rests = abs(self.factor) <= none and magnitude(values.force) <= none * magnitude(rate)
        if self._peak == 0.0 or not len(self._points.rigid) or not rests:
            return False
        return bool(np.any(self._points.unresisted(values, rate).driven))

    def _must_jump(self, aim: float) -> bool:
        if self._blocked or self._options.follow is Follow.EXACT:
            return self._blocked
        return self._branch.must_leave(aim)

    def _next(self, aim: float) -> float:
        """The next factor that the path may come to as it goes: one at which a state is wanted, or the aim."""
        if self._points.straight:
            return aim
        factor, up = self.factor, self._branch.rising > 0.0
        ahead = [f for f in (*self._options.stops, aim) if f != factor and (f > factor) == up]
        return min(ahead, key=lambda f: abs(f - factor), default=aim)

    def _orient(self, aim: float) -> None:
        """Set out towards a factor; a path that is resumed on its way goes on as it went."""
        resumed, self._resume = self._resume, None
        if resumed is not None and resumed.event not in (Event.START, Event.TURN):
            return
        try:
            self._branch.set_out(1.0 if aim > self.factor else -1.0)
        except Refused:
            self._lose_among_ends()
        self._branch.watch_folds()

    def _passed(self, move: Move) -> list[Passage]:
        """The passages at the present state; where there is no end of them, the path is lost."""
        if move.outcome not in (StepEnd.END, StepEnd.TURNED):
            return []
        try:
            return self._branch.pass_on(move)
        except Refused:
            self._lose_among_ends()
            return []

    def _lose_among_ends(self) -> None:
        where = f"at the factor {self.factor:.6g} several bonds are at ends of their pieces"
        self._lose(self.factor, f"{where}, and each way on leads from one of them to the other")

    def _noted(self, move: Move) -> PathState:
        """The state after a step, and what happens there."""
        if move.outcome in (StepEnd.END, StepEnd.TURNED) and not self._points.straight and self._is_adrift():
            return self._state(Event.KINK)  # all bonds are broken at once: nothing is left to pass
        before = self._branch.trend
        passages = self._passed(move)
        self._branch.note(move)
        if move.outcome in (StepEnd.STEP, StepEnd.FACTOR):
            return self._state(Event.STEP)
        event = Event.FOLD
        if before * self._branch.trend >= 0:
            passages.sort(key=lambda passage: (Event.CONTACT, Event.RELEASE, Event.KINK).index(passage[1]))
            event = passages[0][1] if passages else Event.KINK
        state = self._state(event, passages)
        if move.outcome is not StepEnd.FOLD:
            self._detect_cycle(state)
        return state

    def _detect_cycle(self, state: PathState) -> None:
        """Where the path comes back to a state, a stable one jumps, or it ends."""
        found, straight = self._cycles.note(state), self._points.straight
        if straight and found is Cycle.BLOCKED and self._options.follow is Follow.STABLE:
            self._blocked = True
        elif found is Cycle.CLOSED or (found is not None and straight):
            self.is_closed, where = found is Cycle.CLOSED, f"at the factor {self.factor:.6g}"
            self._lose(self.factor, f"{where} the path comes back to where it was: {found.value}")
        elif not straight and self._cycles.standing > DEFAULT.waits + 4 * len(self._points):
            self._lose(self.factor, f"at the factor {self.factor:.6g} bonds and contacts pass for ever at one place")

    def _ended(self, outcome: StepEnd) -> None:
        """End where no step is short enough, or nothing ends the curve: where the factor stands, a body comes off."""
        if outcome is StepEnd.STUCK:
            self._lose(self.factor, f"at the factor {self.factor:.6g} no step is short enough to stay on the path")
        elif self._branch.stands:
            self._come_off(self.factor, f"at the factor {self.factor:.6g} a body comes off")
        else:
            self._lose(self.factor, "the path leads away from the wanted factor for ever")

    # -- jumps

    def _jump(self, aim: float) -> Iterator[PathState]:
        """On to the next stable equilibrium at the same factor, or off."""
        factor = self.factor
        heading, held = (1 if aim > factor else -1), self._is_held(factor)
        landing = Jump(self._problem, self._branch, heading, held=held).landing()
        if landing is not None and landing.z is not None:
            yield from self._goes_on(replace(self._landed(landing.z, factor, aim, landing.inverse), way=landing.way))
            return
        if landing is None:
            self._lose(factor, f"no stable state was found at the factor {factor:.6g} ({', '.join(WAYS)})")
        else:
            told = "no equilibrium is left" if landing.proven else f"no motion rests ({landing.way})"
            self._come_off(factor, f"at the factor {factor:.6g} {told}: a body comes off")
        yield replace(self._last, event=Event.END, place=None, released=0.0, way="")

    def _goes_on(self, landed: PathState) -> Iterator[PathState]:
        """A jump's state, and the end where jumps in a row have released nothing: their causes were rounding."""
        yield landed
        self._empty_jumps = 0 if landed.released > 1e-12 * abs(landed.energy) else self._empty_jumps + 1
        if self._empty_jumps > DEFAULT.waits:
            self._lose(self.factor, f"at the factor {self.factor:.6g} jumps release no energy: rounding alone leads on")
            yield self._state(Event.END)

    def _taken_up(self) -> Iterator[PathState]:
        """From no load, at which the body is free, to where the next load takes it."""
        programme = self._options.programme
        self._adrift = False
        towards = next((factor for factor in programme[self._leg :] if factor), programme[0])
        z = self._at_no_load(self._branch.z, towards)
        if isinstance(z, Nowhere):
            self._lose(self.factor, z.value)
            yield self._state(Event.END)
        else:
            yield self._landed(z, 0.0, towards)

    def _landed(self, z: Array, factor: float, aim: float, inverse: CellInverse | None = None) -> PathState:
        self._blocked = False
        self._follow_from(z, factor, inverse)
        released = self._balance.leap(self._branch.values, factor)
        if self._points.straight:
            self._branch.unstable = self._points.unstable_directions(self._branch.values)
        self._orient(aim)
        return replace(self._state(Event.JUMP), released=released)

    # -- reports

    def _state(self, event: Event, passages: Sequence[Passage] = ()) -> PathState:
        """The present state."""
        stored = self._balance.stored
        self._last = PathState(
            factor=self.factor,
            event=event,
            place=self._place(*passages[0]) if passages else None,
            x=self._x,
            energy=stored.energy,
            work=self._balance.work,
            dissipated=stored.dissipated,
            unstable=self._branch.unstable,
            memory=self._points.memory,
            position=self._branch.position(self._leg),
        )
        return self._last

    def _place(self, k: int, event: Event) -> EventPlace:
        """Where a point passed: at the part of its law or, where a contact closes or opens, of the contact."""
        problem, i = self._problem, int(self._points.unknowns[k][0])
        laws = self._points.laws[self._points.owner(k)] if event is Event.KINK else []
        part = laws[0].bonds.part if laws else problem.parts[i]
        return EventPlace(part=part, unknown=i, point=problem.points[i])
