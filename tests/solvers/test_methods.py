"""The methods to compare with, PETSc's own from a plugin: they agree with the branch iteration, or say they do not."""

from __future__ import annotations

import logging
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import P, Table, displacement, energy, far, model, quadratic_linear, solved

from hvi_fenicsx import Solution, prepare, read_tables
from hvi_fenicsx.system.thresholds import Thresholds
from hvi_fenicsx.workflow import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
import petsc_methods  # noqa: F401

METHODS = ["tao", "condensed"]
LIFTING = [0.0, "-1e6*(1 - 1.8*x)"]


def strong(cells: int, pull: float, gamma1: float, lift: bool = False, **solver: Any) -> Table:
    """A law of the order of the load; a press that turns round lifts the free end off the floor."""
    table = model(cells, pull, friction=quadratic_linear(gamma1), **solver)
    if lift:
        table["boundary"]["press"]["traction"] = list(LIFTING)
    return table


def paper(**solver: Any) -> Table:
    """The paper's own data."""
    return strong(16, P, 1.0e3, **solver)


def lifted(solution: Solution) -> int:
    assert solution.examination is not None
    return int(np.count_nonzero(~solution.examination.states[0].contact))


def assert_alike(found: Solution, wanted: Solution) -> None:
    assert found.exit_code == wanted.exit_code == 0
    assert found.solve_result is not None
    assert found.solve_result.converged
    assert energy(found) == pytest.approx(energy(wanted), rel=1e-8)
    assert far(displacement(found), displacement(wanted)) < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_on_the_papers_data_all_methods_agree(method: str) -> None:
    """The smoothed law through `auto`, which is the branch iteration."""
    wanted = solved(paper(epsilon=0.01))
    assert_alike(solved(paper(epsilon=0.01, method=method)), wanted)


@pytest.mark.parametrize("method", METHODS)
def test_where_the_body_lifts_off_all_methods_agree(method: str) -> None:
    wanted = solved(strong(16, 3 * P, 1.0e6, lift=True, epsilon=0.1))
    found = solved(strong(16, 3 * P, 1.0e6, lift=True, epsilon=0.1, method=method))
    assert 0 < lifted(wanted) < 17
    assert lifted(found) == lifted(wanted)
    assert_alike(found, wanted)


CASES = [(6.0e6, 3.0e6, 0.1), (1.0e7, 8.0e6, 1.0e-2)]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("lift", [False, True])
@pytest.mark.parametrize(("pull", "gamma1", "epsilon"), CASES)
def test_what_a_method_claims_the_certificate_confirms(
    method: str, lift: bool, pull: float, gamma1: float, epsilon: float
) -> None:
    """A method may fail on a hard case, but then it says so, with a reason in words."""
    found = solved(strong(16, pull, gamma1, lift, epsilon=epsilon, method=method))
    assert found.solve_result is not None
    assert found.solve_result.converged == found.converged
    assert found.exit_code == (0 if found.converged else 4)
    if not found.converged:
        assert "stopped: " in found.solve_result.reason


def test_the_papers_procedure_gets_stuck_where_the_law_is_strong() -> None:
    """At P = 6e6, γ1 = 3e6 its merit function has a local minimum that is no solution (solver-notes.md)."""
    found = solved(strong(16, 6 * P, 3.0e6, epsilon=0.1, method="condensed"))
    assert found.exit_code == 4
    assert "merit" in found.reason


@pytest.mark.parametrize("method", METHODS)
def test_iterations_that_run_out_are_said_to(method: str) -> None:
    found = solved(strong(16, 6 * P, 3.0e6, epsilon=1.0, method=method, max_iterations=2))
    assert found.exit_code == 4
    assert found.solve_result is not None
    assert {"tao": "DIVERGED_MAXITS", "condensed": "used up"}[method] in found.solve_result.reason


@pytest.mark.parametrize("method", METHODS)
def test_an_interrupt_ends_the_iteration(method: str) -> None:
    prepared = prepare(read_tables(strong(8, 6 * P, 3.0e6, epsilon=0.1, method=method)))
    found = finish(prepared, interrupted=lambda: True)
    assert found.exit_code == 130
    assert found.solve_result is not None
    assert "interrupted" in found.solve_result.reason


def test_an_interrupt_on_the_second_level_of_three_gives_what_was_found_there(caplog: pytest.LogCaptureFixture) -> None:
    """The third one was set up, and began at zero."""
    thresholds = Thresholds(nested_from=500)
    scene = read_tables(model(32, 3e6, friction=quadratic_linear(1.0e6)))
    whole = finish(prepare(scene, thresholds=thresholds)).solve_result
    prepared = prepare(scene, thresholds=thresholds)

    def begun() -> int:
        return sum(record.getMessage().startswith("level of") for record in caplog.records)

    with caplog.at_level(logging.INFO, logger="hvi_fenicsx.solvers"):
        found = finish(prepared, interrupted=lambda: begun() == 2)
    assert begun() == 2
    assert found.exit_code == 130
    assert whole is not None
    assert found.solve_result is not None
    off = found.solve_result.u.x.array - whole.u.x.array
    assert np.linalg.norm(off) < 0.1 * np.linalg.norm(whole.u.x.array)


@pytest.mark.parametrize("wanted", [{}, {"smoothing": "paper", "epsilon_absolute": 0.1}], ids=["the law itself", "S"])
def test_the_papers_procedure_takes_the_papers_law(wanted: Table) -> None:
    """No vertex ends on a kink but the wall's corner, where the slip is prescribed."""
    assert_alike(solved(paper(method="condensed", **wanted)), solved(paper(**wanted)))
