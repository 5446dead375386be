"""One code base for dolfinx 0.9 to 0.11: every difference between them lives here, found by feature."""

from __future__ import annotations

import re
from functools import cached_property
from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import common, fem, graph
from dolfinx import cpp as _cpp
from dolfinx import mesh as _mesh
from petsc4py import PETSc

VERSION: str = dolfinx.__version__


class _Domain(ufl.Mesh):
    """UFL's mesh, which makes its cell once: UFL asks for it many times in each form, and it has parts of its own."""

    @cached_property
    def _cell(self) -> Any:
        return super().ufl_cell()

    def ufl_cell(self) -> Any:
        """The kind of cell."""
        return self._cell


def geometry_dofmap(mesh: _mesh.Mesh) -> npt.NDArray[np.int32]:
    """Geometry nodes of each cell, shape (cells, nodes)."""
    geometry = mesh.geometry
    return geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap


def geometry_degree(mesh: _mesh.Mesh) -> int:
    """Degree of the cells' shape: 1 where they are straight."""
    geometry = mesh.geometry
    return int((geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap).degree)


def local_entities(
    mesh: _mesh.Mesh, dimension: int, nodes: npt.NDArray[np.int64], tags: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """The local entities that some of the input's entities have become, with their tags. Collective.

    Args:
        mesh: the mesh.
        dimension: of the entities.
        nodes: of each entity, numbered as when the mesh was made, (n, dimension + 1); on any rank.
        tags: a number for each entity, (n,).
    """
    vertices, values = dolfinx.io.distribute_entity_data(mesh, dimension, nodes, tags)
    mesh.topology.create_connectivity(dimension, 0)
    mesh.topology.create_connectivity(dimension, mesh.topology.dim)
    found = _mesh.meshtags_from_entities(mesh, dimension, graph.adjacencylist(vertices), values.astype(np.int32))
    return found.indices, found.values


def refine(mesh: _mesh.Mesh, edges: npt.NDArray[np.int32] | None) -> tuple[_mesh.Mesh, npt.NDArray[np.int32]]:
    """Bisect edges by Plaza's rule; children stay on the ranks of their parents. Collective.

    Args:
        mesh: the coarse one.
        edges: local numbers; None: all edges.

    Returns:
        The fine mesh, without ghost cells, and the local parent cell of each local cell.
    """
    mesh.topology.create_entities(1)
    fine, parents = _mesh.refine(mesh, edges, None, _mesh.RefinementOption.parent_cell)[:2]
    offset = mesh.comm.exscan(len(parents)) or 0  # parents come in input order
    domain = _Domain(fine.ufl_domain().ufl_coordinate_element())
    fine = _mesh.Mesh(fine._cpp_object, domain)
    return fine, np.asarray(parents[fine.topology.original_cell_index - offset], dtype=np.int32)


def simplex_mesh(
    comm: Any,
    cells: npt.NDArray[Any],
    points: npt.NDArray[np.floating],
    kind: str,
    *,
    spread: bool = False,
    degree: int = 1,
) -> _mesh.Mesh:
    """Mesh of the simplices (c, nodes) over points (n, d), each rank giving some of both. Collective.

    Args:
        comm: the ranks.
        cells: numbers of points, counted through the ranks.
        points: each of them once, on any rank.
        kind: interval, triangle or tetrahedron.
        spread: whether the cells are shared among the ranks; else each stays where it is given.
        degree: of the shape of the cells.

    Returns:
        The mesh, without ghost cells.
    """
    import basix.ufl

    element = basix.ufl.element("Lagrange", kind, degree, shape=(points.shape[1],))

    def stay(_: Any, ranks: int, types: Any, vertices: Any) -> Any:
        places = graph.adjacencylist(np.full((len(cells), 1), comm.rank, dtype=np.int32))
        return getattr(places, "_cpp_object", places)

    cells, points = np.asarray(cells, dtype=np.int64), np.ascontiguousarray(points)
    # with one rank and no partitioner, dolfinx does not even distribute
    partitioner = stay if comm.size > 1 and not spread else None
    return _mesh.create_mesh(comm, cells=cells, x=points, e=_Domain(element), partitioner=partitioner)


TAKES_TOPOLOGY = hasattr(_cpp.mesh.Topology, "set_index_map")
"""Whether this dolfinx takes a topology that is made elsewhere."""


def mesh_of_cells(
    comm: Any,
    points: npt.NDArray[np.floating],
    cells: npt.NDArray[np.int32],
    *,
    index_map: tuple[int, npt.NDArray[np.int64], npt.NDArray[np.int32]],
    inputs: npt.NDArray[np.int64],
    facets: tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]] | None = None,
) -> _mesh.Mesh:
    """The mesh of cells that stay where they are, in their order: dolfinx would send and reorder them. Collective.

    Args:
        comm: the ranks.
        points: this rank's vertices, (n, d).
        cells: its simplices by these, (c, d+1).
        index_map: how many vertices it owns, which come first; the global numbers of the others, and their owners.
        inputs: a number of each vertex that all ranks know, (n,).
        facets: by their vertices, (f, d), and those of each cell, (c, d+1), facet i being opposite to vertex i; of one
            rank only. None: dolfinx looks for them.
    """
    (n, d), kind = points.shape, {2: _mesh.CellType.triangle, 3: _mesh.CellType.tetrahedron}[points.shape[1]]
    topology = _cpp.mesh.Topology(comm, kind)
    vertices = common.IndexMap(comm, *index_map)
    own = np.arange(n, dtype=np.int32)[:, None]
    maps = {0: vertices, d: common.IndexMap(comm, len(cells))}
    links = [(own, 0, 0), (cells, d, 0)]
    if facets is not None:
        maps[d - 1] = common.IndexMap(comm, len(facets[0]))
        links += [(facets[0], d - 1, 0), (facets[1], d, d - 1)]
    for dimension, entities in maps.items():
        topology.set_index_map(dimension, entities)
    for array, start, end in links:
        found = graph.adjacencylist(array)
        topology.set_connectivity(getattr(found, "_cpp_object", found), start, end)
    return _with_nodes(topology, kind.name, 1, vertices, cells, points, inputs)


