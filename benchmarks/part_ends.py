"""Estimated over true error where a part with `where` ends within a facet (docs/estimator.md).

    ./hvi exec python3 benchmarks/part_ends.py [PART ...]

The true error is measured in the energy norm against a mesh of degree 2 that has a vertex where the part ends.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from dolfinx import fem, geometry

from hvi_fenicsx import Scene, solve
from hvi_fenicsx.modelling.solution import ModelSolution

FINE, COARSE = 160, (4, 8, 16)
ENDS = (0.3, 0.35)
P = 1e6
Table = dict[str, Any]
LEFT: Table = {"on": "left", "displacement": [0.0, "free"]}
FLAT: Table = {"on": "bottom", "displacement": ["free", 0.0]}
FIXED: Table = {"on": "bottom", "displacement": [0.0, 0.0]}
PRESS: Table = {"on": "top", "traction": [0.0, -P]}
PULL: Table = {"on": "right", "traction": [2 * P, 0.0]}
PARTS: dict[str, tuple[Table, Table]] = {
    "clamp": (FIXED, {"press": {"on": "top", "traction": [0.3 * P, -P]}}),
    "contact": ({"on": "bottom", "contact": {"gap": 0.0}}, {"press": PRESS, "left": LEFT}),
    "friction that slides": (
        {"on": "bottom", "friction": {"law": "tresca", "yield_traction": 0.5 * P}},
        {"floor": FLAT, "pull": PULL, "left": LEFT},
    ),
    "friction that sticks": (
        {"on": "bottom", "friction": {"law": "tresca", "yield_traction": 50 * P}},
        {"floor": FLAT, "pull": PULL},
    ),
    "spring of 1e10 N/m³": (
        {"on": "bottom", "friction": {"law": "linear_spring", "stiffness": 1e10}},
        {"floor": FLAT, "pull": PULL},
    ),
    "force": ({"on": "top", "force": [0.0, -0.3 * P]}, {"base": FIXED}),
    "moment": ({"on": "top", "moment": 0.3 * P}, {"base": FIXED}),
}
"""The part that ends, and the others."""


def solved(kind: str, end: float, cells: int, degree: int) -> ModelSolution:
    """A square on which one part is where x is smaller than its end."""
    part, others = PARTS[kind]
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": {"model": "plane_strain", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
        "boundary": {**others, "part": {**part, "where": f"x < {end}"}},
        "solver": {"degree": degree},
    }
    return solve(Scene.model_validate(table))


def distance(coarse: ModelSolution, fine: ModelSolution) -> float:
    """|||u_h - u||| of solutions on nested meshes, (J/m)^½."""
    space, mesh = fine.u.function_space, coarse.u.function_space.mesh
    x = space.tabulate_dof_coordinates()
    near = geometry.compute_collisions_points(geometry.bb_tree(mesh, mesh.topology.dim), x)
    cells = geometry.compute_colliding_cells(mesh, near, x)
    values = coarse.u.eval(x, np.array([cells.links(i)[0] for i in range(len(x))], dtype=np.int32))
    between = fem.Function(space)
    between.x.array[:] = (values.ravel() - fine.u.x.array) / fine.problem.scales.displacement
    return float(np.sqrt(fine.problem.bulk.energy_by_cell(between).sum() * fine.problem.scales.energy))


def index(coarse: ModelSolution, fine: ModelSolution) -> float:
    """Estimated over true error."""
    assert coarse.estimate is not None
    return coarse.estimate.total * float(np.sqrt(coarse.problem.scales.energy)) / distance(coarse, fine)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    columns = [f"{cells}, x < {end}" for end in ENDS for cells in COARSE]
    print(f"| part | degree | {' | '.join(columns)} |\n|{'---|' * (2 + len(columns))}")
    for kind in parser.parse_args().parts:
        finest = {end: solved(kind, end, FINE, 2) for end in ENDS}
        for degree in (1, 2):
            found = [index(solved(kind, end, cells, degree), finest[end]) for end in ENDS for cells in COARSE]
            print(f"| {kind} | {degree} | {' | '.join(f'{one:.2f}' for one in found)} |", flush=True)


if __name__ == "__main__":
    main()
