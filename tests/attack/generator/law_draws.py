"""Random laws: the catalogue's, and graphs with dead zones, teeth, jumps up and down, falling slopes, pushes."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.draws import Draw


def law(g: Draw, key: str) -> dict[str, Any]:
    """A law for friction, adhesion or support.

    Args:
        g: the scene's :class:`.Draw`.
        key: what it is for.
    """
    t = float(f"{g.stress * g.log(-2, 0.7):.5g}")
    x = float(f"{g.u0 * g.log(-1.2, 0.8):.5g}")
    name = g.pick(
        "quadratic_linear", "quadratic_linear_literal", "tresca", "linear_spring", "sawtooth", "exponential", "graph",
        p=[0.22, 0.08, 0.1, 0.06, 0.08, 0.08, 0.38],
    )  # fmt: skip
    if name == "quadratic_linear_literal" and key == "slip vector":
        name = "quadratic_linear"
    if name in ("quadratic_linear", "quadratic_linear_literal"):
        return {"law": name, "gamma1": 2 * t, "gamma2": t, "delta": x}
    if name == "tresca":
        return {"law": name, "yield_traction": t}
    if name == "linear_spring":
        return {"law": name, "stiffness": float(f"{t / x:.5g}")}
    if name in ("sawtooth", "exponential"):
        extra = {"drops": int(g.rng.integers(1, 5))} if name == "sawtooth" else {}
        residual = 0.0 if g.some(0.3) else float(f"{t * g.rng.uniform(0, 0.9):.5g}")
        return {"law": name, "peak_traction": t, "residual_traction": residual, "delta": x} | extra
    one_sided = key != "slip vector" and g.some(0.3 if key == "friction" else 0.6)
    return {"law": "graph", "points": _points(g, t, x, rings=key != "slip vector"), "one_sided": bool(one_sided)}


def _points(g: Draw, t: float, x: float, *, rings: bool) -> list[list[float]]:
    form = g.pick("dead", "drop", "falling", "jump_up", "push", "random", p=[0.2, 0.2, 0.15, 0.1, 0.1, 0.25])
    r = [float(f"{t * f:.5g}") for f in g.rng.uniform(0, 1, 3)]
    if form == "dead":
        return [[0.0, 0.0], [x, g.pick(0.0, 0.0, t * 1e-6)], [2 * x, t]] + ([[3 * x, r[0]]] if g.some(0.3) else [])
    if form == "drop":
        return [[0.0, 0.0], [x, t], [x, r[0]]] + ([[2 * x, r[1]], [2 * x, 0.0]] if g.some(0.4) else [])
    if form == "falling":
        return [[0.0, g.pick(0.0, t)], [x, t], [g.pick(1.5, 3.0, 8.0) * x, r[0] * g.pick(0.0, 1.0)]]
    if form == "jump_up" and rings:
        return [[0.0, 0.0], [x, r[0]], [x, r[0] + t], [3 * x, r[0] + t]]
    if form == "push":
        return [[0.0, g.pick(0.0, -t)], [x, -t]] + ([[2 * x, t]] if g.some(0.5) else [])
    places = np.sort(g.rng.uniform(0, 3 * x, int(g.rng.integers(1, 5))))
    points = [[0.0, g.pick(0.0, r[0])]]
    for place in places:
        place = float(f"{place:.5g}")
        if place <= points[-1][0]:
            continue
        points.append([place, float(f"{t * g.rng.uniform(-0.3, 1):.5g}")])
        if g.some(0.3):
            top = points[-1][1]
            points.append(
                [place, float(f"{top - t * g.rng.uniform(0, 1):.5g}")]
                if not rings
                else [place, float(f"{t * g.rng.uniform(-0.2, 1):.5g}")]
            )
    if len(points) == 1 or not any(p[1] for p in points):
        points.append([points[-1][0] + x, t])
    return points
