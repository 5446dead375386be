"""Loads and prescribed displacements of a system as functions of one factor: constant ones, and λ times the rest."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from dolfinx.fem.petsc import set_bc

from ..effects.base import load_name
from ..errors import InputError
from ..problem.vectors import new_vector, turn
from ..runtime.mpi import agree
from ..system.system import System
from ..typing import Array


@dataclass(frozen=True, kw_only=True)
class Loading:
    """This rank's part of loads g + λ g' and prescribed displacements: columns for constant ones and for scaled ones.

    Attributes:
        applied: loads in the components of the unknowns, (local unknowns, 2).
        prescribed: prescribed displacements, zero at other unknowns, (local unknowns, 2).
        lifted: what the unknowns that are not prescribed feel of both; else as ``prescribed``, (local unknowns, 2).
        pulled: elastic forces of the prescribed displacements alone at the prescribed unknowns, (local unknowns, 2).
    """

    applied: Array
    prescribed: Array
    lifted: Array
    pulled: Array


def names(system: System) -> tuple[str, ...]:
    """All that a factor can scale: ``part.effect`` of each load, prescribed displacement and moved obstacle."""
    moved = [bounds.move.name for bounds in system.bounds if bounds.move is not None]
    return tuple(dict.fromkeys([*system.forces, *_conditions(system), *moved]))


def obstacle_shift(system: System, scaled: Collection[str]) -> Array:
    """By how much the obstacles that a factor moves have moved the bounds of this rank's unknowns, (local unknowns,).

    Args:
        system: the system.
        scaled: names of what the factor scales.

    Raises:
        InputError: on all ranks alike: not in proportion; or another bound of the same unknown stands still.
    """
    shift, still = np.zeros(system.load.local_size), np.zeros(system.load.local_size, dtype=bool)
    both = False
    for bounds in system.bounds:
        dofs, sign = bounds.component()
        if bounds.move is None or bounds.move.name not in scaled:
            still[dofs] = True
            continue
        if not bounds.move.straight:
            raise InputError(
                f"{bounds.move.name}: this obstacle's gaps do not change in proportion to its displacement, so that no "
                "path can move it; give it a direction along its displacement, or leave it out of path.scaled"
            )
        by = sign * bounds.move.by
        both |= bool(np.any((shift[dofs] != 0.0) & (shift[dofs] != by)))
        shift[dofs] = by
    if any(agree(system.comm, both or bool(np.any(still & (shift != 0.0))))):
        raise InputError(
            "path: a vertex is on two parts with contact, and the path moves the obstacle of one only; leave the "
            "vertex out of one part (where)"
        )
    return shift


def make(system: System, scaled: Collection[str] | None) -> Loading:
    """The loading of a system. Collective.

    Args:
        system: the system.
        scaled: names of the loads and prescribed displacements that the factor scales; None: all.

    Raises:
        InputError: on all ranks alike: a name that is none, or a constant and a scaled displacement of one unknown.
    """
    known = names(system)
    chosen = set(known if scaled is None else scaled)
    for name in sorted(chosen - set(known)):
        raise InputError(f"path.scaled: there is no load {name!r}; there are: {', '.join(known) or 'none'}")
    columns = [_column(system, [n for n in known if (n in chosen) == with_factor]) for with_factor in (False, True)]
    applied, prescribed, lifted, pulled = (np.column_stack(parts) for parts in zip(*columns, strict=True))
    _check_overlap(system, prescribed, chosen)
    return Loading(applied=applied, prescribed=prescribed, lifted=lifted, pulled=pulled)


def _conditions(system: System) -> list[str]:
    """The names of the conditions, in their order."""
    placed = system.problem.contributions
    return [load_name(where, effect) for where, effect, part in placed for _ in part.conditions]


def _column(system: System, chosen: Collection[str]) -> tuple[Array, Array, Array, Array]:
    """Applied, prescribed, lifted and pulled of these loads and conditions. Collective."""
    problem, fixed = system.problem, system.problem.fixed_here
    applied, prescribed = new_vector(problem.space), new_vector(problem.space)
    for name in system.forces.keys() & set(chosen):
        applied.axpy(1.0, system.forces[name])
    applied.array[:] = problem.combined(applied.array_r)
    named = zip(problem.conditions, _conditions(system), strict=True)
    set_bc(prescribed, [condition for condition, name in named if name in chosen])
    pull = system.holding.pull(prescribed)
    for vector in (applied, pull):
        turn(vector, system.rotation)
    lifted, pulled = applied.array_r - pull.array_r, np.zeros(applied.local_size)
    lifted[fixed], pulled[fixed] = prescribed.array_r[fixed], pull.array_r[fixed]
    own = np.array(applied.array_r), np.array(prescribed.array_r)
    for vector in (applied, prescribed, pull):
        vector.destroy()
    return *own, lifted, pulled


def _check_overlap(system: System, prescribed: Array, chosen: Collection[str]) -> None:
    """Refuse an unknown that is prescribed twice, scaled and not, unless it is zero. Collective."""
    held = [(n in chosen, dofs) for n, (_, dofs) in zip(_conditions(system), system.problem.held, strict=True)]
    sides = [{int(dof) for is_scaled, dofs in held if is_scaled == side for dof in dofs} for side in (True, False)]
    both = [dof for dof in sides[0] & sides[1] if dof < len(prescribed)]
    if any(agree(system.comm, bool(np.any(prescribed[both] != 0.0)))):
        raise InputError(
            "path.scaled: two boundary parts meet and prescribe the same displacement, one scaled and the other not; "
            "scale both or none"
        )
