"""All equilibria of curved laws, proven: against scans of two unknowns, random starts, and polylines for ε → 0."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import condensed
import numpy as np
import pytest
from curved import LAWS, enumerated, random_pair, two_bonds
from scenes import Table, model, quadratic_linear
from scipy.optimize import root

from hvi_fenicsx import Scene, laws
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.curved_laws import CurvedLaws
from hvi_fenicsx.stationary_points.found import Found, Wanted
from hvi_fenicsx.stationary_points.search import find
from hvi_fenicsx.typing import Array
from hvi_fenicsx.workflow import prepare

FAR = 2000.0
MOST_PUSH = 20.0
"""Forces that a bound bears are not larger."""


def graph(law: laws.Superpotential, lower: float, sign: float) -> tuple[Array, Array]:
    """Points along the graph of a law and a lower bound, jumps included, which rise: displacements and tractions."""
    tail = np.geomspace(6.0, FAR, 20_000)
    x = np.unique(np.concatenate([np.linspace(-6.0, 6.0, 200_001), tail, -tail, law.kinks, [max(lower, -FAR)]]))
    x = x[x >= lower]
    left, right = np.sort(sign * np.stack([law.left(sign * x), law.right(sign * x)]), axis=0)
    left[x == lower] = right[x == lower] - MOST_PUSH
    places, tractions = [x], [right]
    for at in np.flatnonzero(right > left):
        tractions.append(np.linspace(left[at], right[at], 100_000, endpoint=False))
        places.append(np.full(tractions[-1].size, x[at]))
    order = np.lexsort((np.concatenate(tractions), np.concatenate(places)))
    return np.concatenate(places)[order], np.concatenate(tractions)[order]


def scanned(problem: CondensedProblem) -> int:
    """How often the second's balance changes its sign along the graph of the first, whose balance gives the second."""
    (s, f), (first, second) = (problem.stiffness, problem.load(1.0)), problem.bonds
    x, t = graph(first.law, problem.lower[0], float(first.signs[0, 0]))
    y = (f[0] - first.weights[0] * t - s[0, 0] * x) / s[0, 1]
    sign = float(second.signs[0, 0])
    rest = s[0, 1] * x + s[1, 1] * y + second.weights[0] * sign * second.law.right(sign * y) - f[1]
    rest = np.where(y < problem.lower[1], -np.inf, rest)
    return int(np.count_nonzero(np.diff(np.sign(rest))))


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9, 1.02])
def test_all_points_of_two_bonds_are_those_of_a_scan(law: laws.Superpotential, share: float) -> None:
    problem = two_bonds(law, share)
    assert len(enumerated(problem).points) == scanned(problem)


