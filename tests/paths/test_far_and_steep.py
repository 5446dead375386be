"""Exact paths where coordinates have very different sizes: steep pieces of laws, and bodies that come off."""

from __future__ import annotations

import numpy as np
import pytest
from condensed import bonds, graph, problem

from hvi_fenicsx.paths.follower import Follower
from hvi_fenicsx.paths.state import End, PathOptions
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem


@pytest.mark.parametrize("aim", [0.405, 0.6, 0.805, 0.811, 0.815, 0.9])
def test_the_end_of_a_steep_piece_is_not_passed(aim: float) -> None:
    """A law rises by 4e-4 within 2e-11, beside an unknown that moves by 1; by hand: x + t(x) = λ/1000."""
    law = graph([(0, 0), (1e-5, 4e-4), (1.000002e-5, 8e-4), (1.0, 8e-4)])
    given = problem(np.eye(2), [1e-3, 1.0], bonds(law, 0))
    *_, last = Follower(given, PathOptions(programme=(aim,))).states()
    wanted = 1e-3 * aim / 41.0 if aim < 0.41 else max(1e-5, 1e-3 * aim - 8e-4)
    assert last.factor == aim
    assert last.x == pytest.approx([wanted, aim], rel=1e-5, abs=0.0)


def sliding(seed: int, stiffnesses: tuple[float, ...]) -> CondensedProblem:
    """A free body on bonds that soften to 0.3, pulled by the factor; its deformations have these stiffnesses."""
    n = len(stiffnesses) + 1
    basis = np.random.default_rng(seed).standard_normal((n, n))
    basis[:, 0] = 1.0
    modes = np.linalg.qr(basis)[0][:, 1:]
    law = graph([(0, 0), (1, 1), (2, 0.3)])
    return problem(modes * stiffnesses @ modes.T, np.full(n, 1.0 / n), bonds(law, np.arange(n), 1.0 / n))


@pytest.mark.parametrize("seed", range(20))
def test_what_nothing_holds_comes_off(seed: int) -> None:
    """Statics: all bonds bear 0.3 together. Rounding makes the singular equations of sliding bonds regular."""
    follower = Follower(sliding(seed, (1.0, 2.0, 3.0, 4.0, 5.0)), PathOptions(programme=(9.0,)))
    assert max(state.factor for state in follower.states()) <= 1.0 + 1e-9
    assert follower.end is End.ESCAPES
