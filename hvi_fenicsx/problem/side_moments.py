"""Area, centroid and second moments of a boundary part, exact for plane facets."""

from __future__ import annotations

import numpy as np

from ..effects import SideMoments
from ..mesh import facet_sizes
from ..mesh.domain import Domain
from ..typing import Entities


def of(domain: Domain, facets: Entities) -> SideMoments:
    """The moments of a part. Collective.

    Args:
        domain: the body.
        facets: the part's local facets (owned and ghost).
    """
    d, comm = domain.dimension, domain.mesh.comm
    corners = facet_sizes.corners(domain.mesh, facet_sizes.owned(domain.mesh, facets))
    areas = facet_sizes.areas(corners)
    area = float(comm.allreduce(float(areas.sum())))
    sums = comm.allreduce(np.einsum("f,fkd->d", areas, corners) / d)
    centroid = sums / area
    r = corners - centroid
    middle = r.sum(axis=1)
    products = np.einsum("fki,fkj->fij", r, r) + np.einsum("fi,fj->fij", middle, middle)
    second = comm.allreduce(np.einsum("f,fij->ij", areas, products) / (d * (d + 1)))
    return SideMoments(area=area, centroid=centroid, second=second)
