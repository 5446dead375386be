"""The numbers that tune how errors of quantities are extrapolated and costs are forecast."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ExtrapolationThresholds:
    """How the error of a quantity follows from its changes from mesh to mesh.

    Attributes:
        apart: ratio of the mesh sizes of two levels from which their difference tells something.
        lowest_order: smallest order of convergence that is believed.
        highest_order: largest order of convergence that P1 can have.
        observed_safety: safety factor where the order was observed.
        assumed_safety: safety factor where it is assumed to be 1.
    """

    apart: float = 1.4
    lowest_order: float = 0.5
    highest_order: float = 2.0
    observed_safety: float = 1.25
    assumed_safety: float = 3.0


@dataclass(frozen=True, kw_only=True)
class ForecastThresholds:
    """How the rate of convergence, time and memory are forecast.

    Attributes:
        fitted: number of last steps that a rate is fitted to.
        trusted: number of steps from which a rate below the optimal one is believed.
        slowest: share of the optimal rate: what is slower is a mesh too coarse to tell.
        measurable: unknowns from which their memory can be told from the program's own.
        kilobytes_2d: per unknown in 2D, before that (docs/accuracy.md).
        kilobytes_3d: per unknown in 3D, before that.
    """

    fitted: int = 5
    trusted: int = 6
    slowest: float = 0.5
    measurable: int = 20_000
    kilobytes_2d: float = 3.0
    kilobytes_3d: float = 6.0


EXTRAPOLATION = ExtrapolationThresholds()
FORECAST = ForecastThresholds()
