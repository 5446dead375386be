"""The fields that ParaView opens: ``displacement.pvd`` on the body, ``contact.pvd`` on Γc, in SI. Collective."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from dolfinx.io import VTKFile

from .. import compat
from ..certify.contact_state import ContactState
from ..errors import InputError
from ..mesh.vertex_dofs import dof_of_node
from ..problem.problem import Problem
from ..problem.spaces import scalar_space
from ..problem.stress import von_mises
from ..rigid import Mode
from ..runtime.mpi import agree
from ..solution import Solution
from ..typing import Array


def write_body(path: Path, solution: Solution, stress: Array) -> None:
    """Write displacement and reaction by vertex; by cell stress, von Mises stress, estimated error.

    Collective.

    Args:
        path: the file.
        solution: what was found.
        stress: of the cells that this rank owns, N/m², (c, 3, 3).

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    problem, solved, forces = solution.problem, solution.solve_result, solution.forces
    assert solved is not None
    assert forces is not None
    u = fem.Function(problem.space, name="displacement")
    u.x.array[:] = solved.u.x.array * problem.scales.displacement
    reaction = fem.Function(problem.space, name="reaction")
    by_vertex = reaction.x.array.reshape(-1, problem.scales.dimension)
    for part in forces.reactions.values():
        by_vertex[part.blocks] += part.values * problem.scales.force
    reaction.x.scatter_forward()
    by_cell = {"von_mises": von_mises(stress), "stress": stress}
    if (estimate := solution.estimate) is not None:
        by_cell["error"] = np.asarray(estimate.cells / (estimate.energy_norm or 1.0), dtype=np.float64)
    constant = [_constant(problem.domain.mesh, name, values) for name, values in by_cell.items()]
    _write(path, problem.domain.mesh, [u, reaction, *constant])


def _constant(mesh: dmesh.Mesh, name: str, values: Array) -> fem.Function:
    """A field that is constant in each cell, of values at the owned cells, (c, ...). Collective.

    More than seven digits of them say nothing, and their text takes twice as long to write.
    """
    field = fem.Function(fem.functionspace(mesh, ("Discontinuous Lagrange", 0, values.shape[1:])), name=name)
    field.x.array[: values.size] = _rounded(values, 7).ravel()
    field.x.scatter_forward()
    return field


def _rounded(values: Array, digits: int) -> Array:
    """Values with so many digits beside the largest entry of their row, (c, ...), so that rounding is no value."""
    largest = np.abs(values).max(axis=tuple(range(1, values.ndim)), initial=0.0, keepdims=True)
    size = np.where(largest > 0.0, largest, 1.0)
    unit = 10.0 ** (digits - 1 - np.floor(np.log10(size)))
    return np.asarray(np.round(values * unit) / unit)


def write_escape(path: Path, problem: Problem, mode: Mode) -> None:
    """Write the rigid motion along which the body escapes, dimensionless. Collective.

    Args:
        path: the file.
        problem: what was to be solved.
        mode: the motion.

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    field = fem.Function(problem.space, name="escape_mode")
    points = np.asarray(problem.points / problem.scales.length)
    field.x.array[:] = problem.bodies.motion(points, mode).ravel()
    _write(path, problem.domain.mesh, [field])


def write_contact(path: Path, problem: Problem, states: Sequence[ContactState]) -> None:
    """Write Γc as a mesh of its own with nodal values; a vertex of two parts has those of the later one. Collective.

    Args:
        path: the file.
        problem: what was solved.
        states: of the parts of Γc, at least one.

    Raises:
        InputError: it cannot be written, on all ranks alike.
    """
    mesh, d = problem.domain.mesh, problem.scales.dimension
    facets = np.unique(np.concatenate([s.facets for s in (state.surface for state in states)])).astype(np.int32)
    surface, nodes = compat.submesh_nodes(mesh, d - 1, facets)
    parent = dof_of_node(problem.space)[nodes]
    space = fem.functionspace(surface, ("Lagrange", 1))
    target = dof_of_node(space)
    fields = []
    for name, values in _nodal(problem, states).items():
        field = fem.Function(space, name=name)
        field.x.array[target] = values[parent]
        fields.append(field)
    _write(path, surface, fields)


def _nodal(problem: Problem, states: Sequence[ContactState]) -> dict[str, Array]:
    """By name, values at all local vertices of the body (NaN where there is none). Collective."""
    scalar = scalar_space(problem.domain.mesh)
    u, p = problem.scales.displacement, problem.scales.stress
    found: dict[str, fem.Function] = {}

    def put(name: str, state: ContactState, values: Array) -> None:
        if name not in found:
            found[name] = fem.Function(scalar)
            found[name].x.array[:] = np.nan
        found[name].x.array[state.surface.blocks] = values

    for state in states:
        put("u_n", state, state.normal * u)
        put("sigma_n", state, state.pressure * p)
        put("gap", state, state.gap * u)
        put("contact", state, state.contact.astype(float))
        for i in range(problem.scales.dimension - 1):
            put(f"u_t{i + 1}", state, state.slip[:, i] * u)
            put(f"friction_t{i + 1}", state, state.friction[:, i] * p)
        distances = [law.distance for law in state.laws]
        put("inclusion_distance", state, np.max(distances, axis=0) * p if distances else 0.0 * state.normal)
    for field in found.values():
        field.x.scatter_forward()
    return {name: field.x.array for name, field in found.items()}


def _write(path: Path, mesh: dmesh.Mesh, fields: Sequence[fem.Function]) -> None:
    if faults := [fault for fault in agree(mesh.comm, _fault(path, mesh, fields)) if fault]:
        raise InputError(f"{path.name}: {faults[0]} Is the disk full?")


def _fault(path: Path, mesh: dmesh.Mesh, fields: Sequence[fem.Function]) -> str | None:
    """Write a file; what went wrong. The writer dies with this frame: it would write again when it is collected."""
    try:
        with VTKFile(mesh.comm, str(path), "w") as file:
            file.write_function(list(fields), 0.0)
    except RuntimeError as error:
        return str(error)
    return None
