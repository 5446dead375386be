"""Scenes of a block on another one, and what tests read at their seam."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scenes import Array, Table

from hvi_fenicsx import Model, Solution, read_tables, solve


def seam_scene(low: Table, high: Table, material: Table, boundary: Table, between: Table, **solver: Any) -> Model:
    """Two bodies, upper and lower, that meet in the interface "seam"; the upper one's side comes first."""
    return read_tables(
        {
            "domain": {"lower": low, "upper": high},
            "material": material,
            "boundary": boundary,
            "interface": {"seam": {"between": ["upper.bottom", "lower.top"], **between}},
            "solver": {"tolerance": 1e-10, **solver},
        }
    )


def seam(found: Solution) -> Any:
    """The state of the part or interface "seam"."""
    assert found.examination is not None
    return next(state for state in found.examination.states if state.surface.part == "seam")


def away_from_affine(found: Solution) -> float:
    """The largest part of the displacement of a body that is not affine, relative."""
    assert found.solve_result is not None
    problem, d = found.problem, found.problem.scales.dimension
    u = found.solve_result.u.x.array.reshape(-1, d)
    x = np.column_stack([np.ones(len(u)), problem.points[:, :d]])
    worst = 0.0
    for member in np.unique(problem.bodies.members):
        mine = problem.bodies.members == member
        fitted = np.linalg.lstsq(x[mine], u[mine], rcond=None)[0]
        worst = max(worst, float(np.abs(x[mine] @ fitted - u[mine]).max()))
    return worst / float(np.abs(u).max())


def differences_by_side(table: Table, finer: Sequence[int]) -> Array:
    """By how much the energy changes, relatively, when the sides of the seam are exchanged; on each of some meshes."""
    found = []
    for times in finer:
        bodies = {n: {**b, "cells": [times * c for c in b["cells"]]} for n, b in table["domain"].items()}
        between = table["interface"]["seam"]["between"]
        energies = []
        for sides in (between, between[::-1]):
            interface = {"seam": {**table["interface"]["seam"], "between": sides}}
            solution = solve(read_tables({**table, "domain": bodies, "interface": interface}))
            assert solution.examination is not None
            energies.append(solution.examination.energy)
        found.append(abs(energies[0] / energies[1] - 1.0))
    return np.array(found)
