"""A mesh hierarchy for a mesh that has none: coarser meshes of the same body, made by gmsh.

In the plane gmsh makes one within a thinned outline (:mod:`.coarsening_2d`); in space it meshes the body within its
surface anew (:mod:`.coarsening_3d`). Only that coarsest mesh is made by gmsh; the meshes between are its refinements,
so the only step that is not nested is the last, onto the mesh itself. These meshes give a start value and a
preconditioner; solutions are those of the mesh itself.

A mesh in several pieces, such as a joint in one file, has the hierarchy of each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import coarsening_2d, coarsening_3d, connected_pieces, refinement
from .connected_pieces import Piece
from .domain import Domain
from .joined import PlacedBody, coarsening
from .thresholds import DEFAULT, Thresholds
from .transfer import InterpolationTransfer


def with_hierarchy(domain: Domain, thresholds: Thresholds = DEFAULT) -> Domain:
    """The domain with coarser levels, where it is large enough and gmsh can make them. Collective.

    Args:
        domain: on any mesh; a domain that has a mesh hierarchy keeps it.
        thresholds: from which size on, and how coarse.
    """
    d, unknowns = domain.dimension, _unknowns(domain)
    if domain.coarsening is not None or unknowns < thresholds.hierarchy_from:
        return domain
    if len(found := connected_pieces.pieces(domain)) > 1:
        return _in_pieces(domain, found, thresholds)
    domain = replace(domain, one_piece=True)  # known from now on
    factor = 2.0 ** max(1, round(np.log2(unknowns / thresholds.coarsest) / d))
    coarsen = coarsening_2d.coarsen if d == 2 else coarsening_3d.coarsen
    coarsest = coarsen(domain, factor, thresholds)
    if coarsest is None:
        return domain
    growth = unknowns / _unknowns(coarsest)  # round bodies may need more vertices
    coarser = refinement.repeated(coarsest, max(0, round(np.log2(growth) / d) - 1))
    return replace(domain, coarsening=lambda: (coarser, InterpolationTransfer()))


def with_hierarchies(domains: Sequence[Domain], thresholds: Thresholds = DEFAULT) -> list[Domain]:
    """The domains of bodies that are solved together, with coarser levels: it is their common size that counts.

    A small body beside a large one has coarser levels too, or it would be a large part of the coarsest common level,
    whose matrix is factorised. Collective.

    Args:
        domains: of the bodies; one that has a mesh hierarchy keeps it.
        thresholds: from which size on, and how coarse.
    """
    if sum(_unknowns(domain) for domain in domains) < thresholds.hierarchy_from:
        return list(domains)
    each = replace(thresholds, hierarchy_from=thresholds.coarsest)
    return [with_hierarchy(domain, each) for domain in domains]


def _unknowns(domain: Domain) -> int:
    """Displacements at the vertices."""
    return int(domain.dimension * domain.mesh.topology.index_map(0).size_global)


def _in_pieces(domain: Domain, pieces: Sequence[Piece], thresholds: Thresholds) -> Domain:
    """The domain with the coarser meshes of its pieces; those that have none stay as they are. Collective."""
    d = domain.dimension
    domains = with_hierarchies([piece.domain for piece in pieces], thresholds)
    bodies = [PlacedBody(name="", domain=one, origin=np.zeros(d), rotation=np.eye(d)) for one in domains]
    return replace(domain, coarsening=coarsening(domain.mesh, bodies, [piece.numbers for piece in pieces]))
