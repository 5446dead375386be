"""Force and displacement of the driven parts against those of the whole body at solved equilibria."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from scenes import STEEL, Table, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.api import solve
from hvi_fenicsx.load_paths.measures import Measures
from hvi_fenicsx.reduced.condensation import Condensation

FACTOR = 0.4
SCALED = ("grip.displacement", "lid.traction")


def scene(factor: float = 1.0) -> Table:
    """Pulled by a grip, with a load on a part that is glued too; a constant load on another side sets the scales."""
    glue = {"law": "graph", "points": [[0, 0], [1e-6, 1e6], [3e-6, 0]], "one_sided": True}
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [4, 2]},
        "material": dict(STEEL),
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "grip": {"on": "right", "displacement": [2e-6 * factor, "free"]},
            "lid": {"on": "top", "traction": [0.0, 2e5 * factor], "support": glue},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": glue, "friction": quadratic_linear(1e6)},
        },
        "body": {"force": [1e6, -1e6]},
    }


def slanted(factor: float = 1.0) -> Table:
    """The same on a slope, the corners left alone by the floor's supports."""
    table = scene(factor)
    table["boundary"]["grip"]["displacement"] = [2e-6 * factor, 0.0]
    table["boundary"]["wall"]["displacement"] = [0.0, 0.0]
    table["boundary"]["floor"]["contact"] = {"obstacle": {"point": [0.0, 0.0], "normal": [0.05, -1.0]}}
    del table["boundary"]["lid"]["support"]
    return table


def unknowns(condensation: Condensation, whole: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The condensed unknowns that expand to a displacement of the whole body."""
    rest = condensation.expand(np.zeros(condensation.problem.size), FACTOR).array.copy()
    columns = [condensation.expand(one, FACTOR).array - rest for one in np.eye(condensation.problem.size)]
    found: npt.NDArray[np.float64] = np.linalg.lstsq(np.column_stack(columns), whole - rest)[0]
    return found


@pytest.mark.parametrize("table", [scene, slanted])
def test_forces_and_means_are_those_of_the_whole_body(table: Callable[..., Table]) -> None:
    solution = solve(read_tables(table(FACTOR)), estimate=False, tolerance=1e-11)
    assert solution.converged
    system = prepare(read_tables(table())).system
    condensation = Condensation(system, SCALED)
    measures = Measures(system, condensation, SCALED)
    solution.u.x.array[:] /= system.problem.scales.displacement
    x = unknowns(condensation, system.unknowns(solution.u).array)
    forces, means = measures.forces(x, FACTOR), measures.displacements(x, FACTOR)
    assert measures.parts == ("wall", "grip", "lid")
    size = max(np.linalg.norm(f) for f in solution.resultants.values())
    for part in measures.parts:
        np.testing.assert_allclose(forces[part], solution.resultant(part), rtol=0, atol=1e-7 * size)
    assert means["grip"][0] == pytest.approx(2e-6 * FACTOR, rel=1e-12)
    assert abs(means["wall"][0]) < 1e-18
    u = solution.u.x.array.reshape(-1, 2) * system.problem.scales.displacement
    top = system.problem.points[:, 1] == 0.5
    order = np.argsort(system.problem.points[top, 0])
    assert means["lid"][1] == pytest.approx(np.trapezoid(u[top, 1][order], dx=0.25), rel=1e-8)
