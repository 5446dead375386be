"""The scale of the stress in the body, and its colour bar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from ...typing import Array
from ..body_mesh import BodyMesh
from ..units import unit_for
from .legend import colour_bar
from .style import EMBER

PEAK, SPOILS = 0.005, 1.25
"""Part of the body's volume that is left beyond the end of a scale; how many times its end the peak must be."""


@dataclass(frozen=True)
class StressScale:
    """A scale for the stress of the cells, from zero.

    Attributes:
        end: where it ends, N/m².
        largest: the largest stress, N/m².
    """

    end: float
    largest: float

    @property
    def cut(self) -> bool:
        """Whether some cells have more."""
        return self.end < self.largest


def scale_of(body: BodyMesh, values: Array) -> StressScale:
    """A scale that a peak in a corner does not spoil: it ends where a share ``PEAK`` of the body has more.

    Args:
        body: the body.
        values: the stress of its cells, N/m², (c,).
    """
    volume = body.volumes
    order = np.argsort(values)
    share = np.cumsum(volume[order]) / volume.sum()
    end, largest = float(values[order][np.searchsorted(share, 1.0 - PEAK)]), float(values.max())
    return StressScale(end if 0.0 < end < largest / SPOILS else largest, largest)


def bar(fig: Figure, scale: StressScale, remark: str) -> None:
    """Draw the bar of the stress, and say how large it is where the scale does not reach.

    Args:
        fig: the picture.
        scale: of the stress.
        remark: below the bar.
    """
    unit = unit_for(scale.end, "Pa")
    words = f"von Mises stress, {'peak' if scale.cut else 'up to'} {unit.text(scale.largest)}"
    colour_bar(fig, EMBER, (0.0, scale.end / unit.size), words, remark)
