"""The numbers that tune how paths of equilibria are followed."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class ExactThresholds:
    """How paths are followed from event to event.

    Attributes:
        slow: a variable that moves by so little of the fastest one fixes no point of the curve.
        kept: what an inverse that is kept may leave of a column; one step of refinement takes this out.
        weak: a pivot that is so small beside its column costs digits.
        at_end: a displacement so near to an end of a piece, relative, is at it.
        branching: all combinations of so many unknowns at most are tried.
        near_end: a coordinate so near to an end of its segment is at it, relative to the sizes of coordinates.
        balanced: forces that balance may leave so much of the largest one.
        same_place: a difference of displacements that does not count, relative.
        still: a variable that moves by so little of the fastest one of its kind stands, but for rounding.
        neutral: the same where a body moves under one load: then the factor stands, and rounding is larger.
        standing: so many events at one place, and four for each unknown, lead nowhere.
        softest: relative accuracy of the direction in which a cell is softest.
    """

    slow: float = 1e-6
    kept: float = 1e-6
    weak: float = 1e-3
    at_end: float = 1e-12
    branching: int = 10
    near_end: float = 1e-9
    balanced: float = 1e-9
    same_place: float = 1e-7
    still: float = 1e-11
    neutral: float = 1e-10
    standing: int = 20
    softest: float = 1e-8


@dataclass(frozen=True, kw_only=True)
class CurveThresholds:
    """How curves are followed by predictor and corrector.

    Attributes:
        rounding: a coordinate this near to the end of its segment is there; a factor whose rate is this small stands.
        left: what Newton's method leaves of a coordinate.
        standing: a point whose rate is this small beside the largest stands.
        undecided: a rate this small beside the largest may have the wrong sign where the curve bends: the step tells
            where it goes.
        directions: corrections of the directions in which vertices at rest set out, at most.
        slow: factors of a point nearby serve where a correction is at most this part of the last one.
        digits: forces that the last digits of coordinates make, in their units and beside the largest coordinate.
        part: where no more is left, corrections that no longer fall are rounding if they are this part of the step at
            most.
        corrections: of a point, at most.
        refinements: of a tangent by factors of a point nearby, at most.
        shortest: the shortest step.
        least_turn: least cosine of the angle between the tangents at both ends of a step.
        far: a displacement that is infinite, in units of those where the body was.
        across: a row that hardly changes along the direction, beside its size, costs digits: it wants factors of its
            own.
        exchanges: so many cost as much as new factors, and digits.
        slow_force: a rate of a point's force at which it stands, but for rounding, beside the largest.
        at_end: a displacement so near to an end of a piece, relative, is at it.
        rounds: times that the passages at one point come to the same cell: a straight line does so once, else they go
            round. A point that turns back has another graph from then on, so that the cells are others.
        inset: a curved law itself is taken so far inside the ends of its pieces, beside their length.
        reach: a step changes the argument of a curved law by this part of its length scale and of the argument at most.
        no_length: a length that is 0, but for rounding, in units of s.
        agreed: by how much the work along a step may miss what the energies say, relative to the energies.
        unresisted: a slope of a law's force that is none, beside the greatest stiffness.
        rank: singular values so small beside the greatest are zero: a body that slides takes any place.
        near_break: a displacement this near to a break of a law, or to a bound, may be there, relative to itself and to
            lengths.
    """

    rounding: float = 1e-10
    left: float = 1e-14
    standing: float = 1e-11
    undecided: float = 1e-7
    directions: int = 40
    slow: float = 1e-2
    digits: float = 1e-15
    part: float = 1e-6
    corrections: int = 12
    refinements: int = 6
    shortest: float = 1e-11
    least_turn: float = 0.9
    far: float = 1e4
    across: float = 1e-3
    exchanges: int = 40
    slow_force: float = 1e-6
    at_end: float = 1e-11
    rounds: int = 3
    inset: float = 1e-12
    reach: float = 0.25
    no_length: float = 1e-12
    agreed: float = 3e-10
    unresisted: float = 1e-8
    rank: float = 1e-12
    near_break: float = 1e-10


@dataclass(frozen=True, kw_only=True)
class JumpThresholds:
    """How a body goes from a state that is not stable to a stable one, where laws are curved.

    Attributes:
        beyond: a step along the path, in units of s.
        push: how much larger the loads are that take a body off a state at which it would rest.
        same: motions that differ by no more lead the same way.
        steps: of the curve of one restraint at most, at first.
        later_steps: so many more for each point where nothing else leads to an end: it may zigzag where bonds break one
            by one.
        far: a displacement that is infinite, in units of s where the motion began.
        times: steps in time at most,
        more_times: and so many more for each point: each drop that is smoothed sharply takes some tens.
        empty: so many jumps in a row that release nothing are no way on.
        shortest: a step in time ends where the curve takes no longer step than that: what holds back is too little from
            there on.
    """

    beyond: float = 1e-2
    push: float = 1e-6
    same: float = 1e-3
    steps: int = 40
    later_steps: int = 20
    far: float = 1e4
    times: int = 500
    more_times: int = 200
    empty: int = 8
    shortest: float = 1e-3


@dataclass(frozen=True, kw_only=True)
class SettlingThresholds:
    """How a state is found that bears the next load, where the load is none and nothing holds the body.

    Attributes:
        first_load: part of the next load at which this state is looked for; from there the load is taken off again.
        no_load: a part of this small load that is none,
        roundings: and so many roundings of the elastic forces: all contacts end at no load, and rounding says which one
            is first.
        steps: from a small load back to none at most, where laws are curved,
        more_steps: and so many more for each point.
    """

    first_load: float = 1e-3
    no_load: float = 1e-9
    roundings: float = 100.0
    steps: int = 50
    more_steps: int = 20


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How paths are followed.

    Attributes:
        exact: from event to event.
        curve: by predictor and corrector.
        jump: in jumps of these.
        settling: from no load on, where nothing holds the body.
        at_limit: a factor so near to the largest that can be borne, relative to those of the programme, is at the
            limit.
    """

    exact: ExactThresholds = field(default_factory=ExactThresholds)
    curve: CurveThresholds = field(default_factory=CurveThresholds)
    jump: JumpThresholds = field(default_factory=JumpThresholds)
    settling: SettlingThresholds = field(default_factory=SettlingThresholds)
    at_limit: float = 1e-6


DEFAULT = Thresholds()
