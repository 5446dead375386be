"""The fields that ParaView opens: ``displacement.pvd`` on the body, ``contact.pvd`` on Γc, in SI. Collective."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem, la

from ..certify import placed_forces
from ..certify.contact_state import ContactState
from ..geometry import in_space
from ..mesh import nodes
from ..problem import spaces
from ..problem.problem import Problem
from ..problem.stress import von_mises
from ..report.solution_arrays import CONTACT_LENGTHS, CONTACT_STRESSES
from ..rigid import Mode
from ..typing import Array, Entities
from ..workflow import Solution
from . import vtk_files
from .gathering import columns_of
from .vtk_files import Entry, Grid

_STRESSES = ("stress", "von_mises", "inclusion_distance", "traction", *CONTACT_STRESSES)
_UNITS = dict.fromkeys(("displacement", *CONTACT_LENGTHS), "m") | dict.fromkeys(_STRESSES, "N/m²")


def write_body(path: Path, solution: Solution, stress: Array) -> None:
    """Write displacement and reaction by node; by part of a cell stress, strain, von Mises stress, estimated error.

    The error is that of the whole cell. Collective.

    Args:
        path: the file.
        solution: what was found.
        stress: in the parts of the cells that this rank owns, N/m², (c, 3, 3).

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    problem, solved = solution.problem, solution.solve_result
    assert solved is not None
    u = spaces.values(problem.space, solved.u.x.array) * problem.scales.displacement
    cells = {"von_mises": von_mises(stress), "stress": stress, "strain": _strain_of_parts(problem, u)}
    if (estimate := solution.estimate) is not None:
        cells["error"] = _in_parts(problem, estimate.cells / (estimate.energy_norm or 1.0))
    if len(problem.bodies.single()) > 1:
        cells["body"] = _in_parts(problem, problem.bodies.number_at(nodes.owned_cells(problem.space)[:, 0]))
    grid = _grid(problem, {"displacement": u, "reaction": _reactions(solution)}, cells)
    vtk_files.write(path, problem.comm, [(0.0, 0, "", grid)])


def _strain_of_parts(problem: Problem, u: Array) -> Array:
    """The symmetric gradient in the middles of the parts of the owned cells, (parts, 3, 3); none across a plane body.

    Args:
        problem: with the space.
        u: a displacement by its values at the nodes, (n, d).
    """
    space, d = problem.space, problem.dimension
    element = nodes.lagrange(d + 1, nodes.degree(space))
    slopes: Array = np.asarray(element.tabulate(1, nodes.middles_of_parts(space)[:, 1:]))[1:, :, :, 0]
    cells = nodes.owned_cells(space)
    found = np.zeros((len(cells), slopes.shape[1], 3, 3))
    positions, rises = (np.einsum("kpn,cni->cpki", slopes, v[cells, :d], optimize=True) for v in (problem.positions, u))
    gradient = np.linalg.solve(positions, rises)
    found[:, :, :d, :d] = (gradient + gradient.swapaxes(2, 3)) / 2
    return found.reshape(-1, 3, 3)


def _reactions(solution: Solution) -> Array:
    """The nodal forces of supports, contact and laws at all local vertices, N/m or N, (n, d). Collective."""
    problem = solution.problem
    assert solution.forces is not None
    reaction = fem.Function(problem.space)
    by_vertex = reaction.x.array.reshape(-1, problem.dimension)
    for part in solution.forces.reactions.values():
        by_vertex[part.blocks] += part.values * problem.scales.force
    reaction.x.scatter_forward()
    return by_vertex


def _in_parts(problem: Problem, values: npt.NDArray[Any]) -> Array:
    """The values of owned cells in their parts, (parts,)."""
    return np.repeat(values.astype(np.float64), nodes.parts_of_cell(problem.space))


def _grid(
    problem: Problem, at_points: Mapping[str, Array], in_cells: Mapping[str, Array], cells: Entities | None = None
) -> Grid:
    """Facets or the parts of owned cells, with fields at all local nodes and, in single precision, in the cells."""
    cells = nodes.linear_cells(problem.space) if cells is None else cells
    used = np.zeros(len(problem.positions), dtype=np.bool_)
    used[cells] = True  # marked, not sorted: that takes a tenth of the time
    return Grid(
        points=problem.positions[used],
        cells=(np.cumsum(used) - 1)[cells],
        at_points={name: v[used] if v.ndim == 1 else in_space(v[used]) for name, v in at_points.items()},
        in_cells={n: v.reshape(len(v), math.prod(v.shape[1:])).astype(np.float32) for n, v in in_cells.items()},
        units=_UNITS | {"reaction": "N/m" if problem.dimension == 2 else "N"},
    )


