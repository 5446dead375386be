"""The numbers that tune how systems are assembled and linear systems solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When which linear solver is used, when it is set up anew, and what counts as infinite or as rounding.

    Attributes:
        largest_direct: unknowns up to which a direct solve is the faster one, by dimension (docs/benchmarks.md).
        volumetric_ratio: λ/μ where dilatation is averaged, up to which displacements alone are the unknowns of
            geometric multigrid; 50 is that of ν = 0.4902 (docs/degree-2.md).
        largest_rubber: unknowns of degree 1 up to which a start is solved directly above that ratio, by dimension;
            where there are more the start is that of a body of the ratio.
        mixed_accuracy: relative residual that a solve for displacements and pressures leaves.
        mixed_margin: factor of that residual, over λ/μ, to which the equations of displacements and pressures are
            solved.
        least_mixed_accuracy: relative residual of its own equations that rounding allows.
        drift: change of a law's nodal stiffness, relative to an elastic one (about 1), or part of the held unknowns
            that changes, up to which a Krylov method keeps its preconditioner.
        slow: iterations from which a direct solver takes over where it can: at 65 a Newton step costs twice as much as
            with it; and times that algebraic multigrid is made: most of its cost is then in its setup (on cells 1000
            times as long as high, ten times that of a factorisation).
        slower: factor of the first iterations from which a preconditioner is made anew.
        krylov_iterations: iterations of a Krylov method at most.
        replaced_iterations: the same where a direct solver can take over: 2,000 in vain took far longer than that.
        dense_columns: right-hand sides that are solved at once where a body is condensed.
        rank_unknowns: unknowns of a rank, on average, from which a coarse level is on all ranks (docs/scaling.md).
        exchanges: columns that are exchanged in factorised equations of a load path before these are factorised anew.
        solve_overhead: entries of a dense matrix that a product reads while a sparse solve begins.
        level_growth: factor by which unknowns grow from one level of a multigrid to the next, at least.
        held_weight: weight in the prolongation from which a coarse unknown is held with the fine one: of the unknowns
            that move a vertex, one in space has 1/4 or more; and what may be missing of all weights of a displacement.
        held_stiffness: diagonal of a held unknown, in units of an elastic stiffness (about 1): what the unknown moves
            is less than rounding.
        foundation: stiffness that keeps a matrix regular where laws have none.
        first_ramp: slip up to which the traction of a law of |u_t| grows from zero at first, relative to the largest
            slip: a free vertex may turn its direction there.
        least_slip: the largest slip is taken to be this at least.
        rounding: of the local components of a unit vector.
    """

    largest_direct: Mapping[int, int] = field(default_factory=lambda: {2: 60_000, 3: 15_000})
    volumetric_ratio: float = 50.0
    largest_rubber: Mapping[int, int] = field(default_factory=lambda: {2: 500_000, 3: 15_000})
    mixed_accuracy: float = 1e-2
    mixed_margin: float = 0.05
    least_mixed_accuracy: float = 1e-13
    drift: float = 0.2
    slow: int = 50
    slower: float = 1.5
    krylov_iterations: int = 2_000
    replaced_iterations: int = 100
    dense_columns: int = 64
    rank_unknowns: int = 500
    exchanges: int = 60
    solve_overhead: float = 250_000.0
    level_growth: float = 3.0
    held_weight: float = 0.2
    held_stiffness: float = 1e20
    foundation: float = 1e-8
    first_ramp: float = 1e-2
    least_slip: float = 1e-6
    rounding: float = 1e-12


DEFAULT = Thresholds()
