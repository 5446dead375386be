"""Prints the length on which the parts of two blocks, one on the other, meet on the same rank, at each level."""

from __future__ import annotations

import json

import numpy as np
from mpi4py import MPI

from hvi_fenicsx.mesh.blocks import block
from hvi_fenicsx.mesh.joined import PlacedBody
from hvi_fenicsx.mesh.placement import near_parts

COMM = MPI.COMM_WORLD


def covered(body: PlacedBody, height: float) -> tuple[float, float]:
    """The part of a line at a height that this rank's vertices cover."""
    points = body.at(body.domain.mesh.geometry.x[:, :2])
    x = points[np.isclose(points[:, 1], height), 0]
    return (float(np.min(x)), float(np.max(x))) if len(x) else (0.0, 0.0)


def met(lower: PlacedBody, upper: PlacedBody) -> float:
    """The length that both cover."""
    (a, b), (c, d) = covered(lower, 0.5), covered(upper, 0.5)
    return max(0.0, min(b, d) - max(a, c))


origins = {"lower": np.zeros(2), "upper": np.array([0.25, 0.5])}
bodies = [
    PlacedBody(name=name, domain=block(COMM, [1.0, 0.5], [32, 16]), origin=origin, rotation=np.eye(2))
    for name, origin in origins.items()
]
after = near_parts(COMM, bodies)
coarse = [PlacedBody(name=b.name, domain=b.domain.coarser()[0], origin=b.origin, rotation=b.rotation) for b in after]
told = COMM.gather([met(*pair) for pair in (bodies, after, coarse)])
if COMM.rank == 0:
    print(json.dumps(np.sum(told, axis=0).tolist()))
