"""A point for the dual bound where a body has travelled far: the laws' forces are held, the rest is solved exactly.

Behind all joints of the laws Newton's method can leave forces that are off by 1e-5 of the load, and a force that no law
bears lowers the bound by itself times the distance. With the forces of vectors held at what their laws bear just before
the lengths there, what is left is a programme of laws of one component. Springs about the point spread over all vectors
what the held forces leave along rigid motions. The dual bound holds for any point, so none of this can make it wrong.
"""

from __future__ import annotations

import numpy as np

from ..typing import Array
from .arcs import ArcTable
from .convex_programme import minimise
from .length_frames import left_out
from .length_programme import LengthProgramme


def with_held_forces(programme: LengthProgramme, x: Array, springs: Array) -> tuple[Array, Array]:
    """The minimiser where the laws' forces on vectors stay as they are at a point, and the bounds' forces, (n,) each.

    Args:
        programme: the programme.
        x: the point, (n,).
        springs: a matrix (n, n) that resists rigid motions.
    """
    held = _forces(programme, x)
    pull = programme.b - held + springs @ x
    chains = ArcTable.of(_without_lengths(programme, x))
    y = minimise(programme.a + springs, pull, chains, x, programme.thresholds).x
    return y, programme.bound_forces(y, held)


def _forces(programme: LengthProgramme, x: Array) -> Array:
    """Forces of the laws on the vectors' unknowns: on long vectors the traction just before, on none what it holds."""
    lengths = programme.lengths
    along = lengths.along(programme.b - programme.a @ x)
    out = left_out(lengths, x, along, (programme.lower, programme.upper))
    vectors, needed = (np.where(out, 0.0, v) for v in (lengths.vectors(x), along))
    size, most = np.linalg.norm(vectors, axis=1), np.linalg.norm(needed, axis=1)
    before, start = programme.borne(size)
    moved = size > 0.0
    way, divisor = np.where(moved[:, None], vectors, needed), np.where(moved, size, most)
    traction = np.where(moved, before, np.minimum(most, start))
    each = np.divide(traction, divisor, out=np.zeros_like(size), where=divisor > 0.0)[:, None] * way
    result = np.zeros(len(x))
    result[lengths.members] = (each * lengths.factors)[lengths.there]
    return result


def _without_lengths(programme: LengthProgramme, x: Array) -> list[Array]:
    """The laws of the unknowns; of the vectors' ones their bounds."""
    chains = list(programme.chains[: len(x)])
    end = programme.thresholds.beyond * float(np.abs(x).max()) + 1.0
    for i in programme.lengths.members:
        low, high = max(float(programme.lower[i]), -end), min(float(programme.upper[i]), end)
        chains[i] = np.array([[low, high, 0.0, 0.0, 0.0, 0.0]])
    return chains
