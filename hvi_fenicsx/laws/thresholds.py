"""What counts as sharp, as far and as a jump where a law is known by its values only."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Limits of the search for extreme tractions, and of sampling.

    Attributes:
        resolution: relative sharpness of the bounds.
        near: the least displacement that is sampled, over the law's length scale.
        far: the largest displacement that is searched, over the largest of 1, the law's length scale and its kinks;
            beyond it the law's growth is trusted.
        first_samples: displacements of the first grid, in geometric progression.
        rounds: bisections at most.
        most_intervals: intervals up to which bisection goes on.
        jump: relative to the largest traction, a smaller difference of the limits at an end is not meant as a jump.
        most_drops: drops of a sawtooth: each is a piece of the law, which is looked at at every vertex.
        inside: how far inside of a piece its one-sided limits are taken, over the piece's length.
    """

    resolution: float = 1e-6
    near: float = 1e-6
    far: float = 1e12
    first_samples: int = 400
    rounds: int = 80
    most_intervals: int = 200_000
    jump: float = 1e-9
    most_drops: int = 1_000
    inside: float = 1e-12


DEFAULT = Thresholds()
