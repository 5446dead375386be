"""The direct solver that condenses a body to Γc solves what a factorisation of the whole solves; floors of rounding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from runs import on_ranks
from scenes import DELTA, model, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.system import direct
from hvi_fenicsx.system.factorisation import form_of
from hvi_fenicsx.system.held_solver import HeldPreconditioner
from hvi_fenicsx.system.linear_settings import LinearSettings
from hvi_fenicsx.system.system import System

DIRECT = LinearSettings("lu")
STRONG = quadratic_linear(3e6, DELTA)


def assembled(cells: int = 8) -> System:
    return prepare(read_tables(model(cells, friction=STRONG)), MPI.COMM_SELF).system


@pytest.mark.parametrize("every", [1, 3, 1000])
def test_condensed_it_solves_what_a_factorisation_of_the_whole_solves(every: int) -> None:
    """With a tangent, and with all, some or hardly any unknowns of Γc held."""
    system, generator = assembled(), np.random.default_rng(1)
    system.jacobian.set_rates([np.eye(k.shape[1]) * generator.random((len(k), 1, 1)) for k in system.jacobian.rates])
    held = system.jacobian.rows.dofs[1::every].astype(np.int32)
    load, expected, found = (system.load.duplicate() for _ in range(3))
    load.array[:] = generator.standard_normal(load.local_size)
    expected.set(0.0)
    whole, condensed = (
        HeldPreconditioner(system, (), DIRECT, Timer()),
        direct.SchurDirect(form_of(system), {"pc_type": "cholesky"}),
    )
    whole.prepare(held)
    whole.solve(load, expected, 1e-12)
    condensed.prepare(held)
    condensed.apply(load, found)
    found.axpy(-1.0, expected)
    assert found.norm() < 1e-10 * expected.norm()


def test_condensed_on_several_ranks_it_solves_the_same() -> None:
    told = on_ranks(3, str(Path(__file__).parent / "schur_ranks.py"))
    assert sum(told["sizes"]) > max(told["sizes"]) > 0, "Γc is on one rank alone"
    assert told["difference"] < 1e-10
