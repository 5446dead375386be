"""The numbers that tune how a problem is composed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CompositionThresholds:
    """What counts as rounding, and what a law's traction is judged by.

    Attributes:
        same: difference of two prescribed displacements, relative to the largest, of two vertices, over the body's
            length, or of normals (rad), up to which they are the same: a part is flat, two parts orthogonal or equal.
        rounding: relative rounding of the mesh's coordinates, and of a direction that the scene states; part of a facet
            that is too little to lie over another one.
        uneven: angle by which the normal of a part that is not flat may be turned at a vertex that it shares with
            another part or with a prescribed component: few digits in the coordinates explain so much.
        turned_to_prescribed: the same for a flat part at a prescribed component. Contact stays exact; a law sees the
            square of this angle.
        outside_bounds: distance (of u0) by which a prescribed displacement may be outside of a contact bound.
        largest_scale: of stresses (N/m²) and displacements (m); its inverse is the smallest. Energies are products of
            both, so beyond this they are no numbers any more.
        law_scale: smallest scale of a law's traction, in units of the load's stress: a weaker law is not judged finer.
        facing: cosine of the largest angle between the normal of a facet and that against the one that it meets.
        uncovered: part of a facet at its end that may lie beyond the other side.
        rim: part of a facet by which the rims of curved sides may be apart and are still one.
        rim_parts: chords that stand for a curved edge at the end of a side.
        curved_degree: of the quadrature where curved facets lie over each other in space.
        overlap: part of a facet's length by which bodies may overlap: curved sides that touch do so by less.
        least_force: forces that are a smaller part of stiffness times displacement are not judged finer.
        travel: a body that travels so many times its deformation has stresses without this travel: to take it off
            rounds too, so of other bodies it is not taken off.
        piece: cells at most over which a form goes at once where it goes over a mesh in pieces: dolfinx copies the
            coefficients of all of them.
    """

    same: float = 1e-8
    rounding: float = 1e-14
    uneven: float = 0.02
    turned_to_prescribed: float = 1e-4
    outside_bounds: float = 1e-12
    largest_scale: float = 1e100
    law_scale: float = 1e-3
    facing: float = 0.5
    uncovered: float = 1e-6
    rim: float = 0.01
    rim_parts: int = 8
    curved_degree: int = 6
    overlap: float = 0.1
    least_force: float = 1e-5
    travel: float = 100.0
    piece: int = 2**18


DEFAULT = CompositionThresholds()
