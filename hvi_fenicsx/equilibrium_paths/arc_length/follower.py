"""Load paths that are not piecewise linear, from event to event, in steps between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from typing_extensions import override

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array
from ..programme import Follower, why_not_loaded
from ..rounds import Round, Rounds
from ..settling import Nowhere
from ..state import End, Event, Follow, PathOptions, PathState, Place, Position, place_of
from ..watch import Watch
from .curve import Curve
from .energies import Balance, displacement_rate
from .equations import Refused
from .events import Move, Outcome
from .felt import factors, felt
from .jump import Jump
from .passage import Crossing, Passage, event_of, order
from .rest import at_rest
from .settling import settled
from .sites import Sites
from .vertex_laws import vertex_laws


class ArcLengthFollower(Follower):
    """The path of a problem by predictor and corrector.

    Args:
        problem: the problem.
        options: what path is wanted.
        resume: the state after which to go on; by default the path begins at factor 0.
        watch: whether to stop, asked at each state and within jumps, and who is told of these.
        fineness: of the steps; 0.1 for a tenth of their length.

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
        watch: Watch | None = None,
        fineness: float = 1.0,
    ) -> None:
        self._factors = factors(problem)
        problem = felt(problem, self._factors)
        super().__init__(problem, options, resume, watch)
        self._fineness = fineness
        self._sites = Sites(problem, vertex_laws(problem, options.remember), options.thresholds)
        self._lag = order(problem, [int(group[0]) for group in self._sites.unknowns()])
        self._last: PathState | None = None
        self._curve: Curve
        self._rounds: Rounds

    @property
    @override
    def factor(self) -> float:
        return self._curve.factor

    # -- beginning

    @override
    def _begun(self) -> Iterator[PathState]:
        z = self._first()
        if z is None:
            return
        self._follow_from(z, 0.0)
        self._balance = Balance(self._problem, self._sites)
        self._balance.begin(self._curve.here.values, self._curve.factor)
        self._unstable = self._sites.unstable_directions(self._curve.here.values)
        yield self._state(Event.START)

    def _first(self) -> Array | None:
        """Where the sites are at the factor 0; None: the path has ended."""
        rest = at_rest(self._problem, self._sites)
        if rest.constant is not None:
            return self._loaded(rest.constant)
        if rest.held:
            return rest.z
        z = self._at_no_load(rest.z, self._options.programme[0])
        if isinstance(z, Nowhere):
            self._end_before(z.value, escapes=z is Nowhere.AWAY)
            return None
        return z

    def _at_no_load(self, z: Array, towards: float) -> Array | Nowhere:
        first = self._options.thresholds.settling.first_load * towards
        return settled(self._problem, self._sites, z, first, self._lag, self._watcher, held=self._is_held(first))

    def _loaded(self, constant: CondensedProblem) -> Array | None:
        """From rest to the constant loads, as stable as it goes; where the sites are then."""
        options = PathOptions(remember=self._options.remember, thresholds=self._options.thresholds)
        follower = ArcLengthFollower(constant, options, watch=self._watcher)
        if reason := why_not_loaded(follower):
            self._end_before(reason, escapes=follower.end is End.ESCAPES)
            return None
        self._sites = follower._sites
        return follower._curve.here.y[:-1]

    def _follow_from(self, z: Array, factor: float) -> None:
        problem = self._problem
        self._curve = Curve(problem.force, problem.force_rate, self._sites, z, factor, self._fineness)
        curve = self._curve
        curve.disagreement = lambda move: self._balance.disagreement(move, curve.unit)

    @override
    def _restore(self, state: PathState) -> None:
        position, sites = state.position, self._sites
        sites.put(position.numbers, state.memory)
        self._follow_from(position.small.copy(), state.factor)
        self._unstable, self._leg, self._last = state.unstable, position.leg, state
        self._balance = Balance(self._problem, sites, state.work, state.dissipated)
        self._balance.begin(self._curve.here.values, self._curve.factor)
        if state.event not in (Event.START, Event.TURN):
            self._curve.head(np.eye(1, self._problem.size + 1, position.driver)[0], position.heading)
            self._trend()
            self._curve.length = position.step

    # -- one leg of the programme

    @override
    def _towards(self, aim: float) -> Iterator[PathState]:
        self._orient(aim)
        self._rounds = Rounds(self._curve.here.values.x / self._factors, self._options.thresholds.exact.same_place)
        while self.end is None and self._curve.factor != aim:
            if self._adrift:
                yield from self._taken_up()
                continue
            if self._options.follow is Follow.STABLE and self._must_jump(aim):
                yield from self._jump(aim)
                continue
            move = self._curve.advance(self._next(aim))
            if move.outcome in (Outcome.AWAY, Outcome.STUCK):
                self._ended(move.outcome)
                yield self._state(Event.END)
                return
            self._balance.go(move, self._curve.unit)
            if move.outcome is not Outcome.FACTOR or self._curve.factor != aim:
                yield self._noted(move)
            self._watch()
            if self.end is not None:
                yield self._state(Event.END)

    def _must_jump(self, aim: float) -> bool:
        """Whether no stable way goes on towards a factor: a bond that turns back makes the path stable, and turn."""
        return self._unstable > 0 or (aim - self._curve.factor) * self._curve.trend < 0.0

    def _next(self, aim: float) -> float:
        """The next factor that the path may come to as it goes: one at which a state is wanted, or the aim."""
        factor, up = self._curve.factor, self._curve.factor_rate > 0.0
        ahead = [f for f in (*self._options.stops, aim) if f != factor and (f > factor) == up]
        return min(ahead, key=lambda f: abs(f - factor), default=aim)

    def _orient(self, aim: float) -> None:
        """Set out towards a factor; a path that is resumed on its way goes on as it went."""
        if self._is_under_way():
            return
        self._curve.set_out(1.0 if aim > self._curve.factor else -1.0)
        self._trend()
        if self._crossed():
            self._curve.settle_at_factor()
        self._trend()

    def _crossed(self, move: Move | None = None) -> list[Passage]:
        """The passages at the present point; where there is no end of them, the path is lost."""
        crossing = Crossing(self._curve, self._lag, self._watcher.check)
        try:
            return crossing.run(move)
        except (Refused, np.linalg.LinAlgError):
            where = f"at the factor {self._curve.factor:.6g} several bonds are at ends of their pieces"
            self._lose(self.factor, f"{where}, and each way on leads from one of them to the other")
            return crossing.passages

    def _trend(self) -> None:
        rate = self._curve.factor_rate
        self._curve.trend = int(np.sign(rate)) if rate else self._curve.trend

    def _noted(self, move: Move) -> PathState:
        """The state after a step, and what happens there."""
        if move.outcome is Outcome.FOLD:
            self._curve.trend = -self._curve.trend
            self._unstable = self._beyond(move)
            return self._state(Event.FOLD)
        if move.outcome in (Outcome.STEP, Outcome.FACTOR):
            self._unstable = self._sites.unstable_directions(self._curve.here.values)
            return self._state(Event.STEP)
        if self._is_adrift():  # all bonds are broken at once: nothing is left to pass
            return self._state(Event.KINK)
        before = self._curve.trend
        passages = self._crossed(move)
        self._curve.settle()
        self._trend()
        self._unstable = self._sites.unstable_directions(self._curve.here.values)
        state = self._state(event_of(passages, folds=before * self._curve.trend < 0), passages)
        if self._rounds.note(state) is Round.CLOSED:
            self._go_round(Round.CLOSED)
        elif self._rounds.standing > self._options.thresholds.exact.standing + 4 * len(self._sites):
            self._lose(self.factor, f"at the factor {self.factor:.6g} bonds and contacts pass for ever at one place")
        return state

    def _beyond(self, move: Move) -> int:
        """The number of unstable directions after a fold: vᵀH v = λ' f1ᵀv along the curve changes its sign there."""
        motion = displacement_rate(self._sites, move.before)
        held = self._curve.trend * float(self._problem.force_rate @ motion)
        return max(self._unstable + (1 if held < 0.0 else -1), 0)

    def _ended(self, outcome: Outcome) -> None:
        if outcome is Outcome.STUCK:
            self._lose(self.factor, f"at the factor {self.factor:.6g} no step is short enough to stay on the path")
        else:
            self._end_for_ever(stands=abs(self._curve.factor_rate) <= 1e-6)

    @override
    def _is_off(self) -> bool:
        curve, rate = self._curve, self._problem.force_rate
        driven = self._sites.unresisted(curve.here.values, rate).driven
        return curve.at_rest(1e-9 * self._peak) and bool(np.any(driven))

    def _jump(self, aim: float) -> Iterator[PathState]:
        """On to the next stable equilibrium at the same factor, or off."""
        factor, problem = self._curve.factor, self._problem
        self._watcher.jumps(factor)
        jump = Jump(
            problem=problem,
            sites=self._sites,
            here=self._curve.here,
            load=problem.load(factor),
            heading=1 if aim > factor else -1,
            lag=self._lag,
            held=self._is_held(factor),
            step=self._watcher.step,
        )
        landing = jump.landing()
        if landing is not None and landing.z is not None:
            yield self._landed(landing.z, factor, aim)
            return
        self._end_jump(escapes=landing is not None)
        assert self._last is not None
        yield replace(self._last, event=Event.END, place=None, released=0.0)

    @override
    def _settled(self, towards: float) -> PathState | Nowhere:
        z = self._at_no_load(self._curve.here.y[:-1], towards)
        return z if isinstance(z, Nowhere) else self._landed(z, 0.0, towards)

    def _landed(self, z: Array, factor: float, aim: float) -> PathState:
        self._follow_from(z, factor)
        released = self._balance.leap(self._curve.here.values, factor)
        self._unstable = 0
        self._orient(aim)
        return replace(self._state(Event.JUMP), released=released)

    # -- reports

    @override
    def _state(self, event: Event, passages: Sequence[Passage] = ()) -> PathState:
        curve, stored = self._curve, self._balance.stored
        self._last = PathState(
            factor=curve.factor,
            event=event,
            place=self._place(passages[0]) if passages else None,
            x=curve.here.values.x / self._factors,
            energy=stored.energy,
            work=self._balance.work,
            dissipated=stored.dissipated,
            unstable=self._unstable,
            memory=self._sites.memory,
            bifurcation=event is Event.FOLD and len(passages) > 1,
            position=self._position(),
        )
        return self._last

    def _position(self) -> Position:
        tangent = self._curve.here.tangent
        driver = int(np.argmax(np.abs(tangent)))
        return Position(
            leg=self._leg,
            numbers=self._sites.numbers.copy(),
            driver=driver,
            heading=1 if tangent[driver] > 0.0 else -1,
            small=self._curve.here.y[:-1].copy(),
            step=self._curve.length,
        )

    def _place(self, passage: Passage) -> Place:
        laws = self._sites.laws_at(passage.site)
        group = laws[0].group if laws and not (passage.closes or passage.opens) else None
        return place_of(self._problem, int(self._sites.unknowns_of(passage.site)[0]), group)
