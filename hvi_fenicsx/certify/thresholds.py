"""The numbers that tune how a solution is judged."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CertificateThresholds:
    """When a vertex is on a kink or a bound, and what is rounding.

    Attributes:
        near: distance (of u0) from a kink or a bound that counts as being on it, and a jump of a traction,
            relative to the law's scale, that is none.
        largest_rounding: a certificate's entry above this is no rounding.
        rounding_safety: factor within which the sample of the rounding error is trusted.
        shared_steps: Newton steps on what is asked of the carriers of a shared force, at most.
    """

    near: float = 1e-10
    largest_rounding: float = 1e-4
    rounding_safety: float = 4.0
    shared_steps: int = 60


@dataclass(frozen=True, kw_only=True)
class PlausibilityThresholds:
    """What a scene and its solution are warned of.

    Attributes:
        large: a strain, where small ones are assumed; a change of a traction by smoothing, over the law's peak; a share
            of a part on which smoothing changes it so much, or which is more than vertices on supports.
        softest: smallest plausible Young's modulus, N/m²: softer than a gel.
        stiffest: largest plausible Young's modulus, N/m²: stiffer than diamond.
        negligible: a law's largest force over the load, or a penetration between nodes over the largest displacement,
            up to which it cannot matter; its inverse is the ratio of two lengths that have nothing to do with each
            other, and the square of that a factor of the load that is suspicious.
        straight: angle (rad) between facets at a vertex, up to which they are one plane, with its rounding.
        corner: angle from which on it is a corner of the body.
        mostly_bent: share of the vertices with an angle between the two from which on a part is a curve's polygon.
    """

    large: float = 0.1
    softest: float = 1e3
    stiffest: float = 2e12
    negligible: float = 0.01
    straight: float = 1e-3
    corner: float = 0.6
    mostly_bent: float = 0.5


@dataclass(frozen=True, kw_only=True)
class UniquenessThresholds:
    """How far it is tried to prove that there is no other equilibrium.

    Attributes:
        most_on_boundary: unknowns of Γc up to which the body's stiffness is compared with laws that fall.
        most_unknowns: unknowns in all up to which it is, in the plane and in space: that takes about 0.1 s
            (docs/equilibria.md).
        enlarged: the falls are enlarged by this share, against the rounding of the comparison.
    """

    most_on_boundary: int = 300
    most_unknowns: tuple[int, int] = (20_000, 5_000)
    enlarged: float = 1e-6


DEFAULT = CertificateThresholds()
PLAUSIBILITY = PlausibilityThresholds()
UNIQUENESS = UniquenessThresholds()
