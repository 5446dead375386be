"""A coarser mesh of a plane body, made by gmsh within its thinned outline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from .. import compat
from ..runtime.mpi import on_root
from ..typing import Entities, Integers
from . import gmsh_arrays, gmsh_model, thinned_outline
from .domain import Domain
from .facets import cell_facets
from .thinned_outline import NONE, HalfEdges, ThinnedOutline
from .thresholds import DEFAULT, Thresholds

_UNNAMED = ""


def coarsen(domain: Domain, factor: float, thresholds: Thresholds = DEFAULT) -> Domain | None:
    """The plane body on a mesh of longer edges. Collective.

    Args:
        domain: the body.
        factor: by which edges get longer, about.
        thresholds: which vertices of the outline are kept, and how far the areas may differ.

    Returns:
        None where gmsh cannot mesh the thinned outline, or where its area differs too much.
    """
    comm, sides, regions = domain.mesh.comm, sorted(domain.sides), sorted(domain.regions)
    parts = comm.gather(_half_edges(domain, sides, regions))
    with gmsh_model.session(comm) as gmsh:
        names = on_root(comm, lambda: _mesh(gmsh, _outline(parts, factor, thresholds), sides, regions))
        if names is None:
            return None
        mesh, found, within = gmsh_model.distribute(comm, gmsh and gmsh_arrays.extract(gmsh, 2), 2, names)
    mesh.geometry.x[:] *= domain.length
    return replace(domain, mesh=mesh, sides=found, regions={name: within[name] for name in regions}, shared=None)


def _half_edges(domain: Domain, sides: Sequence[str], regions: Sequence[str]) -> HalfEdges:
    """This rank's edges without a second cell, on a side, or between regions; lengths relative to the body's."""
    mesh = domain.mesh
    facets, nodes = cell_facets(mesh), compat.geometry_dofmap(mesh)
    region = _numbered(domain.regions, regions, len(facets))
    side = _numbered(domain.sides, sides, facets.max(initial=-1) + 1)
    cells = np.repeat(np.arange(len(facets)), 3)
    own = facets.ravel()
    alone = np.bincount(own, minlength=len(side)) == 1
    least, most = np.full(len(side), len(regions)), np.full(len(side), NONE)
    np.minimum.at(least, own, region[cells])
    np.maximum.at(most, own, region[cells])
    cell, i = np.divmod(np.flatnonzero((alone | (side != NONE) | (least != most))[own]), 3)
    ends = np.stack([nodes[cell, (i + 1) % 3], nodes[cell, (i + 2) % 3]], axis=1)
    x = mesh.geometry.x[:, :2] / domain.length
    (ax, ay), (bx, by) = (x[ends[:, 1]] - x[ends[:, 0]]).T, (x[nodes[cell, i]] - x[ends[:, 0]]).T
    ends = np.where((ax * by < ay * bx)[:, None], ends[:, ::-1], ends)  # the cell to the left
    numbers = mesh.geometry.index_map().local_to_global(ends.ravel().astype(np.int32)).reshape(-1, 2)
    return HalfEdges(numbers, x[ends], region[cell], side[facets[cell, i]])


def _numbered(named: Mapping[str, Entities], names: Sequence[str], size: int) -> Integers:
    """For each entity the number of its name, or NONE."""
    numbers = np.full(size, NONE)
    for number, name in enumerate(names):
        numbers[named[name]] = number
    return numbers


def _outline(parts: Sequence[HalfEdges] | None, factor: float, thresholds: Thresholds) -> ThinnedOutline | None:
    return thinned_outline.trace(HalfEdges.joined(parts or []), factor, thresholds)


def _mesh(
    gmsh: Any, thinned: ThinnedOutline | None, sides: Sequence[str], regions: Sequence[str]
) -> dict[int, dict[str, int]] | None:
    """Mesh the thinned outline in gmsh; its physical groups, or None where it cannot. On gmsh's rank."""
    if thinned is None:
        return None
    groups = _draw(gmsh, thinned, [*sides], [*regions, _UNNAMED])
    try:
        gmsh.model.mesh.generate(2)
    except Exception:
        # gmsh raises bare Exceptions, whatever it is that it cannot mesh
        return None
    return groups


def _draw(gmsh: Any, thinned: ThinnedOutline, sides: list[str], regions: list[str]) -> dict[int, dict[str, int]]:
    """Draw the outline in gmsh, each of its edges one edge of a cell; the physical groups by dimension and name.

    Cells of no region are in the region of the last name.
    """
    geo = gmsh.model.geo
    kept = sorted({v for chain in thinned.chains for v in chain.vertices})
    points = {v: geo.addPoint(*thinned.places[v], 0.0) for v in kept}
    edges = [(a, b, chain.side) for chain in thinned.chains for a, b in pairwise(chain.vertices)]
    lines: dict[tuple[int, int], int] = {}
    by_side: dict[int, list[int]] = {}
    for a, b, side in edges:
        line = geo.addLine(points[a], points[b])
        lines |= {(a, b): line, (b, a): -line}
        by_side.setdefault(side, []).append(line)
    by_side.pop(NONE, None)
    surfaces: dict[int, list[int]] = {}
    for face in thinned.faces:
        loops = [geo.addCurveLoop([lines[pair] for pair in pairwise([*ring, ring[0]])]) for ring in face.rings]
        surfaces.setdefault(face.region, []).append(geo.addPlaneSurface(loops))
    geo.synchronize()
    for a, b, _ in edges:
        gmsh.model.mesh.setTransfiniteCurve(lines[a, b], 2)
    add = gmsh.model.addPhysicalGroup
    return {
        1: {sides[number]: add(1, found) for number, found in by_side.items()},
        2: {regions[number]: add(2, found) for number, found in surfaces.items()},
    }
