"""The numbers that tune the solution methods."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..paths.thresholds import FollowingThresholds
from ..system.thresholds import Thresholds as LinearThresholds


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How exact steps are, when a solve gives up, and how large a problem a way of solving is for.

    Distances are in units of u0, stiffnesses per area in E0/L.

    Attributes:
        linear: of the linear solvers.
        following: how paths are followed.
        near: distance from a bound or a kink that counts as being on it.
        rounding_safety: the sample of the rounding error is trusted within this factor.
        energy_rounding: change of an energy, or of a merit function or step of ``condensed``, relative to it, that is
            rounding.
        loose: relative tolerance of a linear solve whose solution is to tell an active set.
        margin: part of what is still allowed that one of several steps, or of several errors, may take.
        coarse_tolerance: tolerance of what is a start only: on a coarser level, while the pieces of the laws still
            change, of a step's linear solve; a residual larger than this is no rounding.
        few_steps: Newton steps of a start that finds an equilibrium at once or hardly ever; and steps in a row that do
            not halve a residual, after which a solve ends.
        search_steps: Newton steps of all starts together, unless the body is held; hard cases took at most 589.
        most_changes: convex steps at most, and changes of the cells between kinks in one of them.
        runaway: a displacement of so many times p0 L / E0 is a body that slides away; a slip of so many times that at
            rest is beyond every kink.
        narrowest: the last width of a continuation to the law itself.
        vertex_unknowns: unknowns of Γc's vertices up to which a load path is followed for a start.
        curve_unknowns: the same where the path is a curve, without jumps; where it goes on through jumps a half.
        most_events: of such a path.
        largest_dense: unknowns of Γc's vertices up to which the stiffness is formed for a load path of its own, where
            solves with factors take longer.
        nested_from: unknowns from which a coarser level pays.
    """

    linear: LinearThresholds = field(default_factory=LinearThresholds)
    following: FollowingThresholds = field(default_factory=FollowingThresholds)
    near: float = 1e-11
    rounding_safety: float = 4.0
    energy_rounding: float = 1e-10
    loose: float = 1e-2
    margin: float = 0.5
    coarse_tolerance: float = 1e-4
    few_steps: int = 8
    search_steps: int = 1_000
    most_changes: int = 200
    runaway: float = 1e8
    narrowest: float = 1e-3
    vertex_unknowns: int = 1_600
    curve_unknowns: int = 400
    most_events: int = 20_000
    largest_dense: int = 5_000
    nested_from: int = 5_000


DEFAULT = Thresholds()
