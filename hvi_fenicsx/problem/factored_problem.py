"""A problem at any factor of some of its loads and given displacements, without being composed again."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..effects import load_name
from ..typing import Array
from .law_term import LawTerm
from .problem import Bounds, Problem


@dataclass(frozen=True, kw_only=True)
class _ScaledCondition:
    """A condition whose values the factor multiplies.

    Attributes:
        condition: as dolfinx has it.
        values: of the condition, on the space of its component; changed in place.
        once: these values at the factor 1.
    """

    condition: fem.DirichletBC
    values: fem.Function
    once: Array


class FactoredProblem:
    """A problem whose parts of some names are multiplied by a factor. Creation is collective.

    Args:
        problem: the problem at the factor 1.
        scaled: the names of what the factor multiplies, such as ``pull.traction`` or ``grip.displacement``.
    """

    def __init__(self, problem: Problem, scaled: Collection[str]) -> None:
        self._factor = fem.Constant(problem.space.mesh, PETSc.ScalarType(1.0))
        self._moved = _scaled_conditions(problem, scaled)
        conditions = list(problem.conditions)
        for number, moved in self._moved.items():
            conditions[number] = moved.condition
        self._problem = replace(
            problem,
            linear=self._times_factor(problem.linear, scaled),
            bulk=replace(problem.bulk, strains=self._times_factor(problem.bulk.strains, scaled)),
            conditions=tuple(conditions),
            bounds=tuple(_own(bounds) if _is_moved(bounds, scaled) else bounds for bounds in problem.bounds),
        )
        self._bounds = [
            (own, once)
            for own, once in zip(self._problem.bounds, problem.bounds, strict=True)
            if _is_moved(once, scaled)
        ]

    def _times_factor(self, named: Mapping[str, Any], scaled: Collection[str]) -> dict[str, Any]:
        return {name: self._factor * form if name in scaled else form for name, form in named.items()}

    def at(self, factor: float, terms: Sequence[LawTerm] | None = None) -> Problem:
        """The problem at a factor. It holds until the next call, which changes its loads.

        Args:
            factor: λ.
            terms: laws in the place of the problem's own.
        """
        self._factor.value = factor
        for moved in self._moved.values():
            moved.values.x.array[:] = factor * moved.once
        for own, once in self._bounds:
            assert once.move is not None
            back = (1.0 - factor) * once.move.by
            own.lower[:], own.upper[:] = once.lower - back, once.upper - back
        if terms is None:
            return self._problem
        changed = replace(self._problem, terms=tuple(terms))
        changed.__dict__["bodies"] = self._problem.bodies  # the mesh is the same
        return changed


def _own(bounds: Bounds) -> Bounds:
    """The bounds with arrays of their own, which will be changed."""
    return replace(bounds, lower=bounds.lower.copy(), upper=bounds.upper.copy())


def _is_moved(bounds: Bounds, scaled: Collection[str]) -> bool:
    """Whether the factor moves the obstacle of these bounds."""
    return bounds.move is not None and bounds.move.name in scaled


def _scaled_conditions(problem: Problem, scaled: Collection[str]) -> dict[int, _ScaledCondition]:
    """The scaled conditions by their number among all; those of value zero stay what they are. Collective."""
    names = [load_name(where, effect) for where, effect, c in problem.contributions for _ in c.conditions]
    return {
        number: _scaled_condition(problem, number)
        for number, (name, prescribed) in enumerate(zip(names, problem.prescribed, strict=True))
        if name in scaled and not (prescribed.value.is_number and prescribed.value.source == 0.0)
    }


def _scaled_condition(problem: Problem, number: int) -> _ScaledCondition:
    prescribed = problem.prescribed[number]
    component = problem.space.sub(prescribed.component)
    collapsed, _ = component.collapse()
    dofs = fem.locate_dofs_topological((component, collapsed), problem.domain.dimension - 1, prescribed.facets)
    everywhere = np.zeros(len(problem.points) * problem.scales.dimension)
    problem.conditions[number].set(everywhere)
    values = fem.Function(collapsed)
    values.x.array[dofs[1]] = everywhere[dofs[0]]
    condition = fem.dirichletbc(values, dofs, component)
    return _ScaledCondition(condition=condition, values=values, once=values.x.array.copy())
