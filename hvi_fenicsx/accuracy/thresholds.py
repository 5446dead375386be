"""The numbers that tune how an accuracy is reached, errors are extrapolated and costs are forecast."""

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
    """

    fitted: int = 5
    trusted: int = 6
    slowest: float = 0.5
    measurable: int = 20_000


@dataclass(frozen=True, kw_only=True)
class ControlThresholds:
    """How mesh, smoothing and tolerance follow from the estimated error.

    Attributes:
        bulk_2d: share of the squared error that one step refines in 2D.
        bulk_3d: the same in 3D.
        bulk_on_contact: the same for errors on Γc: they fall as the square of the energy norm's, so a smaller share
            goes as far.
        last_bulk_of_degree_2: the share up to which one step at degree 2 goes in 2D if that reaches the energy norm
            asked for: a mesh less is worth more than some cells.
        smallest_bulk: the least share that a step refines.
        aim: part of the accuracy asked for at which the last step aims.
        smoothing: part of the accuracy asked for that smoothing may take.
        narrowest_step: least factor on ε in one step: what smoothing changes may fall much faster than ε.
        algebraic: the solver's relative tolerance as a part of the estimated error.
        finest_tolerance: the least tolerance of the solver.
        coarsest_tolerance: the greatest tolerance of the solver.
        tighter: factor on the tolerance where a mesh has no certified solution at first: a loose one may end where
            the law is undecided.
        meshes_before_forecast: meshes with an error of a quantity without an estimator before its cost is forecast.
        failures: times in a row without a certified solution after which no equilibrium is expected.
        most_levels: meshes at most.
        usable_memory: part of the machine's memory that may be used.
        unresolved: root mean square deviation of a value on the boundary from its linear interpolation, as a part of
            its range, from which the first mesh is refined.
        rounding: the same part of the largest value that is rounding.
        first_unknowns: unknowns from which the first mesh is not refined for that.
        close: how near to the wanted share a marking must come, as a factor.
        corrections: how often a marking is corrected for that.
    """

    bulk_2d: float = 0.75
    bulk_3d: float = 0.5
    bulk_on_contact: float = 0.5
    last_bulk_of_degree_2: float = 0.9
    smallest_bulk: float = 0.2
    aim: float = 0.9
    smoothing: float = 0.3
    narrowest_step: float = 1 / 3
    algebraic: float = 0.03
    finest_tolerance: float = 1e-10
    coarsest_tolerance: float = 1e-4
    tighter: float = 1e-3
    meshes_before_forecast: int = 4
    failures: int = 4
    most_levels: int = 80
    usable_memory: float = 0.8
    unresolved: float = 0.1
    rounding: float = 1e-9
    first_unknowns: int = 20_000
    close: float = 1.05
    corrections: int = 2


@dataclass(frozen=True, kw_only=True)
class ChoiceThresholds:
    """How the degree is chosen.

    Attributes:
        price: how many times as much an unknown of degree 2 costs as one of degree 1.
        budget: part of a time budget by which degree 2 must have been solved on the first mesh.
        much: accuracy from which on degree 2 is begun with.
        small: unknowns of degree 2 on the first mesh up to which this is done.
    """

    price: float = 2.0
    budget: float = 0.5
    much: float = 0.1
    small: int = 20_000


CHOICE = ChoiceThresholds()
CONTROL = ControlThresholds()
EXTRAPOLATION = ExtrapolationThresholds()
FORECAST = ForecastThresholds()