@pytest.mark.parametrize("seed", range(24))
def test_all_points_of_two_laws_with_bounds_are_those_of_a_scan(seed: int) -> None:
    every = list(LAWS.values())
    problem = random_pair(seed, (every[seed % 6], every[(seed // 2) % 6]))
    assert len(enumerated(problem).points) == scanned(problem)


@pytest.mark.parametrize("seed", range(5))
def test_bonds_that_can_all_stick_have_the_point_at_rest(seed: int) -> None:
    """No bond's load is above its peak, so that rest is an equilibrium; there bounds and jumps of laws meet."""
    random = np.random.default_rng(seed)
    n = 2 + seed % 2
    factor = random.normal(size=(n, n))
    peaks = random.uniform(0.5, 1.5, n)
    bonds = [condensed.bonds(laws.Exponential(p, 0.2 * p, random.uniform(0.3, 2.0)), [i]) for i, p in enumerate(peaks)]
    problem = condensed.problem(
        0.3 * factor @ factor.T + 0.02 * np.eye(n),
        random.uniform(-0.5, 0.99, n) * peaks,
        *bonds,
        lower=np.where(random.uniform(size=n) < 0.5, 0.0, -np.inf),
    )
    points = enumerated(problem).points
    assert min(float(np.max(np.abs(point.x))) for point in points) < 1e-9


def condensed_scene(table: Table) -> CondensedProblem:
    return Condensation(prepare(Scene.model_validate(table)).system).problem


def support(cells: list[int], **solver: Any) -> Table:
    """The block on a support that gives way, of demos/jureczka_ochal.toml: nothing but laws below."""
    graph = {"law": "graph", "points": [[0.0, 0.0], [0.1, 2.0], [0.1, 0.0]], "one_sided": True}
    return {
        "domain": {"shape": "rectangle", "size": [2.0, 1.0], "cells": cells},
        "material": {"model": "plane_strain", "youngs_modulus": 10.0, "poisson_ratio": 0.25},
        "body": {"force": [-1.2, -0.9]},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 0.0]},
            "ground": {"on": "bottom", "support": graph},
        },
        "solver": solver,
    }


def rest(problem: CondensedProblem, x: Array) -> Array:
    """The balance of smooth laws and contact: zero where no force is missing, or a bound bears it."""
    missing = problem.stiffness @ x - problem.load(1.0)
    for b in problem.bonds:
        np.add.at(missing, b.unknowns[:, 0], b.weights * b.signs[:, 0] * b.law.right(b.argument(x)))
    size = 1.0 / np.diag(problem.stiffness)
    above = np.where(np.isfinite(problem.lower), x - problem.lower, np.inf)
    below = np.where(np.isfinite(problem.upper), x - problem.upper, -np.inf)
    return np.asarray(np.maximum(np.minimum(missing * size, above), below))


def from_random_starts(problem: CondensedProblem, box: tuple[Array, Array], starts: int) -> list[Array]:
    """Different roots by Powell's hybrid method, without derivatives, from random places."""
    random, found = np.random.default_rng(3), list[Array]()
    for _ in range(starts):
        answer = root(lambda x: rest(problem, x), random.uniform(*box), method="hybr", options={"xtol": 1e-13})
        x = answer.x
        if np.abs(rest(problem, x)).max() < 1e-10 and not any(np.abs(y - x).max() < 1e-6 for y in found):
            found.append(x)
    return found


def nearest(points: Array, x: Array) -> float:
    """How far the nearest of some points is."""
    return float(np.abs(points - x).max(axis=1).min())


def index_sum(problem: CondensedProblem, points: Array) -> int:
    """The sum of the signs of det(S + slopes): one for all points of a smooth energy that rises far away (Morse)."""
    total = 0
    for x in points:
        matrix = problem.stiffness.copy()
        for b in problem.bonds:
            slope = b.law.convex.second(b.argument(x)) - b.law.concave.second(b.argument(x))
            matrix[b.unknowns[:, 0], b.unknowns[:, 0]] += b.weights * slope
        total += int(np.sign(np.linalg.det(matrix)))
    return total


@pytest.mark.parametrize(
    ("smoothing", "epsilon", "count"),
    [
        ("chks", 0.05, 23),
        *(pytest.param(*case, marks=pytest.mark.long) for case in [("chks", 0.02, 31), ("log_exp", 0.02, 33)]),
    ],
)
def test_a_support_that_gives_way_has_no_points_but_those_listed(smoothing: str, epsilon: float, count: int) -> None:
    """Random starts reach two thirds of them, and no other; that none of the rest is missing, the indices tell."""
    problem = condensed_scene(support([4, 2], smoothing=smoothing, epsilon=epsilon))
    points = np.array([p.x for p in enumerated(problem).points])
    reached = from_random_starts(problem, (np.full(4, -0.5), np.full(4, -0.02)), 1000)
    assert max(nearest(points, x) for x in reached) < 1e-8
    assert len(reached) > 0.5 * count
    assert len(points) == count
    assert index_sum(problem, points) == 1


@pytest.mark.parametrize(("smoothing", "epsilon"), [("chks", 0.05), ("chks", 0.001), ("log_exp", 0.02)])
def test_two_vertices_on_a_support_that_gives_way_have_the_points_of_a_scan(smoothing: str, epsilon: float) -> None:
    whole = condensed_scene(support([2, 1], smoothing=smoothing, epsilon=epsilon))
    (bonds,) = whole.bonds
    first, second = (condensed.bonds(bonds.law, [i], bonds.weights[i], bonds.signs[i, 0]) for i in bonds.unknowns[:, 0])
    problem = condensed.problem(whole.stiffness, whole.load(1.0), first, second)
    assert len(enumerated(whole).points) == scanned(problem) > 1


@pytest.mark.parametrize(("smoothing", "cells"), [("chks", 3), ("log_exp", 3), ("log_exp", 4)])
def test_random_starts_find_all_points_of_a_floor_with_contact_and_no_others(smoothing: str, cells: int) -> None:
    pull, strength = {3: (6e6, 3e6), 4: (8e6, 6e6)}[cells]
    table = model(cells, pull, 1e6, quadratic_linear(strength), smoothing=smoothing, epsilon=0.005)
    problem = condensed_scene(table)
    points = np.array([p.x for p in enumerated(problem).points])
    low, high = points.min(axis=0), points.max(axis=0)
    wide = 0.2 * (high - low) + 0.05 * np.max(np.abs(points))
    reached = from_random_starts(problem, (low - wide, high + wide), 300)
    assert max(nearest(points, x) for x in reached) < 1e-6
    assert len(reached) == len(points) == 3


@pytest.mark.long
def test_with_a_small_width_there_are_as_many_points_as_without_smoothing() -> None:
    plain = enumerated(condensed_scene(support([4, 2])))
    smooth = enumerated(condensed_scene(support([4, 2], smoothing="chks", epsilon=1e-4)))
    assert len(smooth.points) == len(plain.points) == 45
    energies = [sorted(p.energy for p in search.points) for search in (smooth, plain)]
    np.testing.assert_allclose(*energies, rtol=1e-3)
    kinds = [sorted(p.kind for p in search.points) for search in (smooth, plain)]
    assert kinds[0] == kinds[1]


def test_a_search_of_curved_laws_that_was_stopped_goes_on() -> None:
    problem = condensed_scene(support([4, 2], smoothing="chks", epsilon=0.05))
    near = scalar_problem(problem, tractions=True)
    wanted = Wanted(curved=CurvedLaws(near=near, problem=problem))
    stops = iter([*[False] * 20, *[True] * 10_000])
    begun = find(near, wanted, lambda: next(stops), lambda _: None)
    assert not begun.complete
    done = find(near, wanted, lambda: False, lambda _: None, saved=begun.left)
    assert done.complete
    assert done.proven
    assert len(done.points) == 23


@dataclass(frozen=True)
class Unknown(laws.weakening.WeakeningLaw, register=False):
    """The exponential law, of which no bound of the slopes is told."""

    name = "unknown"

    def shape(self, z: Array) -> tuple[Array, Array, Array]:
        return z + np.expm1(-z), -np.expm1(-z), np.exp(-z)


@pytest.mark.parametrize(("law", "complete"), [(LAWS["exponential"], True), (Unknown(2.0, 0.5, 1.0), False)])
def test_of_a_law_without_bounds_of_its_slopes_points_are_found_without_a_proof(
    law: laws.Superpotential, complete: bool
) -> None:
    problem = two_bonds(law, 0.9)
    near = scalar_problem(problem, tractions=True)
    found = find(near, Wanted(curved=CurvedLaws(near=near, problem=problem)), lambda: False, lambda _: None)
    assert len(found.points) == scanned(problem)
    assert (found.complete, found.proven) == (complete, complete)


def test_at_a_fold_a_cell_stays_open_also_when_the_search_goes_on() -> None:
    """The spring is as stiff as the law falls where the forces meet: two points are one, to rounding."""
    fall = 1.5 * np.exp(-1.0)
    problem = condensed.problem([[fall]], [fall + 0.5 + fall], condensed.bonds(LAWS["exponential"], [0]))
    near = scalar_problem(problem, tractions=True)
    wanted = Wanted(curved=CurvedLaws(near=near, problem=problem))
    found = find(near, wanted, lambda: False, lambda _: None)
    again = find(near, wanted, lambda: False, lambda _: None, saved=found.left)
    assert (found.complete, again.complete) == (False, False)
    for one in (found, again):  # the two are listed once
        np.testing.assert_allclose(sorted(p.x[0] for p in one.points), [0.0, 1.0], atol=1e-7)


@pytest.mark.parametrize("above", [1e-10, 1e-8])
def test_two_points_near_a_fold_are_two_and_each_is_listed_once(above: float) -> None:
    """By hand: at 1 + z the law bears 0.5 + fall (1 - z + ½ z²), the spring fall (1 + z); ½ fall z² is the excess."""
    fall = 1.5 * np.exp(-1.0)
    load = (2.0 * fall + 0.5) * (1.0 + above)
    problem = condensed.problem([[fall]], [load], condensed.bonds(LAWS["exponential"], [0]))
    near = scalar_problem(problem, tractions=True)
    found = find(near, Wanted(curved=CurvedLaws(near=near, problem=problem)), lambda: False, lambda _: None)
    apart = np.sqrt(2.0 * (2.0 * fall + 0.5) * above / fall)
    wanted = [0.0, 1.0 - apart, 1.0 + apart]
    np.testing.assert_allclose(sorted(p.x[0] for p in found.points), wanted, rtol=1e-3 * apart, atol=1e-12)


def searched(problem: CondensedProblem, most_cells: int = 5000) -> Found:
    near, cells = scalar_problem(problem, tractions=True), itertools.count()
    wanted = Wanted(curved=CurvedLaws(near=near, problem=problem))
    return find(near, wanted, lambda: next(cells) > most_cells, lambda _: None)


def test_two_bodies_at_a_fold_together_end_the_search_with_words() -> None:
    fall = 1.5 * np.exp(-1.0)
    stiffness = fall * np.eye(2) + 0.1 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    found = searched(condensed.problem(stiffness, [2.0 * fall + 0.5] * 2, condensed.bonds(LAWS["exponential"], [0, 1])))
    assert not found.complete
    assert "too small to be divided" in found.reason
    places = np.array(sorted(p.x.tolist() for p in found.points))
    np.testing.assert_allclose(places, [[0.0, 0.0], [1.0, 1.0]], atol=1e-6)


def test_a_block_on_the_straight_tail_of_a_curved_law_is_reported_as_a_continuum() -> None:
    """The load is the residual traction: the block may stand anywhere from the end of the curve to the bound."""
    found = searched(condensed.problem([[0.0]], [1.0], condensed.bonds(LAWS["paper"], [0]), lower=-5.0, upper=5.0))
    assert "1 stands for a continuum" in found.reason
    assert [p.isolated for p in found.points] == [False]


def test_two_blocks_that_slide_together_are_a_continuum_beside_an_isolated_point() -> None:
    """By hand: x0 - x1 is 0.2 where both bear the residual 1 alone; at rest both bear 2 x."""
    stiffness = [[1.0, -1.0], [-1.0, 1.0]]
    found = searched(
        condensed.problem(stiffness, [1.2, 0.8], condensed.bonds(LAWS["paper"], [0, 1]), lower=-5.0, upper=5.0)
    )
    (resting,) = (p for p in found.points if p.isolated)
    (sliding,) = (p for p in found.points if not p.isolated)
    np.testing.assert_allclose(resting.x, [0.55, 0.45], rtol=1e-9)
    assert sliding.x[0] - sliding.x[1] == pytest.approx(0.2, rel=1e-9)


@pytest.mark.long
def test_what_is_balanced_to_rounding_alone_is_not_called_proven() -> None:
    """An exponential law comes to its residual only at infinity; far away the rest is below rounding."""
    stiffness = [[1.0, -1.0], [-1.0, 1.0]]
    found = searched(
        condensed.problem(stiffness, [0.7, 0.3], condensed.bonds(LAWS["exponential"], [0, 1]), lower=-5.0, upper=50.0)
    )
    assert not found.complete
    assert any(not p.isolated for p in found.points)


def test_a_bound_that_bears_is_no_straight_traction() -> None:
    """By hand: the first stands on its bound with a force of 0.3, the friction of the second holds at rest."""
    bonds = condensed.bonds(laws.Exponential(2.0, 0.5, 1.0), [1])
    found = searched(condensed.problem([[0.0, 0.0], [0.0, 3.0]], [-0.3, 0.4], bonds, lower=[-1.0, -np.inf]))
    assert (found.reason, found.complete) == ("all equilibria, proven: 1", True)
    np.testing.assert_allclose(found.points[0].x, [-1.0, 0.0], atol=1e-12)


def test_bonds_that_stick_at_the_end_of_a_cell_are_taken_for_sticking() -> None:
    """What is left about a jump at zero is never divided: it took 133 cells where 31 are enough."""
    law = {"law": "exponential", "peak_traction": 8e6, "residual_traction": 5e5, "delta": 3e-6}
    found = searched(condensed_scene(model(4, 6e6, 1e6, law)))
    assert len(found.points) == 5
    assert found.nodes <= 50
