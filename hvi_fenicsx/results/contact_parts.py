"""The parts of Γc on rank 0, in SI: the rows and columns of ``contact.csv``, in its order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..certify.contact_state import ContactState
from ..effects import Direction
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..report.contact_part import ContactPart
from ..runtime.mpi import joined
from ..typing import Array
from . import arc_length


def contact_parts(problem: Problem, states: Sequence[ContactState]) -> dict[str, ContactPart]:
    """The parts of Γc by name, in the order of their names, on rank 0; none elsewhere. Collective.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    comm, scales, found = problem.domain.mesh.comm, problem.scales, {}
    for state in sorted(states, key=lambda state: state.surface.part):
        columns = {name: joined(comm, values) for name, values in _columns(problem, state).items()}
        others = {name: joined(comm, values) for name, values in _others(problem, state).items()}
        if comm.rank == 0:
            found[state.surface.part] = _sorted(state.surface.part, columns, others, scales.dimension)
    return found


def _sorted(name: str, columns: dict[str, Array], others: dict[str, Any], d: int) -> ContactPart:
    """A part in the order of the table. Rank 0 only."""
    vertices, facets = others["vertices"], np.unique(others["facets"], axis=0)  # ranks may know the same facets
    points = np.column_stack([columns[axis] for axis in "xyz"[:d]])
    s = {}
    if d == 2:
        order, s["s"] = arc_length.along(points, vertices, others["edges"])
    else:
        order = arc_length.lexicographic(points)
    return ContactPart(
        name=name,
        columns=s | {name: values[order] for name, values in columns.items()},
        facets=facets[np.isin(facets, vertices).all(axis=1)],
        **{name: others[name][order] for name in ("vertices", "weight", "normal", "drops")},
    )


def _others(problem: Problem, state: ContactState) -> dict[str, Any]:
    """What this rank knows of a part besides, in any order."""
    scales, space, surface = problem.scales, problem.space, state.surface
    facets = spaces.global_numbers(space, nodes.linear_facets(space, surface.facets))
    return {
        "vertices": spaces.global_numbers(space, surface.blocks),
        "facets": np.sort(facets, axis=1),
        "edges": arc_length.edges(problem, surface) if scales.dimension == 2 else facets,
        "weight": surface.weights * scales.length ** (scales.dimension - 1),
        "normal": surface.normals,
        "drops": _drops(state) * scales.displacement,
    }


def _columns(problem: Problem, state: ContactState) -> dict[str, Array]:
    """What this rank knows of a part's columns but ``s``, (m,) each; NaN where the table is empty."""
    scales, d = problem.scales, problem.scales.dimension
    u, p = scales.displacement, scales.stress
    found = {axis: state.surface.points[:, i] for i, axis in enumerate("xyz"[:d])}
    found["u_n"] = state.normal_displacement * u
    for i in range(d - 1):
        found[f"u_t{i + 1}"] = state.tangential_displacement[:, i] * u
        if state.resists_slip:  # else σ_t is a support's, at a corner
            found[f"friction_t{i + 1}"] = state.friction[:, i] * p
    if state.bounds is not None:
        found["gap"] = np.where(np.isfinite(state.gap), state.gap * u, np.nan)
        found["contact"] = state.contact.astype(float)
    found["sigma_n"] = state.pressure * p
    for name, kind in (("branch_t", "tangential"), ("branch_n", "normal")):
        branch = state.branch(*(direction for direction in Direction if getattr(direction, kind)))
        if branch is not None:
            found[name] = branch.astype(float)
    return found


def _drops(state: ContactState) -> Array:
    """The slips at which the friction law drops, (m, j)."""
    slips = [law.term for law in state.laws if law.term.direction is Direction.SLIP]
    each = [term.stretch[:, None] * term.exact.concave.kinks for term in slips]
    return np.concatenate([np.empty((len(state.surface.weights), 0)), *each], axis=1)
