"""Why: a wrong tangent of a law still leads to the solution, only in more steps; so it is held to its own traction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import STEEL, Table, model

from hvi_fenicsx import prepare, read_tables

SMOOTH = {"law": "quadratic_linear", "gamma1": 1.0e6, "gamma2": 0.5e6, "delta": 9.0e-6}


def in_space() -> Table:
    """A cube on a floor with a law of |u_t|, held at one side in x only."""
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [2, 2, 2]},
        "material": STEEL | {"model": "three_dimensional"},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "press": {"on": "top", "traction": [0.0, 0.0, -1.0e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": SMOOTH},
        },
        "solver": {"smoothing": "quadratic", "epsilon": 0.5},
    }


def in_the_plane() -> Table:
    return model(3, friction=SMOOTH, smoothing="quadratic", epsilon=0.5)


@pytest.mark.parametrize("scene", [in_the_plane, in_space])
def test_the_tangent_is_the_derivative_of_the_traction(scene: Callable[[], Table]) -> None:
    """By central differences at random slips; a prescribed component neither feels the law nor moves it."""
    problem = prepare(read_tables(scene())).problem
    (term,) = problem.terms
    random = np.random.default_rng(4)
    d = term.free.shape[1]
    u = random.normal(size=problem.points.shape[0] * d)

    def traction(at: np.ndarray) -> np.ndarray:
        derivative = term.law.convex.right(term.argument(at)) - term.law.concave.right(term.argument(at))
        return np.asarray(term.force(at, derivative) / term.weights[:, None])

    argument = term.argument(u)
    first = term.law.convex.right(argument) - term.law.concave.right(argument)
    rate = term.rate(u, first, term.law.convex.second(argument) - term.law.concave.second(argument))
    step = 1e-6
    for component in range(d):
        moved = np.zeros_like(u).reshape(-1, d)
        moved[term.surface.blocks, component] = step
        change = (traction(u + moved.ravel()) - traction(u - moved.ravel())) / (2 * step)
        np.testing.assert_allclose(
            rate[:, :, component], change * term.free[:, [component]], atol=1e-4 * abs(rate).max()
        )
    held = term.free == 0
    assert held.any()
    assert not rate[held].any()
    assert not rate.transpose(0, 2, 1)[held].any()
