"""Whether further Newton steps of one solve will lower its residual."""

from __future__ import annotations

import numpy as np

from .thresholds import ActiveSetThresholds


class StallTest:
    """Is told the residual of each step.

    Args:
        thresholds: when to give up.
        full_steps: whether no line search shortens the steps: these may go round in a circle for ever. Those of a
            search are of use where the energy falls, even if the residual does not.
    """

    def __init__(self, thresholds: ActiveSetThresholds, *, full_steps: bool) -> None:
        self._thresholds, self._full_steps = thresholds, full_steps
        self._last = self._least = np.inf
        self._still = self._slow = self._useless = 0

    def gives_up(self, residual: float) -> bool:
        """Whether to give up after a step.

        Args:
            residual: relative, after the step.
        """
        self._note(residual)
        thresholds, most = self._thresholds, self._thresholds.stalled_steps
        at_rounding = residual < thresholds.rounding_below
        circles = self._full_steps and self._useless >= thresholds.useless_steps
        return self._still >= most or (at_rounding and self._slow >= 2 * most) or circles

    def _note(self, residual: float) -> None:
        thresholds = self._thresholds
        self._still = self._still + 1 if abs(residual - self._last) < thresholds.still * self._last else 0
        self._slow = self._slow + 1 if residual > 0.5 * self._last else 0
        falls = residual < thresholds.useful_fall * self._least
        self._useless = 0 if falls else self._useless + 1
        self._least = residual if falls else self._least
        self._last = residual
