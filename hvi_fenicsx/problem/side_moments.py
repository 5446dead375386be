"""Area, centroid and second moments of a boundary part, exact for plane facets."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem

from ..effects import SideMoments
from ..mesh import facets as facet_sizes
from ..typing import Array, Entities
from . import facet_integrals


def of(space: fem.FunctionSpace, facets: Entities) -> SideMoments:
    """The moments of a part. Collective.

    Args:
        space: of the displacements.
        facets: the part's local facets (owned and ghost).
    """
    own, d = facet_sizes.owned(space.mesh, facets), space.mesh.geometry.dim
    comm = space.mesh.comm
    if facet_integrals.is_curved(space):
        points, weights, _ = facet_integrals.samples(space, own)
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
