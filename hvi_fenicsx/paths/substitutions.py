"""A problem in the displacements that its laws on a length feel: each unknown times its factor, an opening positive.

The length is then the Euclidean one of its unknowns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..reduced.condensed_stiffness import DenseStiffness
from ..typing import Array
from .vertex_laws import is_straight


def factors(problem: CondensedProblem) -> Array:
    """What the unknowns are multiplied by, (n,); 1 where no law acts on a length.

    Args:
        problem: the problem.
    """
    found = np.ones(problem.size)
    for bonds in problem.bonds:
        if bonds.radial:
            found[bonds.unknowns] = bonds.signs
    return found


def multiplied(problem: CondensedProblem, factors: Array) -> CondensedProblem:
    """The problem in unknowns that are multiplied.

    Args:
        problem: the problem.
        factors: by unknown, positive or negative, (n,).
    """
    if np.all(factors == 1.0) and is_straight(problem):
        return problem
    ends = np.sort(np.stack([problem.lower * factors, problem.upper * factors]), axis=0)
    return replace(
        problem,
        elastic=DenseStiffness(problem.stiffness / np.outer(factors, factors)),
        force=problem.force / factors,
        force_rate=problem.force_rate / factors,
        lower=ends[0],
        upper=ends[1],
        applied=problem.applied / factors,
        bonds=tuple(replace(b, signs=b.signs / factors[b.unknowns]) for b in problem.bonds),
    )
