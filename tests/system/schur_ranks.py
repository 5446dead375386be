"""On all ranks: how far the condensed direct solver is from a factorisation of the whole matrix, relative."""

from __future__ import annotations

import json

import numpy as np
from mpi4py import MPI

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.system import direct
from hvi_fenicsx.system.factorisation import form_of
from hvi_fenicsx.system.held_solver import HeldPreconditioner
from hvi_fenicsx.system.linear_settings import LinearSettings

FRICTION = {"law": "quadratic_linear", "gamma1": 3e6, "gamma2": 1.5e6, "delta": 9e-6}
SCENE = {
    "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [3, 3, 3]},
    "material": {"youngs_modulus": 2.1e11, "poisson_ratio": 0.49, "model": "three_dimensional"},
    "boundary": {
        "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
        "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
        "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": FRICTION},
    },
}


def main() -> None:
    """Unknowns of Γc by rank, and the difference with a tangent and some unknowns held."""
    system = prepare(read_tables(SCENE), MPI.COMM_WORLD).system
    rates = [np.eye(k.shape[1]) * (1.0 + np.arange(len(k)))[:, None, None] for k in system.jacobian.rates]
    system.jacobian.set_rates(rates)
    held = system.jacobian.rows.dofs[1::3].astype(np.int32)
    load, expected, found = (system.load.duplicate() for _ in range(3))
    load.array[:] = np.cos(np.arange(*load.owner_range))
    expected.set(0.0)
    whole = HeldPreconditioner(system, (), LinearSettings("lu"), Timer())
    condensed = direct.SchurDirect(form_of(system), {"pc_type": "cholesky"})
    whole.prepare(held)
    whole.solve(load, expected, 1e-12)
    condensed.prepare(held)
    condensed.apply(load, found)
    found.axpy(-1.0, expected)
    sizes = MPI.COMM_WORLD.allgather(len(system.jacobian.rows.dofs))
    told = {"sizes": sizes, "difference": found.norm() / expected.norm()}
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(told))


if __name__ == "__main__":
    main()
