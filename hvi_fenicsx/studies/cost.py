"""What a run costs: wall time by phase without compilation and output, repeated until its median is steady."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from .thresholds import DEFAULT, Thresholds

PHASES = ("mesh", "assembly", "setup", "solve", "certificate")
"""What is counted: compilation (``jit``) is paid once for all, and a study writes no results."""


def seconds(times: Mapping[str, float]) -> float:
    """The cost of one run, s."""
    return sum(times[phase] for phase in PHASES)


def spread(values: Sequence[float]) -> float:
    """Standard error of the median, relative: from the median absolute deviation, as for a normal distribution."""
    if len(values) < 2:
        return math.inf
    middle = statistics.median(values)
    deviation = 1.4826 * statistics.median(abs(v - middle) for v in values)
    return 1.2533 * deviation / math.sqrt(len(values)) / middle if middle > 0.0 else 0.0


def wanted(
    found: Sequence[Mapping[str, float]], first: Mapping[str, float], most: int, thresholds: Thresholds = DEFAULT
) -> bool:
    """Whether one more run is wanted: small runs are repeated more often, since they cost less and scatter more.

    Args:
        found: the times of the runs so far by phase, s.
        first: those of the very first run, which filled the caches.
        most: runs at most.
        thresholds: when a median is steady, and when patience ends.
    """
    values = [seconds(times) for times in found]
    if len(found) >= most or seconds(first) > thresholds.longest_repeated or sum(values) > thresholds.patience:
        return False
    return len(found) < thresholds.fewest_runs or spread(values) > thresholds.steady


def cost_record(times: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """Median cost and median of each phase, s; the spread of the former (null for a single run); the number of runs."""
    values = [seconds(t) for t in times]
    error = spread(values)
    return {
        "seconds": statistics.median(values),
        "spread": error if math.isfinite(error) else None,
        "runs": len(values),
        "phases": {phase: statistics.median(t[phase] for t in times) for phase in PHASES},
    }
