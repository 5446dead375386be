"""Area, centroid and second moments of a boundary part, exact for plane facets."""

from __future__ import annotations

import math

import dolfinx
import numpy as np

from ..effects import SideMoments
from ..mesh.domain import Domain
from ..typing import Array, Entities


def of(domain: Domain, facets: Entities) -> SideMoments:
    """The moments of a part. Collective.

    Args:
        domain: the body.
        facets: the part's local facets (owned and ghost).
    """
    d, comm = domain.dimension, domain.mesh.comm
    corners = _corners(domain, facets)
    areas = _areas(corners)
    area = float(comm.allreduce(float(areas.sum())))
    sums = comm.allreduce(np.einsum("f,fkd->d", areas, corners) / d)
    centroid = sums / area
    r = corners - centroid
    middle = r.sum(axis=1)
    products = np.einsum("fki,fkj->fij", r, r) + np.einsum("fi,fj->fij", middle, middle)
    second = comm.allreduce(np.einsum("f,fij->ij", areas, products) / (d * (d + 1)))
    return SideMoments(area=area, centroid=centroid, second=second)


def _corners(domain: Domain, facets: Entities) -> Array:
    """The vertices of this rank's facets, m, (f, d, d)."""
    d, mesh = domain.dimension, domain.mesh
    owned = facets[facets < mesh.topology.index_map(d - 1).size_local]
    if not len(owned):
        return np.empty((0, d, d))
    found = dolfinx.mesh.entities_to_geometry(mesh, d - 1, owned)
    return np.asarray(mesh.geometry.x[found][:, :, :d])


def _areas(corners: Array) -> Array:
    """Lengths or areas of simplices by Gram's determinant, (f,)."""
    edges = corners[:, 1:] - corners[:, :1]
    gram = np.einsum("fki,fli->fkl", edges, edges)
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(edges.shape[1]))
