"""Equilibria of curved laws by the cells of their polylines: against a scan of one unknown, and on whole bodies."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from scenes import model, quadratic_linear
from scipy.optimize import brentq

import hvi_fenicsx as hvi
from hvi_fenicsx import laws
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.search import Task, find
from hvi_fenicsx.equilibrium_search.stationarity import Kind, StationaryPoint, stationary_point
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.typing import Array

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
CHKS = registered()["chks"]().relative(MODEL, 0.05)
TEETH = registered()["log_exp"]().relative(laws.Sawtooth(3.0, 1.0, 0.5, 3), 0.02)
PAPER = registered()["paper"]().relative(MODEL, 0.1)
SPRING = 0.8


def two_bonds(law: laws.Superpotential, pull: Array) -> CondensedProblem:
    """Two bonds, each of which carries a load, with a spring between them, and another spring to the ground."""
    stiffness = SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]]) + 0.1 * np.eye(2)
    return condensed.problem(stiffness, pull, condensed.bonds(law, [0, 1]))


def searched(problem: CondensedProblem) -> tuple[StationaryPoint, ...]:
    near = scalar_problem(problem)
    return find(Task(problem=near, exact=lambda x: stationary_point(near, problem, x))).points


def scanned(law: laws.Superpotential, pull: Array) -> Array:
    """All equilibria: the balance of the first bond gives the second's displacement, the second's is scanned."""

    def second(x: Array) -> Array:
        return x + (0.1 * x + law.right(x) - pull[0]) / SPRING

    def rest(x: Array) -> Array:
        y = second(x)
        return np.asarray(0.1 * y + SPRING * (y - x) + law.right(y) - pull[1])

    x = np.linspace(-5.0, 60.0, 400_001)
    at = np.flatnonzero(np.diff(np.sign(rest(x))))
    ends = [(x[i], x[i + 1]) for i in at]
    first = np.array([brentq(lambda one: rest(np.array([one]))[0], *pair, xtol=1e-14) for pair in ends])
    return np.column_stack([first, second(first)])


@pytest.mark.parametrize(
    ("law", "share", "count"),
    [(CHKS, 0.9, 5), (PAPER, 0.9, 5), (TEETH, 0.9, 9), pytest.param(TEETH, 0.5, 17, marks=pytest.mark.long)],
)
def test_minimisers_and_saddles_of_two_bonds_are_those_of_a_scan(
    law: laws.Superpotential, share: float, count: int
) -> None:
    pull = share * float(law.right(np.linspace(0.0, 5.0, 5001)).max()) * np.array([1.05, 0.95])
    both, wanted = two_bonds(law, pull), scanned(law, pull)
    found = searched(both)
    assert len(found) == len(wanted) == count
    for point in found:
        assert np.min(np.abs(wanted - point.x).max(axis=1)) < 1e-8
        turning = both.stiffness + np.diag(law.convex.second(point.x) - law.concave.second(point.x))
        assert (point.kind == Kind.MINIMISER) == bool(np.linalg.eigvalsh(turning)[0] > 0.0)


def test_all_saddles_of_a_curved_scene_are_certified() -> None:
    """No solver makes a saddle exact; each is certified as it was found. A small ε leaves their number as it is."""
    plain = hvi.equilibria(hvi.read_tables(model(2, 6e6, 1e6, quadratic_linear(3e6))))
    smooth = {"smoothing": "chks", "epsilon": 1e-4}
    found = hvi.equilibria(hvi.read_tables(model(2, 6e6, 1e6, quadratic_linear(3e6), **smooth)))
    assert all(s.converged for s in found.solutions)
    assert sorted(found.kinds) == sorted(plain.kinds)
    assert [s.energy for s in found.solutions] == pytest.approx([s.energy for s in plain.solutions], rel=1e-3)
