"""What is refused of an interface, with its mend; all ranks agree on it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..runtime.mpi import agree
from ..typing import Array, Mask
from . import dual_basis
from .contact_surface import Surface
from .facet_overlaps import Overlaps
from .interface_sides import Pair
from .thresholds import CompositionThresholds


def check_facing(pair: Pair, overlaps: Overlaps) -> None:
    """Refuse two sides that do not lie over each other anywhere.

    Args:
        pair: the sides.
        overlaps: the intersections of their facets.

    Raises:
        InputError: there are none.
    """
    if not len(overlaps.areas):
        raise InputError(
            f'interface.{pair.name}.between: "{pair.sides.first}" and "{pair.sides.second}" do not face each other: '
            "nowhere does a normal of the first meet a facet of the second; name sides that lie over each other"
        )


def check_carried(pair: Pair, overlaps: Overlaps, kept: Mask, busy: Mask) -> None:
    """Refuse an interface without a node that carries something, or a part of it that nothing carries.

    Args:
        pair: the sides.
        overlaps: the intersections of their facets.
        kept: which nodes of the first side's facets carry something, (f, n).
        busy: which lie over the second side and carry something else, (f, n).

    Raises:
        InputError: with the place.
    """
    if not kept.any():
        raise InputError(
            f'interface.{pair.name}.between: no vertex of "{pair.sides.first}" is free to carry contact or laws: each '
            f'lies beyond the end of "{pair.sides.second}", is prescribed, or is on another part; name the longer side '
            "second, or make the mesh of the first finer"
        )
    lost = np.setdiff1d(overlaps.first, np.flatnonzero(kept.any(axis=1) | ~busy.any(axis=1)))
    lost = np.setdiff1d(lost, list(dual_basis.adopted(pair.first, overlaps, kept)))
    if len(lost):
        at = tuple(float(f"{c:.6g}") for c in pair.first.corners[lost[0]].mean(axis=0))
        raise InputError(
            f"interface.{pair.name}: nothing carries the facet at {at}: its vertices and those near it are prescribed "
            "or on other parts; make the mesh there finer"
        )


def check_apart(comm: MPI.Comm, pair: Pair, surface: Surface, gap: Array, thresholds: CompositionThresholds) -> None:
    """Refuse bodies that overlap by more than the facets of their curved sides do. Collective.

    Args:
        comm: the ranks.
        pair: the sides.
        surface: the nodes of the first side that carry something.
        gap: the distance of the sides there, m, (m,).
        thresholds: what is allowed, relative to the first side's facets.

    Raises:
        InputError: on all ranks alike, with the place where they overlap most.
    """
    deepest = [(float(gap[i]), surface.spot(i)) for i in _lowest(gap)]
    depth, at = min((place for rank in agree(comm, deepest) for place in rank), default=(0.0, ""))
    if depth < -thresholds.overlap * pair.first.width:
        raise InputError(
            f'interface.{pair.name}.between: at {at} "{pair.sides.second}" lies {-depth:.3g} m inside of the body '
            f'of "{pair.sides.first}": move one of the bodies, name the sides that face each other, or mesh '
            "curved sides more finely"
        )


def _lowest(gap: Array) -> Iterable[int]:
    return (int(np.argmin(gap)),) if len(gap) else ()
