"""Random materials."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.draws import Draw


def material(g: Draw) -> dict[str, Any]:
    """A material for a scene, mostly isotropic.

    Args:
        g: the scene's :class:`.Draw`.
    """
    model = "three_dimensional" if g.d == 3 else g.pick("plane_stress", "plane_strain", p=[0.75, 0.25])
    kind = g.pick("isotropic", "orthotropic", "tensor", p=[0.9, 0.05, 0.05])
    if kind == "isotropic":
        ratio = g.pick(0.29, 0.0, 0.46, 0.4999, -0.3, p=[0.7, 0.1, 0.08, 0.05, 0.07])
        return {"model": model, "youngs_modulus": g.modulus, "poisson_ratio": ratio}
    if kind == "orthotropic":
        e = [float(f"{g.modulus * f:.4g}") for f in g.rng.uniform(0.2, 1.0, 3)]
        plane = model == "plane_stress"
        return {
            "elasticity": kind,
            "model": model,
            "youngs_moduli": e[:2] if plane else e,
            "poisson_ratios": [0.1] if plane else [0.1, 0.12, 0.15],
            "shear_moduli": [float(f"{0.3 * m:.4g}") for m in (e[:1] if g.d == 2 else e)],
        }
    n = 3 if g.d == 2 else 6
    a = g.rng.uniform(-0.3, 0.3, (n, n)) + np.eye(n)
    rows = [[float(f"{v:.6g}") for v in row] for row in g.modulus * (a @ a.T)]
    symmetric = [[rows[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]
    return {"elasticity": kind, "model": model, "matrix": symmetric}