def write_series(path: Path, problem: Problem, states: Iterable[tuple[float, float, fem.Function]]) -> None:
    """Write displacements one after the other, with the load factor of each. Collective.

    Args:
        path: the file.
        problem: what was solved.
        states: time, factor and displacement (nondimensional) of each; times rise.

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    count = len(nodes.linear_cells(problem.space))

    def entries() -> Iterator[Entry]:
        for number, (time, factor, u) in enumerate(states):
            field = spaces.values(problem.space, u.x.array) * problem.scales.displacement
            grid = _grid(problem, {"displacement": field}, {"factor": np.full(count, factor)})
            yield time, 0, f"-{number:05d}", grid

    vtk_files.write(path, problem.comm, entries())


def write_escape(path: Path, problem: Problem, mode: Mode) -> None:
    """Write the rigid motion along which the body escapes, dimensionless. Collective.

    Args:
        path: the file.
        problem: what was to be solved.
        mode: the motion.

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    points = problem.points / problem.scales.length
    grid = _grid(problem, {"escape_mode": problem.bodies.motion(points, mode)}, {})
    vtk_files.write(path, problem.comm, [(0.0, 0, "", grid)])


def write_contact(path: Path, problem: Problem, states: Sequence[ContactState]) -> None:
    """Write Γc as a mesh of its own with nodal values; a vertex of two parts has those of the later one. Collective.

    The second sides of interfaces are a block of their own, with the tractions there.

    Args:
        path: the file.
        problem: what was solved.
        states: of the parts of Γc, at least one.

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    facets = np.unique(np.concatenate([state.surface.facets for state in states])).astype(np.int32)
    entries: list[Entry] = [(0.0, 0, "", _on_facets(problem, facets, _nodal(problem, states)))]
    if problem.interfaces:
        facets = problem.domain.facets([interface.sides.second for interface in problem.interfaces])
        second = _on_facets(problem, facets, {"traction": _second_tractions(problem, states)})
        entries.append((0.0, 1, "-second", second))
    vtk_files.write(path, problem.comm, entries)


def _on_facets(problem: Problem, facets: Entities, nodal: Mapping[str, Array]) -> Grid:
    """This rank's facets as a mesh of their own, with some values at all local nodes of the body."""
    mesh, d = problem.domain.mesh, problem.dimension
    owned = facets[facets < mesh.topology.index_map(d - 1).size_local]
    return _grid(problem, nodal, {}, nodes.linear_facets(problem.space, owned))


def _second_tractions(problem: Problem, states: Sequence[ContactState]) -> Array:
    """The tractions on the second sides of interfaces at all local nodes, N/m², (n, d). Collective."""
    found, owned = fem.Function(problem.space), placed_forces.second_tractions(problem, states)
    found.x.array[: owned.size] = owned.ravel() * problem.scales.stress
    found.x.scatter_forward()
    return found.x.array.reshape(-1, owned.shape[1])


def _nodal(problem: Problem, states: Sequence[ContactState]) -> dict[str, Array]:
    """By name, values at all local nodes of the body (NaN where there is none). Collective."""
    found: dict[str, la.Vector] = {}
    for state in states:
        for name, values in _fields(problem, state).items():
            if name not in found:
                found[name] = la.vector(problem.space.dofmap.index_map, 3 if values.ndim > 1 else 1)
                found[name].array[:] = np.nan
            width = found[name].block_size
            found[name].array.reshape(-1, width)[state.surface.blocks] = values.reshape(-1, width)
    for field in found.values():
        field.scatter_forward()
    return {name: field.array if field.block_size == 1 else field.array.reshape(-1, 3) for name, field in found.items()}


def _fields(problem: Problem, state: ContactState) -> dict[str, Array]:
    """The columns of ``contact.csv`` at a part's vertices, its normals and tangents, and what is of ParaView alone."""
    found: dict[str, Array] = dict.fromkeys(("gap", "contact"), np.full(len(state.pressure), np.nan))
    found |= {name: values for name, values in columns_of(problem, state).items() if name not in ("x", "y", "z")}
    tangents = np.moveaxis(state.surface.tangents, 1, 0)
    found |= {"normal": in_space(state.surface.normals)}
    found |= {f"t{i + 1}": in_space(tangent) for i, tangent in enumerate([*tangents])}
    if (both := state.of_both_modes) is not None:
        found["mode_mixity"] = both.slip_share
    distances = [law.term.multiplier * law.distance for law in state.laws] or [0.0 * state.pressure]
    return found | {"inclusion_distance": np.max(distances, axis=0) * problem.scales.stress}
