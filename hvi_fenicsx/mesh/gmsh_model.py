"""Gmsh files (.msh, .geo) read into dolfinx: boundary parts and regions by the names of physical groups."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..errors import InputError
from ..runtime.mpi import on_root
from ..typing import Entities
from . import gmsh_checks

_MOST_REMNANTS = 100
_FLAT = 1e-9
"""Ratio of a cell's inscribed to its circumscribed sphere (1 for an equilateral one), below which it has no volume."""
_LARGEST = 1e12
"""Of a coordinate, in the file's unit."""
_SIMPLEX = {2: 2, 3: 4}
"""Gmsh's element type of the linear simplex, by dimension."""


def read(
    comm: MPI.Comm, path: Path, dimension: int
) -> tuple[dmesh.Mesh, Mapping[str, Entities], Mapping[str, Entities]]:
    """Mesh, boundary parts and regions (local entities by name) of a gmsh file. Collective.

    Raises:
        InputError: on all ranks alike: not readable, no named groups, wrong dimension, not linear simplices,
            inverted or degenerate cells.
    """
    with session(comm) as gmsh:
        names = on_root(comm, lambda: _open(gmsh, path, dimension))
        return distribute(comm, gmsh, dimension, names)


def distribute(
    comm: MPI.Comm, gmsh: Any, dimension: int, names: Mapping[int, Mapping[str, int]]
) -> tuple[dmesh.Mesh, Mapping[str, Entities], Mapping[str, Entities]]:
    """The mesh open in rank 0's gmsh, as :func:`read` gives it. Collective.

    Args:
        comm: all ranks. gmsh: see :func:`session`. dimension: of the cells.
        names: of physical groups of facets and of cells with their tags, by dimension; on all ranks.
    """
    model = gmsh.model if comm.rank == 0 else None
    mesh, cell_tags, facet_tags = compat.mesh_from_gmsh(model, comm, 0, dimension)
    mesh.topology.create_connectivity(dimension - 1, dimension)
    return mesh, _by_name(facet_tags, names[dimension - 1]), _by_name(cell_tags, names[dimension])


@contextmanager
def session(comm: MPI.Comm) -> Iterator[Any]:
    """Gmsh, started on rank 0 only (None elsewhere) and always finalised."""
    if comm.rank != 0:
        yield None
        return
    import gmsh

    _start(gmsh)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def _start(gmsh: Any) -> None:
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)


def _open(gmsh: Any, path: Path, dimension: int) -> dict[int, dict[str, int]]:
    if not path.is_file():
        raise InputError(f"mesh file {path}: there is no such file; give the path from the scene's folder")
    try:
        gmsh.open(str(path))
        if not len(gmsh.model.mesh.getNodes()[0]):
            gmsh.model.mesh.generate(dimension)
        _close_ranks(gmsh)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever is wrong with a file
        _drain(gmsh)
        raise InputError(f"mesh file {path}: gmsh cannot read it: {error}") from None
    _check_cells(gmsh, path, dimension)
    gmsh_checks.check(gmsh, path, dimension)
    return {d: _names(gmsh, path, d) for d in (dimension - 1, dimension)}


def _drain(gmsh: Any) -> None:
    """Empty gmsh's parser: the rest of a broken file stays in it, and the next file would stumble over that."""
    with tempfile.NamedTemporaryFile(mode="w", suffix=".geo") as nothing:
        nothing.write("nothing = 0;\n")  # a statement, which makes the parser read on
        nothing.flush()
        for _ in range(_MOST_REMNANTS):
            gmsh.finalize()  # without this, gmsh does not even look at the file
            _start(gmsh)
            with contextlib.suppress(Exception):
                gmsh.open(nothing.name)
                return


def _close_ranks(gmsh: Any) -> None:
    """Number the nodes from 1 without gaps, which dolfinx demands: a file may have lost some with their cells."""
    tags = gmsh.model.mesh.getNodes()[0]
    if len(tags) and np.max(tags) != len(tags):
        gmsh.model.mesh.renumberNodes()


def _names(gmsh: Any, path: Path, dimension: int) -> dict[str, int]:
    named = {gmsh.model.getPhysicalName(d, tag): tag for d, tag in gmsh.model.getPhysicalGroups(dimension)}
    for name, tag in named.items():
        if not len(gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)[0]):
            raise InputError(f"mesh file {path}: physical group {name!r} is empty; remove it or fill it")
    if not named:
        kind = "region" if dimension == gmsh.model.getDimension() else "boundary part"
        raise InputError(f"mesh file {path}: no physical group of dimension {dimension} (a {kind}); add one in gmsh")
    return {name or str(tag): tag for name, tag in named.items()}


def _check_cells(gmsh: Any, path: Path, dimension: int) -> None:
    if gmsh.model.getDimension() != dimension:
        found = gmsh.model.getDimension()
        raise InputError(f"mesh file {path}: its cells have dimension {found}, the material's model wants {dimension}")
    types, tags, _ = gmsh.model.mesh.getElements(dimension)
    if list(types) != [_SIMPLEX[dimension]]:
        shape = "triangles" if dimension == 2 else "tetrahedra"
        raise InputError(f"mesh file {path}: linear {shape} only; remesh with order 1 and without recombination")
    _check_points(gmsh, path, dimension)
    quality = np.abs(gmsh.model.mesh.getElementQualities(tags[0], "gamma"))
    if not np.all(quality > _FLAT):
        bad = int(np.argmin(quality))
        raise InputError(f"mesh file {path}: cell {tags[0][bad]} has no volume; remesh")


def _check_points(gmsh: Any, path: Path, dimension: int) -> None:
    points = np.asarray(gmsh.model.mesh.getNodes()[1]).reshape(-1, 3)
    if not np.all(np.isfinite(points)):
        raise InputError(f"mesh file {path}: a node's coordinates are not finite numbers")
    if np.max(np.abs(points)) > _LARGEST:
        raise InputError(f"mesh file {path}: a node's coordinate is beyond ±{_LARGEST:g}; remesh near the origin")
    if dimension == 2 and np.ptp(points[:, 2]) > 1e-12 * np.ptp(points[:, :2]):
        raise InputError(f"mesh file {path}: a 2D mesh must lie in a plane z = constant")


def _by_name(tags: Any, names: Mapping[str, int]) -> dict[str, Entities]:
    return {name: tags.find(tag) for name, tag in names.items()}
