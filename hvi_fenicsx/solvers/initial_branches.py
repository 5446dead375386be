"""The pieces of the laws that the branch iteration begins on: where there are several solutions, they decide which."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..effects import Direction
from ..formula import Formula
from ..problem.law_term import LawTerm
from ..system.system import System
from ..typing import Array
from .options import Start


def arguments(system: System, resting: PETSc.Vec, start: Start, broken_slip: float) -> list[Array]:
    """Arguments of the laws on the pieces to begin on, by term, (m,) each.

    Args:
        system: the assembled problem.
        resting: the displacement with contact closed and laws at rest.
        start: the name of a start, or a displacement by component (m).
        broken_slip: slip of a broken bond, relative to the law's length or to the slip at rest.
    """
    if start == "unbroken":
        return [np.zeros(len(t.surface.blocks)) for t in system.terms]
    if not isinstance(start, str):
        return _displaced(system, start)
    found = [t.argument(resting.array_r) for t in system.terms]
    if start == "resting":
        return found
    return [_broken(t, a, broken_slip) for t, a in zip(system.terms, found, strict=True)]


def _displaced(system: System, start: Sequence[Formula]) -> list[Array]:
    """Arguments of a displacement; the directions of the problem's own terms are Cartesian, as it is."""
    found = []
    for term in system.problem.terms:
        u = np.column_stack([f.at(term.surface.points) for f in start]) / system.problem.scales.displacement
        found.append(term.argument_of(np.einsum("mkd,md->mk", term.directions, u)))
    return found


def _broken(term: LawTerm, slip: Array, far: float) -> Array:
    """A large slip in the direction of the slip at rest; positive for laws of an opening or a penetration."""
    sign = np.where(slip < 0, -1.0, 1.0) if term.direction is Direction.SLIP else np.ones_like(slip)
    return np.asarray(sign * far * np.maximum(np.abs(slip), term.exact.length_scale))