def _with_nodes(
    topology: Any, kind: str, degree: int, index_map: Any, cells: Any, nodes: npt.NDArray[np.floating], inputs: Any
) -> _mesh.Mesh:
    """The mesh of a topology whose cells have these nodes, (n, d), numbered as given."""
    import basix.ufl

    element = basix.ufl.element("Lagrange", kind, degree, shape=(nodes.shape[1],))
    shape = fem.coordinate_element(element.basix_element)._cpp_object
    geometry = _cpp.mesh.Geometry_float64(index_map, cells, shape, nodes, inputs)
    return _mesh.Mesh(_cpp.mesh.Mesh_float64(topology.comm, topology, geometry), _Domain(element))


def quadratic_mesh(mesh: _mesh.Mesh, dofmap: Any, points: npt.NDArray[np.floating]) -> _mesh.Mesh:
    """A mesh of the same topology whose cells are of second order. Collective.

    Args:
        mesh: of straight simplices.
        dofmap: of the scalar functions of degree 2 on it.
        points: the local nodes by this dofmap, m, (n, 3).
    """
    d, index_map = mesh.geometry.dim, dofmap.index_map
    numbers = index_map.local_to_global(np.arange(len(points), dtype=np.int32))
    topology, nodes = getattr(mesh.topology, "_cpp_object", mesh.topology), np.ascontiguousarray(points[:, :d])
    return _with_nodes(topology, mesh.topology.cell_name(), 2, index_map, dofmap.list, nodes, numbers)


def linear_mesh(mesh: _mesh.Mesh) -> _mesh.Mesh:
    """A mesh of the same topology whose cells are straight.

    Args:
        mesh: of simplices of any order.
    """
    d, topology = mesh.geometry.dim, getattr(mesh.topology, "_cpp_object", mesh.topology)
    index_map, cells = topology.index_map(0), mesh.topology.connectivity(d, 0).array.reshape(-1, d + 1)
    numbers = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    nodes = np.empty((len(numbers), d))
    nodes[cells] = mesh.geometry.x[geometry_dofmap(mesh)[: len(cells), : d + 1], :d]
    inputs = index_map.local_to_global(numbers)
    return _with_nodes(topology, mesh.topology.cell_name(), 1, index_map, cells, nodes, inputs)


def same_topology(one: _mesh.Mesh, other: _mesh.Mesh) -> bool:
    """Whether two meshes share their cells and facets, and so the numbers of them.

    Args:
        one: a mesh.
        other: another.
    """
    return bool(one._cpp_object.topology is other._cpp_object.topology)


def comm_of(form: Any) -> Any:
    """The ranks of the mesh that a UFL form is integrated over."""
    return next(iter(form.subdomain_data())).ufl_cargo().comm


def petsc_version() -> str:
    """PETSc's version, as text."""
    return ".".join(str(n) for n in PETSc.Sys.getVersion())


def _not_a_number() -> int:
    """SNES' reason for a residual that is no number: the only one whose name tells of NaN and of the function."""
    names = (name for name in dir(PETSc.SNES.ConvergedReason) if re.fullmatch("DIVERGED_F.*NAN.*", name))
    return int(getattr(PETSc.SNES.ConvergedReason, next(names)))


NOT_A_NUMBER = _not_a_number()


def expression(value: Any, space: Any) -> Any:
    """A UFL expression that functions of a space can interpolate.

    Args:
        value: in UFL.
        space: of the functions.
    """
    points = space.element.interpolation_points
    return fem.Expression(value, points() if callable(points) else points, comm=space.mesh.comm)
