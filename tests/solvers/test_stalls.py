"""A solve whose full steps go round in a circle is given up; one whose residual falls now and then is not."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

from hvi_fenicsx.solvers.stalls import StallTest
from hvi_fenicsx.solvers.thresholds import ActiveSetThresholds


def steps_until_given_up(residuals: Iterable[float], *, full_steps: bool = True) -> int | None:
    test = StallTest(ActiveSetThresholds(useless_steps=10), full_steps=full_steps)
    return next((step for step, residual in enumerate(residuals) if test.gives_up(residual)), None)


def test_full_steps_in_a_circle_end_after_ten_of_them() -> None:
    circle = itertools.chain([5.9, 1.9], itertools.cycle([1.81, 1.90]))
    assert steps_until_given_up(circle) == 11


def test_a_line_search_that_lowers_the_energy_may_go_on() -> None:
    assert steps_until_given_up(itertools.islice(itertools.cycle([1.81, 1.90]), 50), full_steps=False) is None


def test_a_residual_that_falls_now_and_then_is_no_circle() -> None:
    falling = (residual for turn in range(10) for residual in (0.5**turn, *[2.0, 1.5] * 4))
    assert steps_until_given_up(falling) is None


def test_a_residual_that_stands_is_given_up_at_once() -> None:
    assert steps_until_given_up([1.0, 0.5, 0.5, 0.5, 0.5]) == 3
