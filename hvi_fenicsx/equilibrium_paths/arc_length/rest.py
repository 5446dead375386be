"""Where a path begins: at rest, before constant loads act; these are applied along a path of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...reduced.condensed_stiffness import is_singular, rounding_of
from ...typing import Array
from ..programme import constant_alone
from ..segments import Kind, Segment
from .sites import Sites


@dataclass(frozen=True, kw_only=True)
class Rest:
    """The state before any load acts.

    Attributes:
        z: the coordinates of the sites, (n,).
        held: whether the body is held there.
        constant: the path from there to the constant loads, its factor from 0 to 1; None where there are none.
    """

    z: Array
    held: bool
    constant: CondensedProblem | None = None


def at_rest(problem: CondensedProblem, sites: Sites) -> Rest:
    """The state before any load acts; the sites are put there.

    Args:
        problem: the problem.
        sites: its sites.
    """
    x = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    z, force = np.zeros(problem.size), np.zeros(problem.size)
    free = problem.force - problem.stiffness @ x
    for k in range(len(sites)):
        i = int(sites.one[k]) if k < len(sites.one) else None
        at, wanted = (0.0, 0.0) if i is None else (float(x[i]), float(free[i]))
        number, s_force = _standing(sites.chain(k), at, wanted)
        if sites.opening(k) is not None and sites.chain(k)[number].kind is Kind.PIECE:
            number = len(sites.chain(k)) - 1
        sites.enter(k, number)
        if i is not None:
            z[i], force[i] = sites.coordinate(k, at, s_force), s_force
    return Rest(z=z, held=is_held(sites, z), constant=constant_alone(problem, x, force))


def _standing(chain: tuple[Segment, ...], x: float, wanted: float) -> tuple[int, float]:
    """The segment of a displacement that holds best, and its least force; of a fixed unknown the wanted one."""
    if len(chain) == 1 and chain[0].kind is Kind.BOUND:
        return 0, wanted
    forces = {n: segment.force_at(x) for n, segment in enumerate(chain) if segment.stands_at(x)}
    least = min(abs(f) for f in forces.values())
    best = max((n for n in forces if abs(forces[n]) == least), key=lambda n: chain[n].hold)
    return best, forces[best]


def is_held(sites: Sites, z: Array) -> bool:
    """Whether the tangent holds the body.

    Args:
        sites: where all sites are.
        z: their coordinates, (n,).
    """
    return not is_singular(sites.motions(sites.values(z)).matrix, rounding_of(sites.stiffness))
