"""The reference solution that others are measured against, on its own nodes.

Every solution is first brought onto the reference's nodes (:mod:`.interpolation`), where the energy norm is that of the
reference's stiffness and integrals over Γc are sums over its lumped areas.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from ..geometry import tangents
from ..typing import Array, Mask
from . import interpolation
from .interpolation import SurfaceTransfer
from .solution_fields import PartFields, SolutionFields
from .thresholds import DEFAULT, Thresholds

_COLUMNS = {"slip": True, "friction": False, "pressure": False, "contact": False}
"""The fields of a part that are brought onto the reference's nodes, and whether they are displacements."""


@dataclass(frozen=True)
class TransferredSolution:
    """A solution on the reference's n nodes.

    Attributes:
        u: the displacement, m, (n, d).
        parts: the fields of each part of Γc by name, (m,) or (m, d-1).
        widths: the solution's own mesh width on each part, m.
    """

    u: Array
    parts: Mapping[str, Mapping[str, Array]]
    widths: Mapping[str, float]


class ReferenceSolution:
    """The reference that others are measured against.

    Args:
        fields: of the reference.
        stiffness: of its mesh, in its numbering.
        thresholds: how near to a jump of a law is near.
    """

    def __init__(self, fields: SolutionFields, stiffness: sparse.csr_array, thresholds: Thresholds = DEFAULT) -> None:
        self.fields, self.stiffness, self._thresholds = fields, stiffness, thresholds
        self._transfers: dict[tuple[bytes, bytes], Any] = {}
        self.own = self.transfer(fields)

    def transfer(self, found: SolutionFields) -> TransferredSolution:
        """A solution on the reference's nodes. The transfer from a mesh is found once."""
        key = (found.points.tobytes(), found.cells.tobytes())
        if key not in self._transfers:
            parts = {n: interpolation.surface(found.parts[n], p.points) for n, p in self.fields.parts.items()}
            self._transfers = {key: (interpolation.bodies(found, self.fields), parts)}
        matrix, by_part = self._transfers[key]
        columns = {name: _on_nodes(found.parts[name], along) for name, along in by_part.items()}
        return TransferredSolution(matrix @ found.u, columns, {name: _width(p) for name, p in found.parts.items()})

    def energy(self, u: Array) -> float:
        """√a(u, u) of a displacement (n, d), up to a factor."""
        flat = u.ravel()
        return math.sqrt(max(0.0, float(flat @ (self.stiffness @ flat))))

    def near_jump(self, name: str, found: TransferredSolution) -> Mask:
        """The vertices of a part near a jump of its law, (m,).

        Args:
            name: of the part.
            found: the solution; near is within some facets of its mesh.
        """
        part = self.fields.parts[name]
        places = _jumps(part)
        if not len(places):
            return np.zeros(len(part.points), dtype=bool)
        away = np.linalg.norm(part.points[:, None] - places[None], axis=2).min(axis=1)
        return np.asarray(away <= self._thresholds.jump_facets * found.widths[name])

    def left_out(self, found: TransferredSolution) -> float:
        """The part of Γc near jumps of the law, which ``friction_max`` leaves out, over all of Γc."""
        parts = self.fields.parts
        out = sum(float(p.weights[self.near_jump(name, found)].sum()) for name, p in parts.items())
        return out / (sum(float(p.weights.sum()) for p in parts.values()) or 1.0)


def _on_nodes(part: PartFields, along: SurfaceTransfer) -> dict[str, Array]:
    """The fields of a part on the reference's nodes."""
    ways = {column: along.of_degree if moves else along.linear for column, moves in _COLUMNS.items()}
    return {column: way @ getattr(part, column) for column, way in ways.items()}


def _width(part: PartFields) -> float:
    corners = part.points[part.facets]
    return float(np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), initial=0.0))


def _jumps(part: PartFields) -> Array:
    """The middles of the facets on which the slip passes a drop of the law; (k, d)."""
    along = tangents(part.normals)[:, 0]
    size = np.linalg.norm(part.slip, axis=1)
    signed = np.sum(part.slip * along, axis=1) if part.slip.shape[1] == 2 else size
    turned = np.sum(along[part.facets[:, 0]] * along[part.facets[:, -1]], axis=1) < 0.0
    slip = np.where(turned[:, None], size[part.facets], signed[part.facets])
    beyond = slip[:, :, None] - part.drops[part.facets]
    passed = np.any((beyond.min(axis=1) <= 0.0) & (beyond.max(axis=1) >= 0.0), axis=1)
    return np.asarray(part.points[part.facets[passed]].mean(axis=1))
