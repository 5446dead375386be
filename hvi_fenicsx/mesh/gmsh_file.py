"""Gmsh files (.msh, .geo) as domains: sides and regions by the names of physical groups."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..runtime.mpi import on_root
from . import gmsh_checks, gmsh_model
from .domain import Domain
from .gmsh_checks import DEFAULT, Thresholds

_MOST_STATEMENTS = 100
"""Statements of a broken file that gmsh's parser may still hold."""


def read(comm: MPI.Comm, path: Path, dimension: int, scale: float = 1.0, thresholds: Thresholds = DEFAULT) -> Domain:
    """The mesh of a file, its physical groups being sides and regions. Collective.

    Args:
        comm: the ranks that share the mesh.
        path: the file.
        dimension: of the cells, 2 or 3.
        scale: m per unit of the file's coordinates.
        thresholds: what makes a mesh unusable.

    Raises:
        InputError: on all ranks alike: not readable, no named groups, wrong dimension, no linear simplices, inverted
            or degenerate cells.
    """
    with gmsh_model.session(comm) as gmsh:
        names = on_root(comm, lambda: _open(gmsh, path, dimension, thresholds))
        mesh, sides, regions = gmsh_model.distribute(comm, gmsh, dimension, names)
    mesh.geometry.x[:] *= scale
    return Domain.from_mesh(mesh, sides, regions)


def _open(gmsh: Any, path: Path, dimension: int, thresholds: Thresholds) -> dict[int, dict[str, int]]:
    """Open the file in gmsh and check it; its physical groups by dimension and name. Rank 0 only."""
    if not path.is_file():
        raise InputError(f"mesh file {path}: there is no such file; give the path from the scene's folder")
    try:
        gmsh.open(str(path))
        if not len(gmsh.model.mesh.getNodes()[0]):
            gmsh.model.mesh.generate(dimension)
        _number_without_gaps(gmsh)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever is wrong with a file
        _empty_parser(gmsh)
        raise InputError(f"mesh file {path}: gmsh cannot read it: {error}") from None
    gmsh_checks.check(gmsh, path, dimension, thresholds)
    return {d: _names(gmsh, path, d) for d in (dimension - 1, dimension)}


def _empty_parser(gmsh: Any) -> None:
    """Empty gmsh's parser: the rest of a broken file stays in it, and would spoil the next file."""
    with tempfile.NamedTemporaryFile(mode="w", suffix=".geo") as empty:
        empty.write("nothing = 0;\n")  # a statement, which makes the parser read on
        empty.flush()
        for _ in range(_MOST_STATEMENTS):
            gmsh.finalize()  # without this, gmsh does not even look at the file
            gmsh_model.start(gmsh)
            with contextlib.suppress(Exception):
                gmsh.open(empty.name)
                return


def _number_without_gaps(gmsh: Any) -> None:
    """Number the nodes from 1 without gaps, which dolfinx demands: a file may have lost some with their cells."""
    tags = gmsh.model.mesh.getNodes()[0]
    if len(tags) and np.max(tags) != len(tags):
        gmsh.model.mesh.renumberNodes()


def _names(gmsh: Any, path: Path, dimension: int) -> dict[str, int]:
    """Tags of the physical groups of a dimension by name; a nameless one is called by its tag."""
    named = {gmsh.model.getPhysicalName(d, tag): tag for d, tag in gmsh.model.getPhysicalGroups(dimension)}
    for name, tag in named.items():
        if not len(gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)[0]):
            raise InputError(f"mesh file {path}: physical group {name!r} is empty; remove it or fill it")
    if not named:
        kind = "region" if dimension == gmsh.model.getDimension() else "boundary part"
        raise InputError(f"mesh file {path}: no physical group of dimension {dimension} (a {kind}); add one in gmsh")
    return {name or str(tag): tag for name, tag in named.items()}
