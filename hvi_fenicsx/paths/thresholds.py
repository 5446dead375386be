"""The numbers that tune how paths of equilibria are followed."""

from __future__ import annotations

from dataclasses import dataclass

ROUNDING = 1e-12
"""Relative, a difference of numbers that is their rounding."""


@dataclass(frozen=True, kw_only=True)
class FollowingThresholds:
    """How paths are followed. Parts are of the largest of their kind: displacements, forces, rates, factors.

    Attributes:
        rounding: a coordinate this near to an end of its segment is it; a length or singular value this small is 0.
        standing: a rate this small is none; where the curve bends a step, or a way to an end, likewise.
        reached: a coordinate this near to an end on a curve, or a displacement to a break of a law, may be there; where
            the factor stands while a body moves, rates are rounding up to this.
        none: a load or force this small is none; where several ways lead on, coordinates this near to ends are there.
        flat: a stiffness this small is none; accuracy of the direction in which a state is softest.
        undecided: a rate this small may have either sign where the curve bends; a difference of places that is none.
        slow: a variable that moves by so little fixes no point of the curve; digits that an inverse or a step may cost;
            by so much loads are larger that push a body off; a factor this near to the largest that is borne is it.
        small: a pivot or row this small costs digits; motions that differ by no more are one; the part of a load that
            takes a body to where something holds it; the shortest step in a motion in time.
        near: factors of a point nearby serve while corrections fall by this; a step beyond a state along the path.
        left: what Newton's method leaves of a coordinate.
        digits: forces that the last digits of coordinates make, in their units and beside the largest coordinate.
        agreed: by how much the work along a step may miss what the energies say.
        least_turn: least cosine of the angle between the tangents at both ends of a step.
        reach: a step changes the argument of a curved law by this part of its length scale and of the argument at most.
        far: a displacement that is infinite, in units of those where the body was.
        branching: all combinations of so many unknowns at most are tried.
        waits: events at one place that lead nowhere, and steps of one restraint or back to no load for each point.
        many: corrections of a direction, exchanges of columns beside factors, steps of a first restraint.
        corrections: of a point, at most.
        refinements: of a tangent by factors of a point nearby, at most.
        rounds: times that the passages at one point of a curve come to the same statuses: else they go round.
        times: steps in time for each point at most: each drop that is smoothed sharply takes some tens.
        empty: so many jumps in a row that release nothing are no way on.
        roundings: so many roundings of the elastic forces are no load.
    """

    rounding: float = ROUNDING
    standing: float = 1e-11
    reached: float = 1e-10
    none: float = 1e-9
    flat: float = 1e-8
    undecided: float = 1e-7
    slow: float = 1e-6
    small: float = 1e-3
    near: float = 1e-2
    left: float = 1e-14
    digits: float = 1e-15
    agreed: float = 3e-10
    least_turn: float = 0.9
    reach: float = 0.25
    far: float = 1e4
    branching: int = 10
    waits: int = 20
    many: int = 40
    corrections: int = 12
    refinements: int = 6
    rounds: int = 3
    times: int = 200
    empty: int = 8
    roundings: float = 100.0


DEFAULT = FollowingThresholds()
