"""The numbers that tune how paths of equilibria are followed."""

from __future__ import annotations

from dataclasses import dataclass

ROUNDING = 1e-12
"""Relative, a difference of numbers that is their rounding."""


@dataclass(frozen=True, kw_only=True)
class FollowingThresholds:
    """How paths are followed. Parts are of the largest of their kind: displacements, forces, rates, factors.

    Attributes:
        standing: a rate this small is none; where the curve bends a step, or a way to an end, likewise.
        reached: a coordinate this near to an end on a curve, or a displacement to a break of a law, may be there; where
            the factor stands while a body moves, rates are rounding up to this.
        none: a load, force or stiffness this small is none.
        undecided: a rate this small may have either sign where the curve bends; a difference of places that is none.
        slow: a variable that moves by so little fixes no point of the curve; digits that an inverse or a step may cost;
            by so much loads are larger that push a body off; a factor this near to the largest that is borne is it.
        small: a pivot or row this small costs digits; the part of a load that takes a body to where something holds it;
            the shortest step in a motion in time.
        near: factors of a point nearby serve while corrections fall by this.
        digits: the last digits of coordinates, and what they make of forces.
        least_turn: least cosine of the angle between the tangents at both ends of a step.
        reach: a step changes the argument of a curved law by this part of its length scale and of the argument at most.
        far: a displacement that is infinite, in units of those where the body was.
        waits: events at one place, jumps in a row or steps for each point that lead nowhere; exchanges of columns
            beside factors. Steps in time for each point are its square at most.
        corrections: of a point or a direction, and passages at one point of a curve to the same statuses, at most.
    """

    standing: float = 1e-11
    reached: float = 1e-10
    none: float = 1e-9
    undecided: float = 1e-7
    slow: float = 1e-6
    small: float = 1e-3
    near: float = 1e-2
    digits: float = 2e-14
    least_turn: float = 0.9
    reach: float = 0.25
    far: float = 1e4
    waits: int = 20
    corrections: int = 12


DEFAULT = FollowingThresholds()
