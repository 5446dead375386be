"""A solution as plain arrays, in SI, on rank 0; its vertices are numbered as the unknowns are.

At degree 2 its vertices are the nodes, and its cells and facets the parts of those of the mesh: the once refined mesh.
The parts of Γc have the rows and columns of ``contact.csv``, in its order: a plane part is ordered along it, chains of
facets being followed from end to end, with their arc length.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..certify.contact_state import ContactState
from ..effects import Direction, SurfaceLoad
from ..geometry import chains
from ..mesh import nodes
from ..mesh.facets import cells_of
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..problem.stress import stress_of_parts, von_mises
from ..report.reader import Result
from ..report.solution_arrays import ContactPart, LoadArrays, SolutionArrays
from ..runtime.mpi import joined
from ..typing import Array, Entities, Integers
from ..workflow import Solution
from .summary import summary

_DIGITS = 9
"""Digits of the part's size; coordinates that should be equal may differ in later ones."""


def result(solution: Solution) -> Result | None:
    """A solution in memory as a finished result, of which pictures are made, on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
    """
    solved = solution.solve_result
    stress = None if solved is None else stress_of_parts(solution.problem.bulk, solved.u)
    arrays, record = solution_arrays(solution, stress), summary(solution)
    return (
        None
        if arrays is None
        else Result(folder=Path("."), scene={"title": solution.scene.title}, summary=record, arrays=arrays)
    )


def solution_arrays(solution: Solution, stress: Array | None = None) -> SolutionArrays | None:
    """A solution on rank 0; None elsewhere. Collective.

    Args:
        solution: what was found.
        stress: in the parts of the cells that this rank owns, N/m², (c, 3, 3); left out where it is None.
    """
    problem = solution.problem
    comm, d, owned = problem.comm, problem.dimension, problem.space.dofmap.index_map.size_local
    fields: dict[str, Any] = {"points": problem.positions[:owned, :d]}
    fields["cells"] = spaces.global_numbers(problem.space, nodes.linear_cells(problem.space))
    if solution.solve_result is not None:
        u = spaces.values(problem.space, solution.solve_result.u.x.array)
        fields["displacement"] = u[:owned] * problem.scales.displacement
    elif (mode := solution.solvability.direction) is not None:
        fields["escape_mode"] = problem.bodies.motion(problem.points / problem.scales.length, mode)[:owned]
    if stress is not None:
        fields["von_mises"] = von_mises(stress).astype(np.float32)
    arrays = SolutionArrays(
        **{name: joined(comm, values) for name, values in fields.items()},
        degree=nodes.degree(problem.space),
        sides={name: _facets(problem, facets) for name, facets in problem.part_facets.items()},
        regions=_regions(problem),
        loads=_loads(problem),
        parts=contact_parts(problem, () if solution.examination is None else solution.examination.states),
    )
    return None if comm.rank else arrays


def _facets(problem: Problem, facets: Entities) -> Integers:
    """The facets that ranks know by their global nodes, each once and ascending, (k, d); on rank 0. Collective."""
    corners = spaces.global_numbers(problem.space, nodes.linear_facets(problem.space, facets))
    return np.unique(joined(problem.comm, np.sort(corners, axis=1)), axis=0)


def _regions(problem: Problem) -> dict[str, Integers]:
    """The cells of each region, by their numbers among the cells of all ranks; on rank 0. Collective."""
    comm, parts = problem.comm, nodes.parts_of_cell(problem.space)
    known = problem.domain.mesh.topology.index_map(problem.dimension)

    def numbers(cells: Entities) -> npt.NDArray[Any]:
        own = known.local_to_global(cells[cells < known.size_local])
        return joined(comm, (own[:, None] * parts + np.arange(parts)).ravel())

    return {name: numbers(cells) for name, cells in sorted(problem.domain.regions.items())}


def _loads(problem: Problem) -> dict[str, LoadArrays]:
    """The loads by part; on rank 0. Collective."""
    found: dict[str, list[SurfaceLoad]] = {}
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is not None and load is not None:
            found.setdefault(where, []).append(load)
    return {name: _load(problem, problem.part_facets[name], loads) for name, loads in found.items()}


def _load(problem: Problem, facets: Entities, loads: Sequence[SurfaceLoad]) -> LoadArrays:
    """The loads on one part, added up, each vertex once; on rank 0. Collective."""
    comm, d = problem.comm, problem.dimension
    local = np.unique(nodes.facet_nodes(problem.space, facets))
    values = np.zeros((len(local), d + 1))
    for load in loads:
        for i, component in enumerate(load.components):
            values[:, i] += component.at(problem.positions[local])
        if load.pressure is not None:
            values[:, d] += load.pressure.at(problem.positions[local])
    numbers, every = (joined(comm, own) for own in (spaces.global_numbers(problem.space, local), values))
    vertices, first = np.unique(numbers, return_index=True)
    return LoadArrays(vertices=vertices, traction=every[first, :d], pressure=every[first, d])


