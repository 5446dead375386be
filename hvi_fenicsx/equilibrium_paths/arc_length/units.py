"""The units of displacements and forces in which the coordinates along graphs are about one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array, Integers
from .vertex_laws import VertexLaw

ROUNDING = 1e-12
"""A stiffness below this share of the largest is none: the unknown moves with a body that is free."""


def units(problem: CondensedProblem, laws: Sequence[VertexLaw], groups: Sequence[Integers]) -> tuple[float, Array]:
    """The unit of displacements, and those of forces by unknown, (n,).

    Args:
        problem: the problem.
        laws: at its vertices.
        groups: unknowns that share one unit.
    """
    diagonal = np.diag(problem.stiffness).copy()
    largest = float(np.max(diagonal, initial=0.0)) or 1.0
    diagonal[diagonal <= ROUNDING * largest] = largest
    lengths = {law.group: law.law.length_scale for law in laws}.values()
    bounds = np.abs(np.concatenate([problem.lower, problem.upper]))
    elastic = np.max(np.abs(problem.force_rate) / diagonal, initial=0.0)
    length = max(lengths, default=max(elastic, float(np.max(bounds[np.isfinite(bounds)], initial=0.0))) or 1.0)
    for group in groups:
        diagonal[group] = diagonal[group].mean()
    return float(length), diagonal * float(length)
