"""Curved paths where rounding and sharp corners come near to the steps: bodies that lean far, plateaus, light loads."""

from __future__ import annotations

import numpy as np
import pytest
from condensed import bonds, chain, problem
from test_curved_paths import path, peak

from hvi_fenicsx.laws import Exponential
from hvi_fenicsx.laws.smoothing import create
from hvi_fenicsx.paths.state import End, Follow
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem

SHARP = create("chks", Exponential(1.0, 0.3, 0.5), epsilon=1e-6)


def pulled(n: int, spring: float) -> CondensedProblem:
    """A glued chain, pulled at the far end of a spring."""
    stiffness = np.zeros((n + 1, n + 1))
    stiffness[:n, :n] = chain(n, 2.0)
    stiffness[n - 1 :, n - 1 :] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return problem(stiffness, np.eye(1, n + 1, n)[0], bonds(SHARP, np.arange(n)))


@pytest.mark.long
@pytest.mark.parametrize("follow", Follow)
def test_what_is_borne_does_not_depend_on_the_spring_that_a_load_pulls_at(follow: Follow) -> None:
    """Statics: all of the load is in the spring. Its end moves by 2e4, beside corners of the law that are 1e-6 wide."""
    wanted = path(pulled(4, 1.0), programme=(9.0,), follow=follow)[1]
    follower, states = path(pulled(4, 1e-4), programme=(9.0,), follow=follow)
    assert np.max(np.abs(states[-1].x)) > 2e4
    assert peak(states) == pytest.approx(peak(wanted), rel=1e-12)
    if follow is Follow.STABLE:
        assert follower.end is End.ESCAPES
        assert np.min(np.diff([s.factor for s in states])) > -1e-12  # a landing on the fold itself would lead back
