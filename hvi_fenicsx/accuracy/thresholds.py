"""The numbers that tune how an accuracy is reached."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ControlThresholds:
    """How degree, mesh and smoothing follow from the estimated error.

    Attributes:
        bulk_in_plane: share of the squared error that one step refines in 2D, for the energy norm.
        bulk: the same in 3D, and for errors on Γc: they fall as the square of the energy norm's, so a smaller share
            goes as far.
        last_bulk_of_degree_2: the share up to which one step at degree 2 goes in 2D if that reaches the energy norm
            asked for: a mesh less is worth more than some cells.
        aim: part of the accuracy asked for at which the last step aims.
        smoothing: part of the accuracy asked for that smoothing may take.
        narrower: factor on ε in one step: what smoothing changes may fall much faster than ε.
        failures: meshes in a row without a certified solution after which no equilibrium is expected.
        unresolved: root mean square deviation of a value on the boundary from its linear interpolation, as a part of
            its range, from which the first mesh is refined.
        small: unknowns up to which the first mesh is refined for that, and degree 2 is begun with.
        price: how many times as much an unknown of degree 2 costs as one of degree 1.
    """

    bulk_in_plane: float = 0.75
    bulk: float = 0.5
    last_bulk_of_degree_2: float = 0.9
    aim: float = 0.9
    smoothing: float = 0.3
    narrower: float = 1 / 3
    failures: int = 3
    unresolved: float = 0.1
    small: int = 20_000
    price: float = 2.0


CONTROL = ControlThresholds()
