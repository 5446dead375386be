"""The load of a system as a function of one factor, which multiplies loads and prescribed displacements by name."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..effects import load_name
from ..errors import InputError
from ..problem.problem import Problem
from ..problem.vectors import new_vector, turn
from ..runtime.mpi import agree
from ..typing import Array
from .system import System


@dataclass(frozen=True, kw_only=True)
class FactoredLoad:
    """The load b(λ) = constant + λ scaled, as ``System.load`` has it: lifted, the prescribed values in their rows.

    Attributes:
        constant: what the factor does not multiply.
        scaled: what it multiplies.
    """

    constant: PETSc.Vec
    scaled: PETSc.Vec

    def at(self, factor: float) -> PETSc.Vec:
        """The load at a factor, a new vector. Collective.

        Args:
            factor: λ.
        """
        load = self.constant.copy()
        load.axpy(factor, self.scaled)
        return load


def drives(problem: Problem) -> tuple[str, ...]:
    """The names of all that drives the body: loads, prescribed displacements, given strains.

    Args:
        problem: the problem.
    """
    found = (load_name(where, effect) for where, effect, c in problem.contributions if c.linear or c.strains)
    held = (load_name(where, effect) for where, effect, c in problem.contributions if c.conditions)
    return tuple(dict.fromkeys((*found, *held)))


def factored(system: System, scaled: Collection[str] | None = None) -> FactoredLoad:
    """The load of a system, of which a factor multiplies some parts. Collective.

    Args:
        system: the system.
        scaled: the names of these parts, such as ``pull.traction`` or ``grip.displacement``; None: all.

    Raises:
        InputError: on all ranks alike: there is no such name, or two parts meet of which the factor multiplies the
            displacement of one only.
    """
    known = drives(system.problem)
    if unknown := sorted(set(scaled or ()) - set(known)):
        raise InputError(f"path.scaled: there is no {unknown[0]!r}; there are: {', '.join(known) or 'none'}")
    names = set(known if scaled is None else scaled)
    moved = [
        load_name(where, effect) in names for where, effect, c in system.problem.contributions for _ in c.conditions
    ]
    _check_meetings(system.problem, moved)
    values = [_prescribed(system.problem, moved, chosen) for chosen in (False, True)]
    parts = [_part(system, names, values[chosen], scaled=chosen) for chosen in (False, True)]
    return FactoredLoad(constant=parts[0], scaled=parts[1])


def _prescribed(problem: Problem, moved: Collection[bool], chosen: bool) -> Array:
    """What the chosen conditions prescribe at the local scalar dofs, zero at the others."""
    found = np.zeros(len(problem.points) * problem.scales.dimension)
    for condition, one in zip(problem.conditions, moved, strict=True):
        if one is chosen:
            condition.set(found)
    return found


def _part(system: System, names: Collection[str], prescribed: Array, *, scaled: bool) -> PETSc.Vec:
    """The load of the named forces (of the others, if not scaled) and of prescribed values. Collective."""
    load = new_vector(system.problem.space)
    for name, force in system.forces.items():
        if (name in names) is scaled:
            load.axpy(1.0, force)
    load.array[:] = system.problem.combined(load.array_r)
    fixed = system.problem.fixed_here
    load.axpy(-1.0, system.holding.spread(prescribed[fixed]))
    load.array[fixed] = prescribed[fixed]
    turn(load, system.rotation)
    if system.free_motions is not None:
        system.free_motions.null_space.remove(load)
    return load


def _check_meetings(problem: Problem, moved: Collection[bool]) -> None:
    """Refuse a vertex that one part moves by the factor and another holds at a constant value. Collective."""
    named = [(part, one) for (part, _), one in zip(problem.held, moved, strict=True)]
    each = [_at(problem, number) for number in range(len(named))]
    bad = [
        f"path.scaled: boundary.{named[i][0]} and boundary.{named[j][0]} meet, and prescribe the same displacement "
        "there; name both or none of them"
        for i in range(len(named))
        for j in range(i)
        if named[i][1] is not named[j][1] and np.any(each[i] * each[j])
    ]
    found = [text for rank in agree(problem.domain.mesh.comm, bad[:1]) for text in rank]
    if found:
        raise InputError(found[0])


def _at(problem: Problem, number: int) -> Array:
    values = np.zeros(len(problem.points) * problem.scales.dimension)
    problem.conditions[number].set(values)
    return values