def contact_parts(problem: Problem, states: Sequence[ContactState]) -> dict[str, ContactPart]:
    """The parts of Γc by name, in the order of their names, on rank 0; none elsewhere. Collective.

    Args:
        problem: what was solved.
        states: of the parts.
    """
    comm, found = problem.comm, {}
    for state in sorted(states, key=lambda state: state.surface.part):
        columns, others = (
            {name: joined(comm, values) for name, values in own.items()}
            for own in (columns_of(problem, state), _others(problem, state))
        )
        if comm.rank == 0:
            found[state.surface.part] = _sorted(state.surface.part, columns, others, problem.dimension)
    return found


def _sorted(name: str, columns: dict[str, Array], others: dict[str, Any], d: int) -> ContactPart:
    """A part in the order of the table. Rank 0 only."""
    vertices, points = others["vertices"], np.column_stack([columns[axis] for axis in "xyz"[:d]])
    order, s = along(points, vertices, others["facets"]) if d == 2 else (lexicographic(points), None)
    facets = np.unique(np.sort(others["facets"], axis=1), axis=0)  # ranks may know the same facets
    return ContactPart(
        name=name,
        columns=({} if s is None else {"s": s}) | {name: values[order] for name, values in columns.items()},
        facets=facets[np.isin(facets, vertices).all(axis=1)],
        **{name: others[name][order] for name in ("vertices", "weight", "normal", "drops")},
    )


def _others(problem: Problem, state: ContactState) -> dict[str, Any]:
    """What this rank knows of a part besides, in any order."""
    scales, space, surface = problem.scales, problem.space, state.surface
    pairs = nodes.linear_facets(space, surface.facets)
    return {
        "vertices": spaces.global_numbers(space, surface.blocks),
        "facets": spaces.global_numbers(space, _turned(problem, surface, pairs) if scales.dimension == 2 else pairs),
        "weight": surface.weights * scales.length ** (scales.dimension - 1),
        "normal": surface.normals,
        "drops": _drops(state) * scales.displacement,
    }


def columns_of(problem: Problem, state: ContactState) -> dict[str, Array]:
    """What this rank knows of a part's columns but ``s``, (m,) each; NaN where the table is empty.

    Args:
        problem: what was solved.
        state: of the part.
    """
    scales, d = problem.scales, problem.dimension
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


def _turned(problem: Problem, surface: Surface, pairs: Entities) -> Entities:
    """The edges of a part (k, 2), at degree 2 halves, with the body to their left."""
    space, x = problem.space, problem.points[:, :2]
    cells = cells_of(problem.domain.mesh, surface.facets)[0].repeat(nodes.degree(space))
    ahead, inwards = x[pairs[:, 1]] - x[pairs[:, 0]], x[space.dofmap.list[cells, :3]].mean(axis=1) - x[pairs[:, 0]]
    left = ahead[:, 0] * inwards[:, 1] - ahead[:, 1] * inwards[:, 0] > 0
    return np.where(left[:, None], pairs, pairs[:, ::-1])


def lexicographic(points: Array) -> npt.NDArray[np.intp]:
    """The order of points (m, d) by their coordinates, in which those that should be equal are.

    Args:
        points: m, (m, d).
    """
    size = float(np.max(np.ptp(points, axis=0), initial=0.0))
    return np.lexsort(np.round(points / (size or 1.0), _DIGITS).T[::-1])


def along(points: Array, numbers: Integers, pairs: Integers) -> tuple[Integers, Array]:
    """The order of vertices along their part and the arc length of each, in that order.

    A chain runs from the lexicographically smaller of its ends; a closed one from its smallest vertex, the body to the
    left, and is cut there. Chains follow one another by their smallest vertices, each beginning at the arc length at
    which the last one ended. The arc length is 0 at the smallest vertex of all, and negative before it.

    Args:
        points: the vertices, m, (m, 2).
        numbers: of the vertices, (m,).
        pairs: the facets by these numbers, the body to their left, (k, 2); a facet may be there twice. One with a
            vertex that is none of these is left out.
    """
    rank = np.empty(len(points), dtype=np.int64)
    rank[lexicographic(points)] = np.arange(len(points))
    by_number = np.argsort(numbers)
    within = np.unique(pairs[np.isin(pairs, numbers).all(axis=1)], axis=0)
    edges = by_number[np.searchsorted(numbers[by_number], within)]
    inner = np.unique(edges[:, 1])
    ahead = ((c, c[0] in inner or rank[c[0]] <= rank[c[-1]]) for c in chains(edges, rank))
    found = [chain if kept else chain[::-1] for chain, kept in ahead]
    found += [np.array([alone]) for alone in np.setdiff1d(np.arange(len(points)), edges)]
    found.sort(key=lambda chain: int(np.min(rank[chain])))
    order = np.concatenate(found)
    s = np.cumsum(np.concatenate([np.append(0.0, np.linalg.norm(np.diff(points[c], axis=0), axis=1)) for c in found]))
    first = np.sort(np.unique(order, return_index=True)[1])  # a vertex where two chains touch belongs to the first
    order, s = order[first], s[first]
    return order, s - s[np.argmin(rank[order])]
