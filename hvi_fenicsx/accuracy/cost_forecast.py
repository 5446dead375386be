"""What the next step and a higher accuracy will cost, from what the steps so far did."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..runtime.memory import DEFAULT
from .thresholds import FORECAST, ForecastThresholds


@dataclass(frozen=True, kw_only=True)
class AdaptiveStep:
    """One adaptive step: its cost and what it gave.

    Attributes:
        dofs: unknowns.
        error: estimated, relative, of the quantity asked for (infinite: none yet).
        discretisation: the mesh's part of the error in the energy norm, relative.
        smoothing: smoothing's part of the quantity's error, relative.
        algebraic: the solver's part of the error in the energy norm, relative.
        epsilon: relative width of the smoothing, or None.
        tolerance: of the solver.
        seconds: wall time of this step.
        memory: the program's peak so far, MB.
    """

    dofs: int
    error: float
    discretisation: float
    smoothing: float
    algebraic: float
    epsilon: float | None
    tolerance: float
    seconds: float
    memory: float

    def as_dict(self) -> dict[str, float | None]:
        """For ``summary.json``."""
        return asdict(self)


@dataclass(frozen=True)
class Cost:
    """A forecast.

    Attributes:
        accuracy: what it is of, relative.
        dofs: unknowns.
        seconds: wall time of all steps.
        memory: MB.
    """

    accuracy: float
    dofs: float
    seconds: float
    memory: float

    def as_dict(self) -> dict[str, float]:
        """For ``summary.json``."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class Elements:
    """What elements are refined.

    Attributes:
        dimension: d, 2 or 3.
        degree: p, 1 or 2.
    """

    dimension: int
    degree: int = 1

    @property
    def rate(self) -> float:
        """The optimal r in error = C unknowns^-r, in the energy norm."""
        return self.degree / self.dimension

    @property
    def memory(self) -> float:
        """What an unknown takes, about, MB."""
        return DEFAULT.adaptive[self.dimension] * DEFAULT.of_degree[self.degree] / 1024


def rate(
    steps: Sequence[AdaptiveStep], elements: Elements, power: int = 1, thresholds: ForecastThresholds = FORECAST
) -> float:
    """The observed r in error = C dofs^-r; the optimal one as long as too few steps say otherwise.

    Args:
        steps: so far.
        elements: that are refined.
        power: of the error in the energy norm with which this error falls at best, 1 or 2.
        thresholds: when it is believed.
    """
    known = [s for s in steps if math.isfinite(s.error) and s.error > 0][-thresholds.fitted :]
    best = power * elements.rate
    if len(known) < 3 or known[-1].dofs == known[0].dofs:
        return best
    slope = np.polyfit(np.log([s.dofs for s in known]), np.log([s.error for s in known]), 1)[0]
    observed = max(float(-slope), thresholds.slowest * elements.rate)
    return observed if len(steps) >= thresholds.trusted else max(observed, best)


def cost(
    steps: Sequence[AdaptiveStep],
    accuracy: float,
    elements: Elements,
    base: float,
    power: int = 1,
    thresholds: ForecastThresholds = FORECAST,
) -> Cost:
    """What an accuracy will take by the observed rate.

    Args:
        steps: so far.
        accuracy: relative.
        elements: that are refined.
        base: memory of the program without a mesh, MB.
        power: of the error in the energy norm with which this error falls at best, 1 or 2.
        thresholds: of the forecast.
    """
    last = steps[-1]
    growth = _power(max(1.0, last.error / accuracy), 1.0 / rate(steps, elements, power, thresholds))
    ahead = _duration(steps, last.dofs, last.dofs * growth)
    needed = memory(steps, last.dofs * growth, elements, base, thresholds)
    return Cost(accuracy, last.dofs * growth, sum(s.seconds for s in steps) + ahead, needed)


def _power(base: float, exponent: float) -> float:
    """The power, infinite where it is beyond all numbers."""
    try:
        return float(base**exponent)
    except OverflowError:
        return math.inf


def _duration(steps: Sequence[AdaptiveStep], dofs: float, wanted: float) -> float:
    """Seconds of the steps from a mesh to a finer one: each takes what the shortest took, and so much per unknown."""
    fixed, each = _seconds(steps)
    factor = (steps[-1].dofs / steps[0].dofs) ** (1.0 / max(len(steps) - 1, 1)) if steps[-1].dofs > steps[0].dofs else 2
    count = math.log(wanted / dofs) / math.log(factor)
    return count * fixed + each * (wanted - dofs) * factor / (factor - 1.0)


def _seconds(steps: Sequence[AdaptiveStep]) -> tuple[float, float]:
    """What a step takes whatever its size, and per unknown."""
    fixed, last = min(s.seconds for s in steps), steps[-1]
    return fixed, max(last.seconds - fixed, 0.1 * last.seconds) / last.dofs


def memory(
    steps: Sequence[AdaptiveStep],
    dofs: float,
    elements: Elements,
    base: float,
    thresholds: ForecastThresholds = FORECAST,
) -> float:
    """What a mesh will take, MB.

    Args:
        steps: so far.
        dofs: its unknowns.
        elements: that are refined.
        base: memory of the program without a mesh, MB.
        thresholds: of the forecast.
    """
    last = steps[-1]
    each = elements.memory
    if last.dofs >= thresholds.measurable:
        each = (last.memory - base) / last.dofs
    return base + each * dofs


def seconds(steps: Sequence[AdaptiveStep], dofs: int) -> float:
    """What the next step will take, s.

    Args:
        steps: so far.
        dofs: unknowns of the next one.
    """
    fixed, each = _seconds(steps)
    return fixed + each * dofs
