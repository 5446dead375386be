"""Linear solves in which some unknowns are held."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from scenes import model

from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.scene import Scene
from hvi_fenicsx.system import petsc_options
from hvi_fenicsx.system.held_solver import Goal, HeldPreconditioner
from hvi_fenicsx.system.linear_settings import LinearSettings
from hvi_fenicsx.system.system import System
from hvi_fenicsx.typing import Array
from hvi_fenicsx.workflow import prepare


@pytest.fixture(scope="module")
def system() -> System:
    return prepare(Scene.model_validate(model(16)), MPI.COMM_SELF).system


def kept(system: System) -> HeldPreconditioner:
    """Algebraic multigrid that was made for other held unknowns and another tangent, and is kept."""
    solver, dofs = HeldPreconditioner(system, (), LinearSettings("gamg"), Timer()), system.jacobian.rows.dofs
    for stiffness, held in ((0.3, dofs[1::2]), (0.5, dofs[3::2])):
        system.jacobian.set_rates([stiffness * np.ones((len(k), 1, 1)) * np.eye(2) for k in system.jacobian.rates])
        solver.prepare(held.astype(np.int32))
    return solver


def left(system: System, x: Array) -> Array:
    """The load less J x, without what is held."""
    given, product = system.load.duplicate(), system.load.duplicate()
    given.array[:] = x
    system.jacobian.matrix.mult(given, product)
    found = system.load.array_r - product.array_r
    found[system.jacobian.rows.dofs[3::2]] = 0.0
    return np.asarray(found)


@pytest.mark.parametrize("method", ["cg", "gmres", "minres", "symmlq"])
def test_a_preconditioner_that_is_kept_solves_with_the_present_matrix(system: System, method: str) -> None:
    solver, x = kept(system), system.load.duplicate()
    load = system.load.copy()
    held = system.jacobian.rows.dofs[3::2]
    load.array[held] = 0.0
    with petsc_options.chosen({"ksp_type": method}, "kept_"):
        assert solver.solve(load, x, Goal(rtol=1e-11))[1] > 0
    assert np.all(x.array_r[held] == 0.0)
    assert np.linalg.norm(left(system, x.array_r)) <= 1e-9 * load.norm()


def test_a_solve_ends_as_soon_as_its_goal_is_reached(system: System) -> None:
    """By the largest entry of the residual, which PETSc's own tests do not know; the last iteration counts once."""
    solver, x, asked = kept(system), system.load.duplicate(), []
    load = system.load.copy()
    load.array[system.jacobian.rows.dofs[3::2]] = 0.0
    most = 1e-4 * float(np.max(np.abs(load.array_r)))

    def reached(residual: Array) -> bool:
        asked.append(float(np.max(np.abs(residual))))
        return asked[-1] <= most

    iterations, reason = solver.solve(load, x, Goal(rtol=1e-8, reached=reached))
    assert reason > 0
    assert iterations == len(asked)
    assert asked[-1] <= most < min(asked[:-1])
    assert np.max(np.abs(left(system, x.array_r))) == pytest.approx(asked[-1], rel=1e-6)
