"""The solution on a coarser mesh as the start on a finer one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..system.levels import Levels
from ..system.system import System
from ..typing import Integers
from .method import SolveResult
from .thresholds import Thresholds


@dataclass(frozen=True, kw_only=True)
class CoarseStart:
    """A solution on a coarser mesh, as the start on a finer one.

    Attributes:
        system: the system on the coarser mesh.
        result: what was found there.
        prolongation: from the coarser system's unknowns to the finer one's.
        levels: the coarser levels of the finer system.
        way: by which a force has moved an obstacle, m; None: no force presses one.
    """

    system: System
    result: SolveResult
    prolongation: PETSc.Mat
    levels: Levels
    way: float | None = None


def prolonged(start: CoarseStart, system: System, thresholds: Thresholds) -> PETSc.Vec:
    """The coarse solution on the finer mesh, within its bounds and with its prescribed values. Collective.

    Args:
        start: the coarse solution, and the way from there.
        system: on the finer mesh.
        thresholds: what counts as on a bound.
    """
    coarse = start.system
    x, known = system.load.duplicate(), coarse.unknowns(start.result.u)
    start.prolongation.mult(known, x)
    _interpolate_relative(x, known, start, system)
    x.scale(coarse.problem.scales.displacement / system.problem.scales.displacement)
    make_admissible(x, system, thresholds)
    return x


def _interpolate_relative(x: PETSc.Vec, known: PETSc.Vec, start: CoarseStart, system: System) -> None:
    """Interpolate relative displacements on interfaces themselves: what is closed, or sticks, stays so. Collective.

    Interpolated displacements of both sides have others between the coarse vertices, since their meshes do not match.

    Args:
        x: the displacement on the finer mesh; its relative displacements are overwritten.
        known: the one on the coarser mesh.
        start: the way from there.
        system: on the finer mesh.
    """
    if not system.problem.interfaces:
        return
    own, shares, values = x.duplicate(), x.duplicate(), known.duplicate()
    at = _relative_dofs(start.system)
    values.array[at] = 1.0
    start.prolongation.mult(values, shares)
    values.array[at] = known.array_r[at]
    start.prolongation.mult(values, own)
    fine = _relative_dofs(system)
    fine = fine[shares.array_r[fine] > system.thresholds.whole_weight]
    x.array[fine] = own.array_r[fine]


def _relative_dofs(system: System) -> Integers:
    """The unknowns (local, owned) that are relative displacements."""
    return np.concatenate([one.surface.dofs.ravel() for one in system.problem.interfaces])


def make_admissible(x: PETSc.Vec, system: System, thresholds: Thresholds) -> None:
    """Move unknowns within their bounds, onto a bound that only rounding keeps them from, and to prescribed values.

    Args:
        x: the unknowns, changed in place.
        system: with bounds and prescribed values.
        thresholds: what counts as on a bound.
    """
    at, d = system.jacobian.rows.dofs, system.problem.scales.dimension
    near = thresholds.near * system.references.at(at // d)
    values, lower, upper = (vector.array_r[at] for vector in (x, system.lower, system.upper))
    values = np.where(values <= lower + near, lower, np.where(values >= upper - near, upper, values))
    x.array[at] = values
    system.prescribe(x)
