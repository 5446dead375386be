"""The direct solver that condenses a body to Γc solves what a factorisation of the whole solves; floors of rounding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from mpi4py import MPI
from runs import on_ranks
from scenes import DELTA, displacement, model, quadratic_linear, solved
from schur_ranks import SCENE

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.convergence import Outcome, Sizes
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.system import direct
from hvi_fenicsx.system.factorisation import form_of
from hvi_fenicsx.system.held_solver import Goal, HeldPreconditioner
from hvi_fenicsx.system.linear_settings import LinearSettings
from hvi_fenicsx.system.system import System
from hvi_fenicsx.system.thresholds import Thresholds as LinearThresholds
from hvi_fenicsx.workflow import Thresholds

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
    whole.solve(load, expected, Goal(rtol=1e-12))
    condensed.prepare(held)
    condensed.apply(load, found)
    found.axpy(-1.0, expected)
    assert found.norm() < 1e-10 * expected.norm()


def test_condensed_on_several_ranks_it_solves_the_same() -> None:
    told = on_ranks(3, str(Path(__file__).parent / "schur_ranks.py"))
    assert sum(told["sizes"]) > max(told["sizes"]) > 0, "Γc is on one rank alone"
    assert told["difference"] < 1e-10


def test_algebraic_multigrid_that_is_made_again_and_again_gives_way_to_a_direct_solver() -> None:
    """Its setup took 0.6 s in each of 300 Newton steps on long cells, where factorising takes 0.05 s."""
    table = SCENE | {"material": SCENE["material"] | {"poisson_ratio": 0.3}}
    system = prepare(read_tables(table), MPI.COMM_SELF).system
    solver = HeldPreconditioner(
        system, (), LinearSettings("gamg", LinearThresholds(slow=20), replaceable=True), Timer()
    )
    dofs, x = system.jacobian.rows.dofs.astype(np.int32), system.load.duplicate()
    kinds = []
    for step in range(22):
        solver.prepare(dofs[step % 2 :: 2])
        x.set(0.0)
        solver.solve(system.load.copy(), x, Goal(rtol=1e-2))
        kinds.append(solver.settings.kind)
    assert kinds == ["gamg"] * 20 + ["lu"] * 2


def test_a_run_that_condenses_ends_where_one_that_does_not_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[direct.SchurDirect] = []
    begin = direct.SchurDirect.__init__
    monkeypatch.setattr(direct.SchurDirect, "__init__", lambda self, *args: (made.append(self), begin(self, *args))[1])
    found: list[npt.NDArray[np.float64]] = []
    for worth in (0, 1_000):  # never; from the second factorisation on
        thresholds = Thresholds(solvers=SolverThresholds(linear=LinearThresholds(condensing=worth)))
        found.append(displacement(solved(model(16, 6e6, friction=STRONG, linear_solver="lu"), thresholds)))
    assert len(made) == 1
    assert np.max(np.abs(found[1] - found[0])) < 1e-9 * np.max(np.abs(found[0]))


def test_rounding_of_the_bodys_forces_is_no_excuse_for_a_wrong_traction() -> None:
    """A residual under the larger floor, but over the floor of its own, has not converged."""
    system = assembled()
    solver = ActiveSetSolver(system, (), DIRECT, Timer())
    x = system.load.duplicate()
    x.array[:] = np.random.default_rng(2).standard_normal(x.local_size)
    norm, traction = solver.convergence.rounding(x)
    between, none = np.sqrt(norm * traction), np.zeros(1)
    of_norm, of_traction = (Sizes(*sizes, none, none, none) for sizes in ((between, none), (none, between)))
    wrong, right = (of_norm, of_traction) if norm < traction else (of_traction, of_norm)
    outcome = Outcome(False, 1, 1, float(between[0]), "stalled")
    assert not solver.convergence.accept_rounding(outcome, wrong, x, 1e-8).converged
    assert solver.convergence.accept_rounding(outcome, right, x, 1e-8).converged
