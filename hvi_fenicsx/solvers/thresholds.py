"""The numbers that tune the solution methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..paths.thresholds import Thresholds as FollowingThresholds
from ..system.thresholds import Thresholds as LinearThresholds

FULL_STEPS = "basic"
"""PETSc's name of the line search that shortens no step."""
EXACT = "exact"
"""The line search of :mod:`.projected_newton`, beside PETSc's."""
BRANCH_ATTEMPTS = (
    (False, FULL_STEPS, 30),
    (False, EXACT, 60),
    (False, "bt", 60),
    (True, "bt", 40),
    (False, FULL_STEPS, 30),
    (True, "bt", 200),
    (False, "bt", 60),
    (False, FULL_STEPS, 30),
)
"""See :attr:`BranchThresholds.attempts`; the order was found on the hard cases (docs/hard-cases.md)."""
PROGRAMME_ATTEMPTS = ((FULL_STEPS, 30), (FULL_STEPS, 30), (EXACT, 60), ("bt", 60), (FULL_STEPS, 60), ("bt", 200))
"""See :attr:`Thresholds.programme_attempts`."""


@dataclass(frozen=True, kw_only=True)
class ActiveSetThresholds:
    """How exact the steps of the active set solver are, and when it gives up.

    Attributes:
        on_bound: distance (of u0) from a bound that counts as being on it.
        still: fraction of the residual; a step that changes it by less shows a line search that stalls.
        stalled_steps: such steps in a row after which a solve ends.
        useful_fall: fraction of the least residual so far; a step that does not fall below it is of no use.
        useless_steps: such steps in a row after which a solve with full steps ends; of 67 solves of hard cases that
            converged after more than five steps, two had more.
        rounding_below: residual below which twice as many steps without halving it mean that rounding allows no more.
        largest_rounding: a residual larger than this is no rounding.
        rounding_safety: the sample of the rounding error is trusted within this factor.
        along: part of a rigid motion along a direction, per radian or unit length, that is rounding.
        nothing_acts: net forces along a rigid motion that are this small beside the sum of all forces are none.
        moving_accuracy: relative tolerance of a step's linear solve while the active set changes.
        forcing: relative tolerance of a linear solve, as a part of the reduction that is still needed.
        finest_accuracy: the least relative tolerance of a linear solve, unless the active set is expected to stay.
        runaway: a displacement of so many times p0 L / E0 is a body that slides away.
    """

    on_bound: float = 1e-12
    still: float = 1e-3
    stalled_steps: int = 2
    useful_fall: float = 0.9
    useless_steps: int = 10
    rounding_below: float = 1e-7
    largest_rounding: float = 1e-4
    rounding_safety: float = 4.0
    along: float = 1e-9
    nothing_acts: float = 1e-10
    moving_accuracy: float = 1e-2
    forcing: float = 0.5
    finest_accuracy: float = 1e-4
    runaway: float = 1e8


@dataclass(frozen=True, kw_only=True)
class ProjectedNewtonThresholds:
    """How the projected Newton method steps.

    Attributes:
        foundation: stiffness per area, in units of E0/L, that keeps the matrix regular where laws have none.
        linear_tolerance: relative tolerance of a step's linear solve.
        flat: slope, relative to that at the start of a step, at which a line search ends.
        doublings: of a step along which the slope does not change its sign, at most.
        searches: slopes that are looked at between two lengths, at most.
        least_share: of the interval that is known to hold the minimum, by which it shrinks at least.
        stalled_steps: steps without halving the residual after which a solve ends.
    """

    foundation: float = 1e-8
    linear_tolerance: float = 1e-4
    flat: float = 1e-2
    doublings: int = 40
    searches: int = 60
    stalled_steps: int = 20
    least_share: float = 1e-2


