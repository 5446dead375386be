"""A test of cells by the balance of forces, weighed such that it proves most, and where to divide what is left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..typing import Array
from .balance_programme import BalanceProgramme, Guide
from .boxes import Box, clipped
from .relaxation import Relaxation
from .weighed_balance import Split, Weighed, weighed


@dataclass(frozen=True, kw_only=True)
class Look:
    """What a test leaves of a cell.

    Attributes:
        cell: the cell, made smaller.
        guide: where it is to be divided; None if the programme failed.
    """

    cell: Box
    guide: Guide | None


class BalanceTest:
    """The test for one problem.

    Args:
        relaxation: of the problem.
    """

    def __init__(self, relaxation: Relaxation) -> None:
        self._relaxation, self._problem = relaxation, relaxation.problem
        self._thresholds = relaxation.problem.thresholds.balance

    def look(self, cell: Box, cut: Callable[[], bool] = lambda: False) -> Look | None:
        """What is left of a cell; None if no stationary point is in it.

        Args:
            cell: the cell.
            cut: whether to be content with less of a proof, asked at each step of the programme.
        """
        ends = cell.low, cell.high
        split = Split.of(self._problem, self._relaxation.curvature(cell, self._thresholds.part))
        if not np.isfinite(split.short):
            return Look(cell=cell, guide=None)
        best, guide = self._best(split, ends, cut)
        if best is None:
            return Look(cell=cell, guide=guide)
        smaller = None if best.excludes else best.smaller(*ends)
        if smaller is None:
            return None
        low, high = smaller
        return Look(cell=replace(cell, low=low, high=high, x=clipped(cell.x, low, high)), guide=guide)

    def _best(
        self, split: Split, ends: tuple[Array, Array], cut: Callable[[], bool]
    ) -> tuple[Weighed | None, Guide | None]:
        """The best proof that was found, and the guide of the last iterate."""
        limits = self._thresholds
        programme, best, before, last = BalanceProgramme(self._problem, split, *ends), None, -np.inf, None
        for step, here in enumerate(programme.iterates()):
            last = here
            if cut():
                break
            if step < limits.first or step % limits.every != limits.first % limits.every:
                continue
            proof = weighed(self._problem, split, ends, *programme.weights(here))
            if np.isfinite(proof.total) and (best is None or proof.total > best.total):
                best = proof
            value = programme.value(here)
            near = value < 0.0 and here.residual < limits.settled and value - proof.total < limits.near * -value
            still = step > limits.late and abs(proof.total - before) < limits.still * abs(before)
            if proof.excludes or near or still:
                break
            before = proof.total
        return best, None if last is None else programme.guide(last)
