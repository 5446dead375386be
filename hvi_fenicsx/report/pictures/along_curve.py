"""Slips of a curved part in the plane: tangents turn their sign where they pass 45°, curves over s should not jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...geometry import tangents
from ...typing import Array, Mask
from ..contact_part import ContactPart
from ..reader import Result

COLUMNS = ("u_t1", "friction_t1")


def along_curve(result: Result, part: ContactPart) -> ContactPart:
    """A part with the slips and tractions towards growing s, if some of its tangents look there and others back.

    So is none whose law is not the same in both directions.

    Args:
        result: the result.
        part: the part of Γc, in the plane.
    """
    signs = _signs(part)
    if np.all(signs == signs[0]) or not _is_even(result, part):
        return part
    return replace(part, columns={**part.columns, **{name: signs * part[name] for name in COLUMNS}})


def _is_even(result: Result, part: ContactPart) -> bool:
    law = result.law(part.name)
    return law.even if law is not None else not result.resists(part.name, "slip")


def _signs(part: ContactPart) -> Array:
    """1 where the tangent looks towards growing s, -1 where it looks back, (m,)."""
    steps = np.where(_joined(part)[:, None], np.diff(part.points[:, :2], axis=0), 0.0)
    way = np.pad(steps, ((1, 0), (0, 0))) + np.pad(steps, ((0, 1), (0, 0)))
    return np.where(np.sum(tangents(part.normal)[:, 0] * way, axis=1) < 0.0, -1.0, 1.0)


def _joined(part: ContactPart) -> Mask:
    """Whether a facet joins each vertex to the next one of the table, (m-1,)."""
    order = np.argsort(part.vertices)
    rows = np.sort(order[np.searchsorted(part.vertices[order], part.facets)], axis=1)
    found = np.zeros(len(part.vertices) - 1, dtype=bool)
    found[rows[rows[:, 1] == rows[:, 0] + 1, 0]] = True
    return found
