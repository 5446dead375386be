"""Bodies for mesh files: blocks that are turned, skewed, bent, uneven, or noisy inside."""

from __future__ import annotations

import numpy as np
from referee.meshes import Mesh, block, moved

from generator.draws import Draw


def body_mesh(g: Draw, name: str, offset: float) -> tuple[str, Mesh]:
    """A body and what was done to the block.

    Args:
        g: the scene's :class:`.Draw`.
        name: of the body, before the names of its sides.
        offset: along x, m.
    """
    cells = [int(c) for c in g.rng.integers(1, 5 if g.d == 2 else 3, g.d)]
    mesh = block([g.length] * g.d, cells)
    points, form = mesh.points.copy(), g.pick("plain", "turned", "skewed", "bent", "uneven", "inner")
    down = g.d - 1
    if form == "turned":
        angle = g.pick(1e-5, 3e-5, 1e-4, 1e-3, 0.1, 0.7)
        c, s = np.cos(angle), np.sin(angle)
        points[:, [0, down]] = points[:, [0, down]] @ np.array([[c, s], [-s, c]])
    elif form == "skewed":
        points[:, 0] += g.rng.uniform(-0.5, 0.5) * points[:, down]
    elif form == "bent":
        points[:, down] += g.rng.uniform(-0.2, 0.4) * (points[:, 0] / g.length - 0.5) ** 2 * g.length
    elif form == "uneven":
        on_floor = points[:, down] == 0.0
        points[on_floor, down] += g.length * 10.0 ** g.rng.uniform(-6, -4) * g.rng.uniform(-1, 1, on_floor.sum())
    elif form == "inner":
        low, high = points.min(axis=0), points.max(axis=0)
        inside = np.all((points > low) & (points < high), axis=1)
        points[inside] += g.length / max(cells) * 0.2 * g.rng.uniform(-1, 1, (inside.sum(), g.d))
    points[:, 0] += offset
    return form, moved(mesh, points, name)
