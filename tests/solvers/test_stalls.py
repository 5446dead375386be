"""A solve whose full steps go round in a circle is given up; one whose residual falls now and then is not."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable

from scenes import model, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.runtime.timing import Timer
from hvi_fenicsx.solvers.active_set import ActiveSetSolver, StallTest
from hvi_fenicsx.solvers.law_models import Cells, VertexModel
from hvi_fenicsx.solvers.thresholds import Thresholds
from hvi_fenicsx.system.linear_settings import LinearSettings


def steps_until_given_up(residuals: Iterable[float], *, full_steps: bool = True) -> int | None:
    test = StallTest(Thresholds(useless_steps=10), full_steps=full_steps)
    return next((step for step, residual in enumerate(residuals) if test.gives_up(residual)), None)


def test_full_steps_in_a_circle_end_after_ten_of_them() -> None:
    circle = itertools.chain([5.9, 1.9], itertools.cycle([1.81, 1.90]))
    assert steps_until_given_up(circle) == 12


def test_a_residual_that_stands_is_given_up_at_once() -> None:
    assert steps_until_given_up([1.0, 0.5, 0.5, 0.5, 0.5]) == 3


def test_a_solve_that_is_cut_off_says_so_in_words() -> None:
    prepared = prepare(read_tables(model(4, 6e6, friction=quadratic_linear(3e6), smoothing="chks", epsilon=0.01)))
    system = prepared.system
    solver = ActiveSetSolver(system, (), LinearSettings("lu"), Timer())
    x = system.load.duplicate()
    x.set(0.0)
    (term,) = system.terms
    laws = [VertexModel(term.law, Cells.around(term.law.convex, term.argument(x.array_r), radial=term.radial))]
    found = solver.solve(x, laws, 1e-8, lower=system.lower, upper=system.upper, max_iterations=1)
    solver.destroy()
    assert not found.converged
    assert re.fullmatch(r"\D+ \(DIVERGED_[A-Z_]+\)", found.reason)
