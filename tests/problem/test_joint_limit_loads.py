"""Closed forms of limit loads with a second body in the floor's place: lifting, an askew pull, a slope, a torque."""

from __future__ import annotations

import numpy as np
import pytest
from joint_scenes import seam_scene
from scenes import Table

from hvi_fenicsx import prepare
from hvi_fenicsx.workflow import Preparation

LENGTH, AREA = 0.6, 0.6 * 0.8
DROP = {"law": "graph", "points": [[0, 0], [1e-6, 8e5], [1e-6, 5e5]]}
PLANE = {"model": "plane_stress", "youngs_modulus": 2.0e11, "poisson_ratio": 0.3}
SPACE = {**PLANE, "model": "three_dimensional"}


def plane(between: Table, **loads: Table) -> Preparation:
    """A block of 0.6 x 0.4 on one of 1 x 0.5 that is held."""
    low = {"shape": "rectangle", "size": [1.0, 0.5], "cells": [7, 4]}
    high = {"shape": "rectangle", "size": [LENGTH, 0.4], "cells": [5, 3], "origin": [0.2, 0.5]}
    base = {"on": "lower.bottom", "displacement": [0.0, 0.0]}
    return prepare(seam_scene(low, high, PLANE, {"base": base, **loads}, between))


def space(between: Table, **loads: Table) -> Preparation:
    low = {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [4, 3, 2]}
    high = {"shape": "box", "size": [LENGTH, 0.8, 0.4], "cells": [12, 16, 1], "origin": [0.2, 0.1, 0.5]}
    base = {"on": "lower.bottom", "displacement": [0.0, 0.0, 0.0]}
    return prepare(seam_scene(low, high, SPACE, {"base": base, **loads}, between))


def test_lifting_takes_the_weight_and_the_adhesion() -> None:
    weight, lift = 3e5, 1e6
    adhesion = {**DROP, "one_sided": True}
    found = plane(
        {"contact": {"gap": 0.0}, "adhesion": adhesion},
        lift={"on": "upper.top", "force": [0.0, lift * LENGTH]},
        weight={"on": "upper.right", "force": [0.0, -weight * LENGTH / 2]},
        other={"on": "upper.left", "force": [0.0, -weight * LENGTH / 2]},
    )
    factors = found.load_factors("lift")
    assert factors.held == pytest.approx((weight + 5e5) / lift, rel=1e-8)
    assert factors.peak == pytest.approx((weight + 8e5) / lift, rel=1e-8)


@pytest.mark.parametrize("shear", [0.0, 0.5, -2.0])
def test_an_askew_pull_without_moment_takes_the_ellipse(shear: float) -> None:
    beta, up = 0.7, 1e6
    moment = 12 * shear * up * 0.4 / LENGTH**2  # of a linear traction on top, against that of the shear at its height
    pull = {"on": "upper.top", "traction": [shear * up, f"{up} + {moment}*(x - 0.5)"]}
    factors = plane({"cohesion": {**DROP, "beta": beta}}, pull=pull).load_factors("pull")
    strength = 1.0 / (up * np.hypot(1.0, shear / beta))
    assert factors.held == pytest.approx(5e5 * strength, rel=1e-8)
    assert factors.peak == pytest.approx(8e5 * strength, rel=1e-8)


def test_a_slope_is_slid_down_at_its_angle() -> None:
    angle, weight = np.radians(20.0), 2e6
    force = [weight * np.sin(angle), -weight * np.cos(angle)]
    pulls = {"on": ["upper.left", "upper.right"], "force": [0.4 * f for f in force]}
    factors = plane({"contact": {"gap": 0.0}, "friction": DROP}, pull=pulls).load_factors("pull")
    assert factors.held == pytest.approx(5e5 * LENGTH / (0.4 * force[0]), rel=1e-8)
    assert factors.peak == pytest.approx(8e5 * LENGTH / (0.4 * force[0]), rel=1e-8)


def test_a_torque_turns_the_block_on_the_other() -> None:
    """γ ∫ r ds, here by the vertices' own areas: within the error of the vertex rule of the closed form."""
    twist = {"on": "upper.top", "moment": [0.0, 0.0, 1e5]}
    found = space({"contact": {"gap": 0.0}, "friction": DROP}, twist=twist).load_factors("twist")
    x, y = np.meshgrid((np.arange(400) + 0.5) / 400 * LENGTH - 0.3, (np.arange(400) + 0.5) / 400 * 0.8 - 0.4)
    moment = float(np.hypot(x, y).mean()) * AREA
    assert found.held == pytest.approx(5e5 * moment / 1e5, rel=0.01)
    assert found.peak == pytest.approx(8 / 5 * found.held, rel=1e-6)
