"""Prints what the ranks have of a condensed problem: energies and forces of displacements that are given by place."""

from __future__ import annotations

import json

import numpy as np
from mpi4py import MPI
from scenes import DELTA, model, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.reduced.condensation import Condensation


def main() -> None:
    """Of the model problem, pulled by a displacement."""
    comm, table = MPI.COMM_WORLD, model(6, friction=quadratic_linear(3e6, DELTA))
    table["boundary"]["pull"] = {"on": "right", "displacement": [5e-6, "free"]}
    condensation = Condensation(prepare(read_tables(table), comm).system)
    problem = condensation.problem
    slip = np.zeros(problem.size, dtype=bool)
    slip[problem.bonds[0].unknowns[:, 0]] = True
    x = np.sin(7.0 * problem.points[:, 0] + 2.0 * slip)
    order = np.lexsort([problem.points[:, 0], slip])
    force = problem.stiffness @ x - problem.load(0.6)
    found = {
        "energies": [problem.energy(x, factor) for factor in (0.0, 0.6, 1.0)],
        "force": force[order].tolist(),
        "whole": condensation.expand(x, 0.6).norm(),
    }
    everywhere = comm.gather(found)
    if comm.rank == 0:
        print(json.dumps(found | {"equal": all(other == found for other in everywhere)}))


if __name__ == "__main__":
    main()
