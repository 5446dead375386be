"""On all ranks: solutions and negative eigenvalues of factors with pressures, against those of the matrix itself."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from mpi4py import MPI

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.system.factorisation import FactorForm, Factorisation, form_of
from hvi_fenicsx.system.petsc_options import CHOLESKY

INDEFINITE = {**CHOLESKY, "mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1}
SLOPE = 100.0
"""Falls by this much are steeper than any unknown's stiffness beside incompressible cells."""


def compared(table: Mapping[str, Any], comm: MPI.Comm = MPI.COMM_WORLD) -> dict[str, Any]:
    """Of a scene: with a tangent, some unknowns of Γc held, and others that fall steeply."""
    system = prepare(read_tables(table), comm).system
    rates = [np.eye(k.shape[1]) * (1.0 + np.arange(len(k)))[:, None, None] for k in system.jacobian.rates]
    system.jacobian.set_rates(rates)
    dofs = np.setdiff1d(system.jacobian.rows.dofs, np.union1d(system.problem.fixed, system.pins))
    held, falling = dofs[1::3], dofs[::3]
    load, difference = system.load.duplicate(), system.load.duplicate()
    load.array[:] = np.cos(np.arange(*load.owner_range))
    found, negative = [], []
    for form in (form_of(system), FactorForm(system)):
        factors = Factorisation(form, form.matrix(), INDEFINITE)
        factors.allow_negative()
        factors.factorise(held)  # and once more, as an active set method does
        factors.refresh()
        factors.add(falling, np.full(len(falling), -SLOPE))
        factors.factorise(np.union1d(held, system.pins))
        x = load.duplicate()
        factors.apply(load, x)
        right = np.concatenate([load.array_r, np.zeros(form.pressures)])
        columns = factors.columns(np.column_stack([right, 2.0 * right]))[: load.local_size]
        assert np.allclose(columns, x.array_r[:, None] * [1.0, 2.0], rtol=1e-9, atol=1e-12 * np.abs(columns).max())
        found.append(x)
        negative.append(factors.negative)
    difference.waxpy(-1.0, *found)
    pressures = comm.allgather(form_of(system).pressures)
    return {"pressures": pressures, "difference": difference.norm() / found[1].norm(), "negative": negative}


if __name__ == "__main__":
    told = compared(json.loads(sys.argv[1]))
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(told))
