"""Bodies that come to rest far from their place: they travel 1e5 times as far as they deform."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import STEEL, Table, solved

PRESS = 1e6


def falling(height: float, slope: float, cells: int) -> Table:
    """A pressed square above a nearly level floor, on which a bond that hardens after 5 µm keeps it from sliding."""
    hardening = {"law": "graph", "points": [[0.0, 0.0], [5e-6, 0.01], [1e-5, 1e6]], "one_sided": False}
    contact = {"obstacle": {"point": [0.0, -height], "normal": [-slope, 1.0]}}
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": dict(STEEL),
        "boundary": {
            "press": {"on": "top", "traction": [0.0, -PRESS]},
            "floor": {"on": "bottom", "contact": contact, "friction": hardening},
        },
    }


@pytest.mark.parametrize(("height", "slope", "cells"), [(0.0332, 1.3e-6, 2), (1.0, 1e-7, 4)])
def test_the_rounding_of_its_travel_does_not_hide_what_makes_a_body_slide(
    height: float, slope: float, cells: int
) -> None:
    found = solved(falling(height, slope, cells))
    assert found.exit_code == 0
    assert found.examination is not None
    assert found.examination.certificate.net_force <= 1e-8
    (floor,) = found.examination.states
    (bond,) = floor.laws
    carried = np.sum(bond.allowed[:, 0] * floor.surface.weights) * found.problem.scales.stress
    assert abs(carried) == pytest.approx(PRESS * slope, rel=1e-7)
