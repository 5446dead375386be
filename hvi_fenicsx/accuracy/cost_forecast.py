"""What the next step and a higher accuracy will cost, from what the steps so far did."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

_FITTED, _TRUSTED = 5, 6
"""Steps that a rate is fitted to, and the number from which one below the optimal rate is believed."""
_SLOWEST = 0.5
"""Of the optimal rate: what is slower is a mesh too coarse to tell."""
_MEASURABLE = 20_000
"""Unknowns from which the memory that they took can be told from the program's own."""
_KILOBYTES = {2: 3.0, 3: 6.0}
"""Per unknown, by dimension, before that (docs/accuracy.md)."""


@dataclass(frozen=True)
class Step:
    """One rung: its cost and what it gave.

    Attributes:
        dofs: unknowns. error: estimated, relative, of the quantity asked for (infinite: none yet).
        discretisation, algebraic: parts of the energy norm's, relative. smoothing: of the quantity's, likewise.
        epsilon: relative width of the smoothing, or None. tolerance: of the solver.
        seconds: wall time of this rung. memory: the program's peak so far, MB.
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
    """A forecast: unknowns, wall time of the whole climb (s), memory (MB)."""

    accuracy: float
    dofs: float
    seconds: float
    memory: float

    def as_dict(self) -> dict[str, float]:
        """For ``summary.json``."""
        return asdict(self)


def rate(steps: Sequence[Step], dimension: int) -> float:
    """The observed r in error = C dofs^-r; the optimal 1/d of P1 as long as too few steps say otherwise."""
    known = [s for s in steps if math.isfinite(s.error) and s.error > 0][-_FITTED:]
    best = 1.0 / dimension
    if len(known) < 3 or known[-1].dofs == known[0].dofs:
        return best
    slope = np.polyfit(np.log([s.dofs for s in known]), np.log([s.error for s in known]), 1)[0]
    observed = max(float(-slope), _SLOWEST * best)
    return observed if len(steps) >= _TRUSTED else max(observed, best)


def cost(steps: Sequence[Step], accuracy: float, dimension: int, base: float) -> Cost:
    """What an accuracy will take by the observed rate; ``base`` is the memory (MB) of the program without a mesh."""
    last = steps[-1]
    growth = max(1.0, last.error / accuracy) ** (1.0 / rate(steps, dimension))
    ahead = _duration(steps, last.dofs, last.dofs * growth)
    needed = memory(steps, last.dofs * growth, dimension, base)
    return Cost(accuracy, last.dofs * growth, sum(s.seconds for s in steps) + ahead, needed)


def _duration(steps: Sequence[Step], dofs: float, wanted: float) -> float:
    """Of the rungs from a mesh up to another one: each takes what the shortest took, and so much per unknown."""
    fixed, each = _seconds(steps)
    factor = (steps[-1].dofs / steps[0].dofs) ** (1.0 / max(len(steps) - 1, 1)) if steps[-1].dofs > steps[0].dofs else 2
    rungs = math.log(wanted / dofs) / math.log(factor)
    return rungs * fixed + each * (wanted - dofs) * factor / (factor - 1.0)


def _seconds(steps: Sequence[Step]) -> tuple[float, float]:
    """Of a rung whatever its size, and per unknown."""
    fixed, last = min(s.seconds for s in steps), steps[-1]
    return fixed, max(last.seconds - fixed, 0.1 * last.seconds) / last.dofs


def memory(steps: Sequence[Step], dofs: float, dimension: int, base: float) -> float:
    """What a mesh of so many unknowns will take, MB."""
    last = steps[-1]
    each = _KILOBYTES[dimension] / 1024
    if last.dofs >= _MEASURABLE:
        each = (last.memory - base) / last.dofs
    return base + each * dofs


def seconds(steps: Sequence[Step], dofs: int) -> float:
    """What a next rung of so many unknowns will take, s."""
    fixed, each = _seconds(steps)
    return fixed + each * dofs
