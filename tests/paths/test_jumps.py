"""Where a path jumps to: the same whatever rounding, order and side; where two ways are equal, that is said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from condensed import bonds, graph, problem
from test_exact_paths import SOFTENING, path, random_chain, random_problem

from hvi_fenicsx.paths.state import JUMPS, Event
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.reduced.condensed_stiffness import DenseStiffness

Array = npt.NDArray[np.float64]
FEW = [*range(3), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(3, 40))]


def same_but_for_rounding(given: CondensedProblem) -> Iterator[CondensedProblem]:
    """Changed by 1e-13, and with unknowns in reverse order."""
    n = given.size
    noise = 1.0 + 1e-13 * np.random.default_rng(1).uniform(-1, 1, (n, n))
    yield replace(given, elastic=DenseStiffness(given.stiffness * (noise + noise.T) / 2))
    back = np.arange(n)[::-1]
    yield replace(
        given,
        elastic=DenseStiffness(given.stiffness[np.ix_(back, back)]),
        **{key: getattr(given, key)[back] for key in ("force", "force_rate", "lower", "upper", "points")},
        applied=given.applied[:, back],
        bonds=tuple(replace(b, unknowns=n - 1 - b.unknowns) for b in given.bonds),
    )


@pytest.mark.parametrize("make", [random_problem, random_chain])
@pytest.mark.parametrize("seed", FEW)
def test_jumps_release_the_same_whatever_rounding_and_order(seed: int, make: object) -> None:
    assert callable(make)
    given = make(seed)
    found = []
    for one in (given, *same_but_for_rounding(given)):
        follower, states = path(one, programme=(5.0,), remember=range(len(given.bonds)))
        jumps = [state for state in states if state.event in JUMPS]
        found.append((follower.end, [s.factor for s in jumps], [s.released for s in jumps]))
    for end, factors, released in found[1:]:
        assert end is found[0][0]
        assert factors == pytest.approx(found[0][1], rel=1e-6)
        assert released == pytest.approx(found[0][2], rel=1e-6, abs=1e-6 * max(found[0][2], default=1.0))


@pytest.mark.parametrize("remember", [(), (0,)])
def test_of_two_bonds_in_a_row_either_may_break(remember: tuple[int, ...]) -> None:
    """By hand: both are at their peak at λ = 2 + 1/k, 1 + 1/2k is stored; one breaks and loses 3/4, one unloads."""
    k = 4.0
    given = problem(np.full((2, 2), k), [k, k], bonds(graph(SOFTENING), [0, 1]))
    _, states = path(given, programme=(3.0,), remember=remember)
    (jump,) = (state for state in states if state.event in JUMPS)
    assert jump.event is Event.BRANCHING
    assert jump.factor == pytest.approx(2.0 + 1.0 / k)
    assert sorted(jump.x) == pytest.approx([0.0, 2.0 + 1.0 / k], abs=1e-9)
    assert jump.released == pytest.approx(1.0 + 0.5 / k - 0.75, rel=1e-5)  # pushed off, the other bond softens by 1e-6
