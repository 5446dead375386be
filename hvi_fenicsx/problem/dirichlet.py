"""Prescribed displacements as Dirichlet conditions, which must agree where their parts meet."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..effects import Condition
from ..errors import InputError
from ..geometry import spot
from ..runtime.mpi import agree
from ..typing import Array, Entities
from .domain_forms import DomainForms
from .scaling import Scales
from .spaces import edge_share
from .thresholds import DEFAULT, CompositionThresholds


def make_conditions(
    context: DomainForms,
    scales: Scales,
    wanted: Sequence[tuple[str, Condition]],
    thresholds: CompositionThresholds = DEFAULT,
) -> tuple[fem.DirichletBC, ...]:
    """The conditions, nondimensional. Collective.

    Args:
        context: spaces, parts and vertices.
        scales: what one unit is in SI.
        wanted: the conditions in SI, each with the part it stands on.
        thresholds: which values are the same.

    Raises:
        InputError: on all ranks alike: two parts prescribe different values where they meet.
    """
    found = tuple(_condition(context, scales, part, condition) for part, condition in wanted)
    named = [(part, bc) for (part, _), bc in zip(wanted, found, strict=True)]
    _check_agreement(context, scales, named, thresholds.same)
    return found


def values(context: DomainForms, conditions: Sequence[fem.DirichletBC]) -> Array:
    """What the conditions prescribe at the local scalar dofs, zero at the others.

    Args:
        context: spaces, parts and vertices.
        conditions: the conditions.
    """
    found = np.zeros(len(context.points) * context.dimension)
    for condition in conditions:
        condition.set(found)
    return found


def _condition(context: DomainForms, scales: Scales, part: str, condition: Condition) -> fem.DirichletBC:
    facets, dim = context.part_facets[part], context.dimension - 1
    component = context.space.sub(condition.component)
    if condition.value.is_number and edge_share(context.space) == 0.0:
        value = PETSc.ScalarType(condition.value.source / scales.displacement)  # type: ignore[operator]
        return fem.dirichletbc(value, fem.locate_dofs_topological(component, dim, facets), component)
    collapsed, _ = component.collapse()
    function = fem.Function(collapsed)
    function.interpolate(lambda x: np.asarray(condition.value.at(x.T) / scales.displacement))
    return fem.dirichletbc(function, fem.locate_dofs_topological((component, collapsed), dim, facets), component)


def _check_agreement(
    context: DomainForms, scales: Scales, named: Sequence[tuple[str, fem.DirichletBC]], rounding: float
) -> None:
    """Where two parts meet they must prescribe the same: else the order of the tables would decide."""
    values = np.empty(len(context.points) * context.dimension)
    prescribed = [(part, *_values(condition, values)) for part, condition in named]
    size = max((float(np.max(np.abs(v), initial=0.0)) for _, _, v in prescribed), default=0.0)
    bad: list[str] = []
    for (one, dofs, these), (other, more, those) in combinations(prescribed, 2):
        shared, i, j = np.intersect1d(dofs, more, assume_unique=True, return_indices=True)
        apart = np.abs(these[i] - those[j]) > rounding * size
        differing = zip(shared[apart], these[i][apart], those[j][apart], strict=True)
        bad += [_disagreement(context, int(dof), (one, other), pair, scales) for dof, *pair in differing]
    found = [text for rank in agree(context.domain.mesh.comm, bad[:1]) for text in rank]
    if found:
        raise InputError(found[0])


def _values(condition: fem.DirichletBC, values: Array) -> tuple[Entities, Array]:
    """The dofs of a condition and what it prescribes; ``values`` is room for all dofs."""
    dofs = condition.dof_indices()[0]
    condition.set(values)
    return dofs, values[dofs]


def _disagreement(context: DomainForms, dof: int, parts: tuple[str, str], pair: Sequence[float], scales: Scales) -> str:
    block, component = divmod(dof, context.dimension)
    at = spot(context.points[block][: context.dimension])
    one, other = (float(value) * scales.displacement for value in pair)
    return (
        f"boundary.{parts[0]} and boundary.{parts[1]} meet at {at} and prescribe displacements along "
        f'{"xyz"[component]} that differ, {one:.6g} and {other:.6g} m; make them equal there, or write "free" in one'
    )
