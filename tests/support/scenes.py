"""Scenes that many tests share, as plain tables, and ways to look at a solution without the package's writers."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hvi_fenicsx import Solution, read_tables, solve
from hvi_fenicsx.solvers import nested_iteration
from hvi_fenicsx.solvers.method import SolveContext
from hvi_fenicsx.solvers.nested_iteration import LevelSolution
from hvi_fenicsx.system.thresholds import DEFAULT, Thresholds
from hvi_fenicsx.workflow import Preparation

Array = npt.NDArray[np.float64]
Table = dict[str, Any]
E, NU, P, Q, DELTA = 2.15e11, 0.29, 1.0e6, 1.0e6, 9.0e-6
STEEL = {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": NU}


def quadratic_linear(gamma1: float, delta: float = DELTA) -> Table:
    """The paper's law, of any strength."""
    return {"law": "quadratic_linear", "gamma1": gamma1, "gamma2": gamma1 / 2, "delta": delta}


def model(
    cells: int = 4, pull: float = P, press: float = Q, friction: Table | None = None, gap: Any = 0.0, **solver: Any
) -> Table:
    """The paper's model problem, wall left, on the unit square; without friction unless a law is given."""
    floor = {"on": "bottom", "contact": {"gap": gap}} | ({"friction": friction} if friction else {})
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": dict(STEEL),
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [pull, 0.0]},
            "press": {"on": "top", "traction": [0.0, -press]},
            "floor": floor,
        },
        "solver": solver,
    }


def block(cells: int = 3, push: float = P, press: float = Q, friction: Table | None = None, **solver: Any) -> Table:
    """The same square without the wall: a free block on the floor, pushed at its right side."""
    table = model(cells, push, press, friction, **solver)
    del table["boundary"]["wall"]
    return table


def two_blocks(shape: str, flat: list[float], cells: list[list[int]], elasticity: str, **solver: Any) -> Table:
    """Two blocks with friction between them, pressed askew and pushed, so that they part at one end; meshes differ."""
    rest = [0.0] * len(flat)
    return {
        "domain": {
            "lower": {"shape": shape, "size": [*flat, 0.5], "cells": cells[0]},
            "upper": {"shape": shape, "size": [*flat, 0.4], "cells": cells[1], "origin": [0.21, *rest[1:], 0.5]},
        },
        "material": STEEL | {"model": elasticity},
        "boundary": {
            "base": {"on": "lower.bottom", "displacement": [*rest, 0.0]},
            "press": {"on": "upper.top", "traction": [*rest, "-1e6*(2.4 - 2.6*x)"]},
            "push": {"on": "upper.left", "traction": [6e5, *rest]},
        },
        "interface": {
            "seam": {
                "between": ["upper.bottom", "lower.top"],
                "contact": {"gap": 0.0},
                "friction": quadratic_linear(1e6, 1e-6),
            }
        },
        "solver": solver,
    }


NESTED = Thresholds(nested_from=1_000, largest_direct=(1_000, 1_000))
"""Small meshes have coarser levels too, and take their multigrid."""


def solved(table: Table, thresholds: Thresholds = DEFAULT) -> Solution:
    """The solution of a scene given as tables."""
    return solve(read_tables(table), thresholds=thresholds)


def solved_system(prepared: Preparation) -> LevelSolution:
    """The solve alone, without certificate and estimate."""
    return nested_iteration.solve(prepared.task(), prepared.system)


def context_of(prepared: Preparation) -> SolveContext:
    """What a method is given, without coarser levels."""
    return SolveContext.create(prepared.task(), prepared.system)


def points(solution: Solution) -> Array:
    """The vertices, m, shape (n, 2)."""
    found: Array = solution.problem.space.tabulate_dof_coordinates()[:, : solution.scene.dimension]
    return found


def displacement(solution: Solution) -> Array:
    """The displacement at the vertices, m, shape (n, d)."""
    assert solution.solve_result is not None
    u = solution.solve_result.u.x.array.reshape(-1, solution.scene.dimension)
    return np.asarray(u * solution.problem.scales.displacement)


def energy(solution: Solution) -> float:
    """The energy, J/m."""
    assert solution.examination is not None
    return solution.examination.energy * solution.problem.scales.energy


def ordered(points: Array, values: Array) -> Array:
    """Values sorted by their points, so that two numberings of one mesh compare."""
    keys = np.round(points / np.max(np.abs(points)), 9)
    return np.asarray(values[np.lexsort(keys.T)])


def far(found: Array, wanted: Array) -> float:
    """The largest difference, relative to the largest wanted value."""
    return float(np.max(np.abs(found - wanted)) / np.max(np.abs(wanted)))
