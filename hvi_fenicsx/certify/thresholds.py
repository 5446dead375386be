"""The numbers that tune how a solution is judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """When a vertex is on a kink or a bound, and what is rounding.

    Attributes:
        near: distance (of u0) from a kink or a bound that counts as being on it.
        no_jump: jump of a traction, relative to the law's scale, that is rounding.
        largest_rounding: a certificate's entry above this is no rounding.
        rounding_safety: factor within which the sample of the rounding error is trusted.
        correction: relative residual of the step that takes the rounding of the matrix out.
        along: part of a rigid motion along a direction, per radian or unit length, that is rounding.
        nothing_acts: net forces along a rigid motion that are this small beside the sum of all forces are none.
        summation: rounding error of a sum of nodal forces, relative to the sum of their sizes.
        settled: what shared forces may leave of the wanted ones, relative to the largest, when they are settled.
        sweeps: over their carriers before Newton steps.
        newton_steps: on what is asked of their carriers, at most.
        least_slope: of the carriers together, which keeps a step finite at the boundary of what they can give.
        halvings: of a step that leaves more.
    """

    near: float = 1e-10
    no_jump: float = 1e-12
    largest_rounding: float = 1e-4
    rounding_safety: float = 4.0
    correction: float = 1e-6
    along: float = 1e-9
    nothing_acts: float = 1e-10
    summation: float = 1e-14
    settled: float = 1e-15
    sweeps: int = 20
    newton_steps: int = 60
    least_slope: float = 1e-14
    halvings: int = 12


@dataclass(frozen=True, kw_only=True)
class PlausibilityThresholds:
    """What a scene and its solution are warned of.

    Attributes:
        largest_strain: small strains are assumed everywhere.
        softest: smallest plausible Young's modulus, N/m²: softer than a gel.
        stiffest: largest plausible Young's modulus, N/m²: stiffer than diamond.
        far_peak: a factor of the load that is borne is suspicious above it, and below its inverse.
        weak_law: a law's largest force over the load, below which it cannot matter.
        unrelated: ratio of two lengths that have nothing to do with each other.
        smoothing_change: change of a traction by smoothing, over the law's peak, that is large.
        smoothing_share: share of a part on which smoothing may change the traction so much.
        nearly_all: share of a part that counts as all of it: a vertex on a support does not slip.
        rounding: displacement or work of a rigid motion, nondimensional, up to which it is none.
        flat: angle (rad) between the normals of a part, up to which the part is flat.
        uneven: angle up to which it may be meant to be flat.
        straight: angle (rad) between facets at a vertex, up to which they are one plane, with its rounding.
        corner: angle from which on it is a corner of the body.
        mostly_bent: share of the vertices with an angle between the two from which on a part is a curve's polygon.
        dip: penetration between nodes over the largest displacement that matters.
    """

    largest_strain: float = 0.1
    softest: float = 1e3
    stiffest: float = 2e12
    far_peak: float = 1e4
    weak_law: float = 0.01
    unrelated: float = 100.0
    smoothing_change: float = 0.1
    smoothing_share: float = 0.25
    nearly_all: float = 0.9
    rounding: float = 1e-10
    flat: float = 1e-8
    uneven: float = 0.02
    straight: float = 1e-3
    corner: float = 0.6
    mostly_bent: float = 0.5
    dip: float = 1e-2


@dataclass(frozen=True, kw_only=True)
class UniquenessThresholds:
    """How far it is tried to prove that there is no other equilibrium.

    Attributes:
        most_on_boundary: unknowns of Γc up to which the body's stiffness is compared with laws that fall.
        most_unknowns: unknowns in all up to which it is, by dimension: that takes about 0.1 s (docs/equilibria.md).
        enlarged: the falls are enlarged by this share, against the rounding of the comparison.
        rounding: squared share of a rigid motion, or displacement by one, that is none.
    """

    most_on_boundary: int = 300
    most_unknowns: Mapping[int, int] = field(default_factory=lambda: {2: 20_000, 3: 5_000})
    enlarged: float = 1e-6
    rounding: float = 1e-10


DEFAULT = Thresholds()
PLAUSIBILITY = PlausibilityThresholds()
UNIQUENESS = UniquenessThresholds()
