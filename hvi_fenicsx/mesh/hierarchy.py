"""A mesh hierarchy for a mesh that has none: coarser meshes of the same body, made by gmsh.

In the plane gmsh makes one within a thinned outline (:mod:`.coarsening_2d`); in space it meshes the body within its
surface anew (:mod:`.coarsening_3d`). Only that coarsest mesh is made by gmsh; the meshes between are its refinements,
so the only step that is not nested is the last, onto the mesh itself. These meshes give a start value and a
preconditioner; solutions are those of the mesh itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import coarsening_2d, coarsening_3d, refinement
from .domain import Domain
from .thresholds import DEFAULT, Thresholds
from .transfer import InterpolationTransfer


def with_hierarchy(domain: Domain, thresholds: Thresholds = DEFAULT) -> Domain:
    """The domain with coarser levels, where it is large enough and gmsh can make them. Collective.

    Args:
        domain: on any mesh; a domain that has a mesh hierarchy keeps it.
        thresholds: from which size on, and how coarse.
    """
    d = domain.dimension
    unknowns = d * domain.mesh.topology.index_map(0).size_global
    if domain.coarsening is not None or unknowns < thresholds.hierarchy_from:
        return domain
    factor = 2.0 ** round(np.log2(unknowns / thresholds.coarsest) / d)
    coarsen = coarsening_2d.coarsen if d == 2 else coarsening_3d.coarsen
    coarsest = coarsen(domain, factor, thresholds)
    if coarsest is None:
        return domain
    growth = unknowns / (d * coarsest.mesh.topology.index_map(0).size_global)  # round bodies may need more vertices
    coarser = refinement.repeated(coarsest, max(0, round(np.log2(growth) / d) - 1))
    return replace(domain, coarsening=lambda: (coarser, InterpolationTransfer()))
