"""Parts that a body in space hides are drawn beside it, each clear of the body and of the other parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from ...typing import Array
from .vtk_view import View

FACING = 0.15
"""Cosine from which a part is drawn where it is."""


def ways(view: View, body: Array, parts: Iterable[tuple[Array, Array]], margin: float) -> list[Array]:
    """How far each part is moved: not at all if it is seen, else out along its normal until nothing covers it.

    Args:
        view: from where it is seen.
        body: points of the body, m, (n, 3).
        parts: points of each part, m, (m, 3), and its unit outward normal, (3,); zero where it closes on itself.
        margin: what is left free between what is drawn, m.

    Returns:
        Of each part, m, (3,).
    """
    drawn, found = [view.project(body)], list[Array]()
    for points, normal in parts:
        found.append(_way(view, drawn, points, normal, margin))
        if found[-1].any():
            drawn.append(view.project(points + found[-1]))
    return found


def _way(view: View, drawn: Sequence[Array], points: Array, normal: Array, margin: float) -> Array:
    seen, own = view.project(normal[None])[0], view.project(points)
    length = float(np.linalg.norm(seen))
    if float(normal @ view.toward) > FACING or length < 1e-6:
        return np.zeros(3)
    across, reach = seen / length, 0.0
    while covering := [other for other in drawn if _meet(own + reach * across, other)]:
        reach = max(float((other @ across).max()) for other in covering) - float((own @ across).min()) + margin
    return np.asarray(reach / length * normal)


def _meet(first: Array, second: Array) -> bool:
    return bool(shapely.MultiPoint(first).convex_hull.intersects(shapely.MultiPoint(second).convex_hull))
