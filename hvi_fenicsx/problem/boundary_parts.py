"""The boundary parts of a model: their facets, areas, centroids and second moments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from dolfinx import fem

from ..effects import Place, SideMoments
from ..errors import InputError
from ..mesh import facets as facet_sizes
from ..mesh.boundary_part import BoundaryPart
from ..mesh.domain import Domain
from ..runtime.mpi import agree
from ..typing import Array, Entities
from . import facet_overlaps
from .scaling import Placed


def find(domain: Domain, parts: Mapping[str, BoundaryPart], effects: Sequence[Placed]) -> dict[str, Entities]:
    """The local facets of each part. Collective.

    Args:
        domain: the body and its mesh.
        parts: by name.
        effects: with their places.

    Raises:
        InputError: on all ranks alike: a part without facets, or two pieces with one effect that share facets.
    """
    found = {name: part.facets(domain) for name, part in parts.items()}
    for name, part in parts.items():
        if not sum(agree(domain.mesh.comm, len(found[name]))):
            raise InputError(_empty(domain, name, part))
    _check_overlap(domain, found, effects)
    return found


def _empty(domain: Domain, name: str, part: BoundaryPart) -> str:
    """What is said of a part without facets. Collective."""
    if part.where is None:
        return f"boundary.{name}: no facet lies on it; see `on`"
    points = np.vstack(agree(domain.mesh.comm, _ends(domain, part)))
    low, high = points.min(axis=0), points.max(axis=0)
    ends = ", ".join(f"{axis} from {a:.4g} to {b:.4g} m" for axis, a, b in zip("xyz", low, high, strict=False))
    sides = ", ".join(part.on)
    return (
        f"boundary.{name}.where: no facet of {sides} has its midpoint where {part.where.source}; {sides} has {ends}; "
        "change the inequality, or take smaller cells"
    )


def _ends(domain: Domain, part: BoundaryPart) -> Array:
    """Lowest and highest corner of a part's sides on this rank, (2, d); no rows where it has none."""
    corners = facet_sizes.corners(domain.mesh, domain.facets(part.on)).reshape(-1, domain.dimension)
    return np.array([corners.min(axis=0), corners.max(axis=0)]) if len(corners) else corners


def _check_overlap(domain: Domain, facets: Mapping[str, Entities], effects: Sequence[Placed]) -> None:
    """A facet bears one effect of an exclusive kind. Collective."""
    placed = [(where, e) for where, e in effects if e.place is Place.BOUNDARY and e.exclusive and where is not None]
    pairs = [
        (one, other, effect.key)
        for (one, effect), (other, second) in combinations(placed, 2)
        if effect.key == second.key
    ]
    shared = [bool(len(np.intersect1d(facets[one], facets[other]))) for one, other, _ in pairs]
    anywhere = np.any(agree(domain.mesh.comm, shared), axis=0) if pairs else []
    for one, other, key in (pair for pair, here in zip(pairs, anywhere, strict=True) if here):
        raise InputError(f"boundary.{other}.{key}: shares facets with boundary.{one}, which has {key} already")


def of(space: fem.FunctionSpace, facets: Entities) -> SideMoments:
    """The moments of a part. Collective.

    Args:
        space: of the displacements.
        facets: the part's local facets (owned and ghost).
    """
    own, d = facet_sizes.owned(space.mesh, facets), space.mesh.geometry.dim
    comm = space.mesh.comm
    if facet_overlaps.is_curved(space):
        points, weights, _ = facet_overlaps.samples(space, own)
        return of_points(comm, points.reshape(-1, d), weights.ravel())
    return _of_corners(comm, facet_sizes.corners(space.mesh, own))


def of_points(comm: Any, points: Array, weights: Array) -> SideMoments:
    """The moments of weighted points of all ranks. Collective.

    Args:
        comm: the ranks.
        points: m, (p, d).
        weights: the area that each of them stands for, m² (m in 2D), (p,).
    """
    area = float(comm.allreduce(float(weights.sum())))
    centroid = comm.allreduce(weights @ points) / area
    r = points - centroid
    return SideMoments(area=area, centroid=centroid, second=comm.allreduce(np.einsum("p,pi,pj->ij", weights, r, r)))


def _of_corners(comm: Any, corners: Array) -> SideMoments:
    """The moments of plane facets of all ranks by their corners. Collective."""
    d, areas = corners.shape[2], facet_sizes.areas(corners)
    area = float(comm.allreduce(float(areas.sum())))
    sums = comm.allreduce(np.einsum("f,fkd->d", areas, corners) / d)
    centroid = sums / area
    r = corners - centroid
    middle = r.sum(axis=1)
    products = np.einsum("fki,fkj->fij", r, r) + np.einsum("fi,fj->fij", middle, middle)
    second = comm.allreduce(np.einsum("f,fij->ij", areas, products) / (d * (d + 1)))
    return SideMoments(area=area, centroid=centroid, second=second)
