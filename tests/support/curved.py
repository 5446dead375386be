"""Curved laws on two unknowns, and the search for all their stationary points."""

from __future__ import annotations

import condensed
import numpy as np

from hvi_fenicsx import laws
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.stationary_points.all_points import Enumeration
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.curved_laws import CurvedLaws

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
LAWS = {
    "chks": registered()["chks"]().relative(MODEL, 0.05),
    "narrow chks": registered()["chks"]().relative(MODEL, 0.002),
    "teeth": registered()["log_exp"]().relative(laws.Sawtooth(3.0, 1.0, 0.5, 3), 0.02),
    "paper": registered()["paper"]().relative(MODEL, 0.1),
    "exponential": laws.Exponential(2.0, 0.5, 1.0),
    "smoothed exponential": registered()["chks"]().relative(laws.Exponential(2.0, 0.5, 1.0), 0.01),
}


def enumerated(problem: CondensedProblem) -> Enumeration:
    near = scalar_problem(problem, tractions=True)
    search = Enumeration(problem=near, laws=CurvedLaws(near=near, problem=problem) if near.error else None)
    search.start()
    assert search.run(lambda: search.cells > 5000, lambda _: None)
    assert not search.undecided
    return search


def two_bonds(law: laws.Superpotential, share: float, lower: float = -np.inf) -> CondensedProblem:
    """Two bonds, each of which carries a load, with a spring between them, and another spring to the ground."""
    pull = share * float(law.right(np.linspace(0.0, 5.0, 5001)).max()) * np.array([1.05, 0.95])
    stiffness = 0.8 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + 0.1 * np.eye(2)
    first, second = (condensed.bonds(law, [i]) for i in (0, 1))
    return condensed.problem(stiffness, pull, first, second, lower=lower)


def random_pair(seed: int, pair: tuple[laws.Superpotential, laws.Superpotential]) -> CondensedProblem:
    """Two laws on any stiffness, with any load, and half of the time with a bound."""
    random = np.random.default_rng(seed)
    factor = random.normal(size=(2, 2))
    stiffness = 0.3 * factor @ factor.T + 0.02 * np.eye(2)
    lower = np.where(random.uniform(size=2) < 0.5, -np.inf, random.uniform(-0.3, 0.6, 2))
    bonds = [condensed.bonds(law, [i], signs=random.choice([-1.0, 1.0])) for i, law in enumerate(pair)]
    return condensed.problem(stiffness, random.uniform(-1.0, 3.0, 2), *bonds, lower=lower)
