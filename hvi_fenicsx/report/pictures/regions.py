"""The regions of a body, as a picture of the scene tells them apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.patches import Patch

from ...typing import Integers
from ..reader import Result
from .style import INK

TINTS = ("#eef2f5", "#dbe3d3", "#e6dccb", "#d9d5e3", "#d3dfe6", "#e8d9d6")
"""Pale, since marks and names stand on them; with more regions they come again."""
MOST_NAMED = 4
"""Lines of the legend that regions may take."""


@dataclass(frozen=True)
class Region:
    """A region of the body.

    Attributes:
        name: its name; several where they share cells.
        cells: its cells, (k,).
        tint: its colour.
    """

    name: str
    cells: Integers
    tint: str


def regions(result: Result) -> list[Region]:
    """The regions with cells, each cell in one of them; empty where the body has no named ones."""
    named = result.arrays.regions
    member = np.zeros((len(result.body.cells), len(named)), dtype=np.bool_)
    for i, cells in enumerate(named.values()):
        member[cells, i] = True
    kinds, of_cell = np.unique(member, axis=0, return_inverse=True) if len(named) else (member[:0], np.empty(0))
    names = [_told([name for name, here in zip(named, kind, strict=True) if here], named) for kind in kinds]
    order = sorted(range(len(kinds)), key=lambda k: names[k])
    return [
        Region(names[k], np.flatnonzero(of_cell.ravel() == k), TINTS[place % len(TINTS)])
        for place, k in enumerate(order)
    ]


def _told(names: Sequence[str], cells: Mapping[str, Integers]) -> str:
    """Regions that share cells, in words: of a body `upper` and its `upper.core` the smaller one, or the body."""
    pairs = [(body, name) for name in names if (body := name.rpartition(".")[0]) in names]
    left_out = {name if len(cells[name]) == len(cells[body]) else body for body, name in pairs}
    return " and ".join(name for name in names if name not in left_out)


def keys(found: list[Region]) -> list[Artist]:
    """The legend's lines on the regions; none where they would be too many."""
    if len(found) > MOST_NAMED:
        return []
    return [Patch(fc=region.tint, ec=INK, label=region.name or "no named region") for region in found]
