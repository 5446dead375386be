"""The numbers that tune how systems are assembled and solved."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How exact steps are, when a solve gives up, how large a problem a way of solving is for, and what is rounding.

    Distances are in units of u0, stiffnesses per area in E0/L. Pairs are of the plane and of space.

    Attributes:
        near: distance from a bound or a kink that counts as being on it.
        rounding: of the components of a unit vector, of a matrix that is condensed, of equations solved by a Krylov
            method.
        rounding_safety: the sample of the rounding error is trusted within this factor.
        energy_rounding: change of an energy, or of a merit function or step of ``condensed``, relative to it, that is
            rounding.
        loose: relative tolerance of a linear solve whose solution is to tell an active set.
        margin: part of what is still allowed that one of several steps, or of several errors, may take.
        coarse_tolerance: tolerance of what is a start only: on a coarser level, while the pieces of the laws still
            change, of a step's linear solve; a residual larger than this is no rounding, a slip smaller is a start of
            one.
        few_steps: Newton steps of a start that finds an equilibrium at once or hardly ever; and steps in a row that do
            not halve a residual, after which a solve ends.
        search_steps: Newton steps of all starts together, unless the body is held; hard cases took at most 589.
        most_changes: convex steps at most, and changes of the cells between kinks in one of them.
        runaway: a displacement of so many times p0 L / E0 is a body that slides away; a slip of so many times that at
            rest is beyond every kink.
        narrowest: the last width of a continuation to the law itself.
        vertex_unknowns: unknowns of Γc's vertices up to which a load path is followed for a start.
        curve_unknowns: the same where the path is a curve, without jumps; where it goes on through jumps a half.
        largest_dense: unknowns of Γc's vertices up to which the stiffness is formed for a load path of its own, where
            solves with factors take longer.
        solve_overhead: entries of a dense matrix that a product reads while a sparse solve begins.
        nested_from: unknowns from which a coarser level pays.
        largest_direct: unknowns up to which a direct solve is the faster one (docs/benchmarks.md).
        volumetric_ratio: λ/μ where dilatation is averaged, up to which displacements alone are the unknowns of
            geometric multigrid; 50 is that of ν = 0.4902 (docs/degree-2.md).
        mixed_accuracy: relative residual that a solve for displacements and pressures leaves; and factor of that, over
            λ/μ, to which its own equations are solved.
        drift: change of a law's nodal stiffness, relative to an elastic one (about 1), or part of the held unknowns
            that changes, up to which a Krylov method keeps its preconditioner.
        slow: iterations from which a direct solver takes over where it can: at 65 a Newton step costs twice as much as
            with it. Twice as many, in vain, are given up there.
        krylov_iterations: iterations of a Krylov method at most.
        columns: dense columns beside factors: right-hand sides that are solved at once where a body is condensed, and
            columns exchanged in factorised equations of a load path before these are factorised anew.
        level_growth: factor by which unknowns grow from one level of a multigrid to the next, at least.
        held_weight: weight in the prolongation from which a coarse unknown is held with the fine one: of the unknowns
            that move a vertex, one in space has 1/4 or more; and what may be missing of all weights of a displacement.
        held_stiffness: diagonal of a held unknown, in units of an elastic stiffness (about 1): what the unknown moves
            is less than rounding.
        foundation: stiffness that keeps a matrix regular where laws have none.
        first_ramp: slip up to which the traction of a law of |u_t| grows from zero at first, relative to the largest
            slip: a free vertex may turn its direction there.
    """

    near: float = 1e-11
    rounding: float = 1e-12
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
    largest_dense: int = 5_000
    solve_overhead: float = 250_000.0
    nested_from: int = 5_000
    largest_direct: tuple[int, int] = (60_000, 15_000)
    volumetric_ratio: float = 50.0
    mixed_accuracy: float = 0.02
    drift: float = 0.2
    slow: int = 50
    krylov_iterations: int = 2_000
    columns: int = 64
    level_growth: float = 3.0
    held_weight: float = 0.2
    held_stiffness: float = 1e20
    foundation: float = 1e-8
    first_ramp: float = 1e-2

    def is_direct(self, unknowns: int, dimension: int) -> bool:
        """Whether a direct solve is the faster one.

        Args:
            unknowns: of the system.
            dimension: 2 or 3.
        """
        return unknowns <= self.largest_direct[dimension - 2]


DEFAULT = Thresholds()