@dataclass(frozen=True, kw_only=True)
class BranchThresholds:
    """How convex steps of the branch iteration are solved, and when it gives up.

    Attributes:
        attempts: ways to solve a convex step, until one converges: whether with secant stiffness, line search, Newton
            steps at most.
        foundation: stiffness per area, in units of E0/L, that attempts with secant stiffness add to the laws': where
            these have none, as in a dead zone, the matrix would be singular.
        loose_tolerance: of convex steps while the pieces of the laws still change.
        convex_steps: convex steps at most.
        cell_changes: times that vertices may change their cell between convex kinks in one convex step.
        kink_distance: distance (of u0) from a kink that counts as being on it.
        kink_jump: change of a traction within that distance, relative to the law's scale, that is no kink.
        kink_slack: part of the tolerance of a traction by which the force on a kink may exceed what the kink carries.
        energy_rounding: change of an energy, relative to it, that is rounding.
        newton_steps: Newton steps with the true curvature, at most.
        first_ramp: slip up to which the traction of a law of |u_t| grows from zero at first, relative to the largest
            slip: a free vertex may turn its direction there.
        least_slip: the largest slip is taken to be this (of u0) at least.
        ramp_shrinks: factor of that slip when a stuck vertex becomes free.
        broken_slip: slip beyond every kink, relative to the slip at rest.
        rest_tolerance: relative tolerance of the linear solve that puts bodies on their supports.
        search_steps: Newton steps of all starts together, unless the body is held; hard cases took at most 589.
        widths: relative widths of the smoothing that a continuation goes through, if wider than the wanted one.
        widest: the first width at which Newton's method looks for equilibria that are no minimum: laws that push are
            nearly straight there.
        narrowing: factor from each such width to the next.
        narrowest: the last of them.
    """

    attempts: Sequence[tuple[bool, str, int]] = BRANCH_ATTEMPTS
    foundation: float = 1e-6
    loose_tolerance: float = 1e-4
    convex_steps: int = 200
    cell_changes: int = 200
    kink_distance: float = 1e-11
    kink_jump: float = 1e-6
    kink_slack: float = 0.1
    energy_rounding: float = 1e-10
    newton_steps: int = 15
    first_ramp: float = 1e-2
    least_slip: float = 1e-6
    ramp_shrinks: float = 0.3
    broken_slip: float = 1e6
    rest_tolerance: float = 1e-4
    search_steps: int = 1_000
    widths: Sequence[float] = (1.0, 1e-1, 1e-2, 1e-3)
    widest: float = 100.0
    narrowing: float = 0.7
    narrowest: float = 1e-3


@dataclass(frozen=True, kw_only=True)
class PathThresholds:
    """When a load path is followed to find a start, and when with the condensed stiffness as an array.

    Attributes:
        quick_steps: Newton steps of the first start before a path is followed, where laws soften.
        curved_steps: the same where tractions are curved, as their paths take longer.
        other_steps: Newton steps of each further start where a path ends before the whole load.
        vertex_unknowns: unknowns of Γc's vertices up to which the system is condensed.
        curved_unknowns: condensed unknowns up to which a path that is not straight between events is followed.
        whole_curve_unknowns: those up to which the curve of all equilibria is followed for a start, without jumps.
        most_events: of one path.
        largest_dense: unknowns of Γc's vertices up to which the stiffness is formed for a load path of its own, where
            solves with factors take longer.
        following: how paths are followed.
    """

    quick_steps: int = 8
    curved_steps: int = 100
    other_steps: int = 15
    vertex_unknowns: int = 1_600
    curved_unknowns: int = 200
    whole_curve_unknowns: int = 400
    most_events: int = 20_000
    largest_dense: int = 5_000
    following: FollowingThresholds = field(default_factory=FollowingThresholds)


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When nested iteration pays, and how the methods solve.

    Attributes:
        linear: of the linear solvers.
        active_set: of the active set solver.
        projected_newton: of the projected Newton method.
        branch: of the branch iteration.
        path: of the start from the load path.
        nested_from: unknowns from which a coarser level pays.
        inertia_plane: unknowns in the plane up to which a factorisation of the Hessian takes little of a run.
        inertia_space: the same in space.
        coarse_tolerance: tolerance of the solution on a coarser level.
        start_tolerance: relative tolerance of a start's linear solve: enough for its active set; an exact solution
            of the laws at rest would be no better start.
        linear_margin: part of the tolerance that a linear solve is given, since Krylov's recursive residual differs
            from the true one.
        linear_solves: linear solves of an equation at most; further ones only where rounding, or the traction of a
            spring, is coarser than the norm.
        programme_attempts: ways to solve a convex quadratic programme, until one converges: PETSc's line search,
            Newton steps at most.
        touching: distance (of u0, or relative to a kink further away) from a convex kink within which a rigid position
            is on it.
        evaluations: evaluations of the functions in ``condensed`` at most: the paper's limit of lsqnonlin's iterations.
        least_decrease: relative decrease of the merit function at which ``condensed`` stops.
        least_step: relative step at which ``condensed`` stops.
    """

    linear: LinearThresholds = field(default_factory=LinearThresholds)
    active_set: ActiveSetThresholds = field(default_factory=ActiveSetThresholds)
    projected_newton: ProjectedNewtonThresholds = field(default_factory=ProjectedNewtonThresholds)
    branch: BranchThresholds = field(default_factory=BranchThresholds)
    path: PathThresholds = field(default_factory=PathThresholds)
    nested_from: int = 5_000
    inertia_plane: int = 50_000
    inertia_space: int = 5_000
    coarse_tolerance: float = 1e-4
    start_tolerance: float = 1e-2
    linear_margin: float = 0.5
    linear_solves: int = 3
    programme_attempts: Sequence[tuple[str, int]] = PROGRAMME_ATTEMPTS
    touching: float = 1e-7
    evaluations: int = 100
    least_decrease: float = 1e-10
    least_step: float = 1e-14


DEFAULT = Thresholds()
