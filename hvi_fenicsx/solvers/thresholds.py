"""The numbers that tune the solution methods."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..system.thresholds import Thresholds as LinearThresholds


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When nested iteration pays, how exact intermediate steps are, and when a method gives up.

    Attributes:
        linear: of the linear solvers.
        nested_from: unknowns from which a coarser level pays.
        coarse_tolerance: of the solution on a coarser level.
        start_tolerance: of a start's linear solve: what its active set needs; laws that do not rest make it no better.
        loose_tolerance: of convex steps while the pieces of the laws still change.
        convex_steps: of the branch iteration at most.
        cell_changes: times that vertices may change their cell between convex kinks in one convex step.
        kink_distance: distance (of u0) from a kink that counts as being on it.
        search_steps: Newton steps of all starts together, unless the body is held; hard cases took at most 589.
        still: fraction of the residual; two steps that change it by less show a line search that stalls.
        rounding_below: residual below which twice as many steps without halving it mean that rounding allows no more.
        largest_rounding: a residual above this is no rounding.
        rounding_safety: the sample of the rounding error is trusted within this factor.
        moving_accuracy: relative tolerance of a step's linear solve while the active set moves.
        forcing: relative tolerance of a linear solve as a part of what is left.
        finest_accuracy: the least relative tolerance of a linear solve.
        straight: part of the tolerance that one step shall reach: nodal tractions fall by a quarter as much as the
            norm where ranks meet on Γc.
        runaway: a displacement of so many times p0 L / E0 is a body that slides away.
    """

    linear: LinearThresholds = field(default_factory=LinearThresholds)
    nested_from: int = 5_000
    coarse_tolerance: float = 1e-4
    start_tolerance: float = 1e-2
    loose_tolerance: float = 1e-4
    convex_steps: int = 200
    cell_changes: int = 200
    kink_distance: float = 1e-11
    search_steps: int = 1_000
    still: float = 1e-3
    rounding_below: float = 1e-7
    largest_rounding: float = 1e-4
    rounding_safety: float = 4.0
    moving_accuracy: float = 1e-2
    forcing: float = 0.5
    finest_accuracy: float = 1e-4
    straight: float = 0.125
    runaway: float = 1e8


DEFAULT = Thresholds()
