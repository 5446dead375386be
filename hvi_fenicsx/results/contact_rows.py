"""The parts of Γc by the rows of ``contact.csv``, in its order: each rank has a stretch of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import la
from mpi4py import MPI

from ..certify.contact_state import ContactState
from ..effects import Direction
from ..mesh import nodes
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..report.contact_part import ContactPart
from ..runtime.row_order import RowOrder, distinct
from ..typing import Array, Integers
from . import arc_length, contact_table


def of_parts(problem: Problem, states: Sequence[ContactState]) -> dict[str, ContactPart]:
    """This rank's stretch of the rows of each part, by its name and sorted by it. Collective.

    So are its facets, those whose vertices all have a row, each once.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    ordered = sorted(states, key=lambda state: state.surface.part)
    return {state.surface.part: _of_part(problem, state) for state in ordered}


def _of_part(problem: Problem, state: ContactState) -> ContactPart:
    comm, scales, surface = problem.domain.mesh.comm, problem.scales, state.surface
    columns = contact_table.columns(problem, state)
    if scales.dimension == 2:
        place, columns["s"] = _along(problem, state)
        order = RowOrder.of(comm, place[:, None])
    else:
        order = RowOrder.of(comm, _rounded(comm, surface.points))
    numbers = spaces.global_numbers(problem.space, surface.blocks)
    return ContactPart(
        name=surface.part,
        columns={name: order.sorted(values) for name, values in columns.items()},
        vertices=order.sorted(numbers),
        facets=_facets(problem, surface),
        weight=order.sorted(surface.weights * scales.length ** (scales.dimension - 1)),
        normal=order.sorted(surface.normals),
        drops=order.sorted(_drops(state)) * scales.displacement,
    )


def _facets(problem: Problem, surface: Surface) -> Integers:
    """This rank's stretch of the facets whose vertices all have a row, by their global nodes, (k, d). Collective."""
    on_row = la.vector(problem.space.dofmap.index_map, 1)
    on_row.array[surface.blocks] = 1.0
    on_row.scatter_forward()
    facets = nodes.linear_facets(problem.space, surface.facets)
    numbers = spaces.global_numbers(problem.space, facets[np.all(on_row.array[facets] == 1.0, axis=1)])
    return distinct(problem.domain.mesh.comm, np.sort(numbers, axis=1))


def _drops(state: ContactState) -> Array:
    """The slips at which the friction law drops, (m, j)."""
    slips = [law.term for law in state.laws if law.term.direction is Direction.SLIP]
    each = [term.stretch[:, None] * term.exact.concave.kinks for term in slips]
    return np.concatenate([np.empty((len(state.surface.weights), 0)), *each], axis=1)


def _rounded(comm: MPI.Comm, points: Array) -> Array:
    """Points in space by which they are sorted: coordinates over the part's size, rounded, (m, 3). Collective."""
    ends = np.vstack([points, -points]).reshape(2, *points.shape).max(axis=1, initial=-np.inf)
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    return arc_length.rounded(points, float(np.max(ends.sum(axis=0), initial=0.0)))


def _along(problem: Problem, state: ContactState) -> tuple[Array, Array]:
    """The rows in the table and the arc lengths of the vertices of a plane part on this rank, (m,) each. Collective.

    A curve is followed from end to end, which rank 0 does: it gets points, numbers and edges, no other column.
    """
    comm, surface = problem.domain.mesh.comm, state.surface
    numbers = spaces.global_numbers(problem.space, surface.blocks)
    pieces = comm.gather((surface.points[:, :2], numbers, arc_length.edges(problem, surface)))
    if pieces is None:
        found = comm.scatter(None)
    else:
        by_vertex = _by_vertex(*arc_length.along(*(np.concatenate(values) for values in zip(*pieces, strict=True))))
        found = comm.scatter(np.split(by_vertex, np.cumsum([len(one[0]) for one in pieces])[:-1]))
    return found[:, 0], found[:, 1]


def _by_vertex(order: Integers, s: Array) -> npt.NDArray[Any]:
    """Row and arc length by vertex, (m, 2), of the vertices by row and the arc length by row."""
    found = np.empty((len(order), 2))
    found[order] = np.column_stack([np.arange(len(order)), s])
    return found
