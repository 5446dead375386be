"""Paths by predictor and corrector: against exact ones, closed forms, isotropy, finer steps, energies and resume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
import pytest
from condensed import bonds, chain, graph, problem
from curved_follower import CurvedFollower
from test_exact_paths import SOFTENING, bar, largest_imbalance, peeled, random_problem, spring

from hvi_fenicsx.effects import Direction
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.laws import Exponential, Superpotential
from hvi_fenicsx.laws.smoothing import create
from hvi_fenicsx.paths.distances import Distances
from hvi_fenicsx.paths.follower import Follower
from hvi_fenicsx.paths.full_load import at_full_load
from hvi_fenicsx.paths.state import End, Event, Follow, PathOptions, PathState
from hvi_fenicsx.paths.thresholds import FollowingThresholds
from hvi_fenicsx.paths.vertex_laws import is_straight
from hvi_fenicsx.reduced.condensed_problem import Bonds, CondensedProblem

Array = npt.NDArray[np.float64]
DROP = [(0, 0), (1, 1), (1, 0.4)]
FINER = patch("hvi_fenicsx.paths.contact_points.DEFAULT", FollowingThresholds(reach=0.025))
SMOOTHED = create("quadratic", graph(DROP), epsilon=1e-2)


def path(
    given: CondensedProblem, resume: PathState | None = None, **options: Any
) -> tuple[CurvedFollower, list[PathState]]:
    follower = CurvedFollower(given, PathOptions(**options), resume)
    return follower, list(follower.states())


def lengths(law: Superpotential, count: int, weights: Any = 1.0) -> Bonds:
    """A law on the length of each pair of unknowns."""
    return Bonds(
        law=law,
        unknowns=np.arange(2 * count).reshape(-1, 2),
        signs=np.ones((count, 2)),
        weights=np.broadcast_to(np.asarray(weights, dtype=float), (count,)).copy(),
        part="glue",
        direction=Direction.SLIP,
        points=np.zeros((count, 3)),
    )


def plate(law: Superpotential, n: int, angle: float, *others: Bonds) -> CondensedProblem:
    """A chain of points whose springs are the same in all directions of the plane, pulled in one."""
    pull = np.kron(np.eye(1, n, n - 1)[0], [np.cos(angle), np.sin(angle)])
    weights = np.r_[0.5, np.ones(n - 2), 0.5]
    return problem(np.kron(chain(n, 2.0), np.eye(2)), pull, lengths(law, n, weights), *others)


def line(law: Superpotential, n: int) -> CondensedProblem:
    """The same chain with one component."""
    return problem(chain(n, 2.0), np.eye(1, n, n - 1)[0], bonds(law, np.arange(n), np.r_[0.5, np.ones(n - 2), 0.5]))


def oblique(law: Superpotential) -> CondensedProblem:
    """Three points with springs that differ by direction, so that slips turn on the way."""
    generator = np.random.default_rng(3)
    root = generator.standard_normal((6, 6))
    return problem(0.3 * root @ root.T + 0.05 * np.eye(6), generator.standard_normal(6), lengths(law, 3))


def largest_distance(given: CondensedProblem, states: Sequence[PathState], remember: Sequence[int] = ()) -> float:
    distance = Distances(given, remember)
    return max(distance(state) for state in states)


def peak(states: Sequence[PathState]) -> float:
    return max(state.factor for state in states)


def test_paths_are_straight_where_all_laws_are_piecewise_linear() -> None:
    assert is_straight(spring())
    assert not is_straight(plate(graph(DROP), 3, 0.0))
    assert is_straight(line(SMOOTHED, 3))
    assert not is_straight(line(create("chks", graph(DROP), epsilon=1e-2), 3))
    assert not is_straight(line(Exponential(1.0, 0.2, 0.5), 3))


@pytest.mark.parametrize("follow", Follow)
def test_piecewise_linear_paths_are_the_exact_ones(follow: Follow) -> None:
    for given, aim in ((spring(), 3.0), (bar(50.0, 12), 400.0), (random_problem(2), 5.0)):
        exact = Follower(given, PathOptions(programme=(aim,), follow=follow))
        wanted = list(exact.states())
        follower, states = path(given, programme=(aim,), follow=follow)
        assert follower.end is exact.end
        assert peak(states) == pytest.approx(peak(wanted), rel=1e-12)
        assert states[-1].work == pytest.approx(wanted[-1].work, rel=1e-9)


@pytest.mark.parametrize("remember", [(0, 1), (0,)])
def test_two_laws_at_one_point_lose_what_the_exact_path_says(remember: tuple[int, ...]) -> None:
    given = problem(chain(4, 2.0), np.eye(1, 4, 3)[0], bonds(graph(DROP), range(4)), bonds(graph(SOFTENING), range(4)))
    options = PathOptions(programme=(4.0, 0.5, 5.0), remember=remember)
    wanted, states = list(Follower(given, options).states()), list(CurvedFollower(given, options).states())
    assert wanted[-1].dissipated > 0.1
    assert states[-1].dissipated == pytest.approx(wanted[-1].dissipated, rel=1e-9)
    assert states[-1].energy == pytest.approx(wanted[-1].energy, rel=1e-9)


def floating(law: Superpotential, gaps: Any, seed: int, row: int = 3) -> CondensedProblem:
    """A row of points with gaps below them, and slips that nothing but their law holds."""
    generator = np.random.default_rng(seed)
    coupling = 0.06 * generator.standard_normal((row, row))
    coupling -= coupling.mean(axis=0)
    coupling -= coupling.mean(axis=1, keepdims=True)
    stiffness = np.block([[chain(row, 1.0), coupling], [coupling.T, chain(row, 2.0)]])
    press = generator.standard_normal(row)
    press -= press.mean() + 0.5
    lower = np.r_[-np.broadcast_to(np.asarray(gaps, dtype=float), row), np.full(row, -np.inf)]
    load = np.r_[press, generator.standard_normal(row)]
    return problem(stiffness, load, bonds(law, np.arange(row, 2 * row)), lower=lower)


@pytest.mark.parametrize("seed", range(4))
def test_a_body_that_nothing_touches_falls_where_the_exact_path_has_it(seed: int) -> None:
    given = floating(graph([(0, 0), (1, 1), (1.5, 0.2)]), np.random.default_rng(seed).uniform(0.1, 2.0, 3), seed)
    exact = Follower(given, PathOptions(programme=(3.0,)))
    wanted = list(exact.states())
    follower, states = path(given, programme=(3.0,))
    assert follower.end is exact.end
    np.testing.assert_allclose(states[0].x, wanted[0].x, atol=1e-9)
    assert peak(states) == pytest.approx(peak(wanted), rel=1e-9)


@pytest.mark.parametrize("remember", [(), (0,)])
def test_a_curved_law_presses_on_its_bound_with_its_own_traction(remember: tuple[int, ...]) -> None:
    """By hand: a spring of stiffness 3, pulled by 3 λ, touches a bound at 0.4 and leaves it at λ = 0.4 + t(0.4)/3."""
    law = Exponential(1.0, 0.1, 0.5)
    given = problem(3.0, -3.0, bonds(law, 0), lower=-0.4)
    follower, states = path(given, programme=(1.0, 0.1), remember=remember)
    traction = float(law.right(np.array([0.4]))[0])
    touched = 0.4 + traction / 3.0
    factors = {event: next(s.factor for s in states if s.event is event) for event in (Event.CONTACT, Event.RELEASE)}
    assert follower.end is End.REACHED
    assert list(factors.values()) == pytest.approx([touched, touched], rel=1e-9)
    slope = traction / 0.4
    assert states[-1].x[0] == pytest.approx(-0.3 / (3.0 + slope) if remember else 0.0, abs=1e-9)


@pytest.mark.parametrize("kind", [Follower, CurvedFollower])
@pytest.mark.parametrize("gaps", [(np.inf, np.inf), (0.2, 0.3), (0.3, 0.2), (0.1, np.inf)])
def test_a_body_that_rocks_is_in_balance_at_any_inclination(kind: type[Follower], gaps: tuple[float, float]) -> None:
    """By hand: a beam of three points on its middle one, bent by loads of its ends, until both these are on the floor.

    With ends that sink by λ together, E = λ²/2 - λ(2 + λ), whatever the inclination, until 1 + λ = 1 + g1 + g2; from
    there on the floor takes what more the ends get. Back again, the ends leave it at the same factor.
    """
    bent = np.array([1.0, -2.0, 1.0])
    lower = [-0.5 - gaps[0], -0.5, -0.5 - gaps[1]]
    given = problem(np.outer(bent, bent), [-1.0, -2.0, -1.0], lower=lower)
    follower = kind(given, PathOptions(programme=(1.0, 0.1)))
    states = list(follower.states())
    assert follower.end is End.REACHED
    assert min(state.unstable for state in states) == max(state.unstable for state in states) == 0
    for state in states:
        sunk = min(state.factor, sum(gaps))
        np.testing.assert_allclose(state.x[1], -0.5, atol=1e-9)
        assert state.x[0] + state.x[2] == pytest.approx(-1.0 - sunk, abs=1e-9)
        assert np.all(state.x >= given.lower - 1e-9)
        assert state.energy == pytest.approx(0.5 * sunk**2 - state.factor * (2.0 + sunk), abs=1e-9)
    assert max(state.factor for state in states) == 1.0


def test_bonds_pull_a_body_off_its_floor_once_they_alone_carry_the_load() -> None:
    """By hand: three bonds at a plateau of 0.03 carry 2 λ = 0.09; with less load the beam leaves the floor and jumps.

    It does not jump back to the floor, where at that load it could stand anywhere above.
    """
    bent, law = np.array([1.0, -2.0, 1.0]), graph([(0, 0), (0.05, 0.1), (0.2, 0.03)])
    floor = [-0.5, -np.inf, -0.5]
    given = problem(np.outer(bent, bent), [-0.6, -0.8, -0.6], bonds(law, [0, 1, 2]), lower=floor)
    follower, states = path(given, programme=(1.0, 0.0))
    assert follower.end is End.REACHED
    turn = next(n for n, state in enumerate(states) if state.event is Event.TURN)
    found = [(state.event, state.factor) for state in states[turn + 1 :]]
    assert [event for event, _ in found] == [Event.RELEASE, Event.FOLD, Event.JUMP, Event.END]
    assert [factor for _, factor in found] == pytest.approx([0.045, 0.045, 0.045, 0.0], abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1, 36])
def test_a_body_that_is_stiffer_than_its_laws_fall_never_jumps_nor_turns(seed: int) -> None:
    """The energy is strictly convex; slips turn on the way, and a bond that turned back slips on within a step."""
    law, generator = Exponential(1.0, 0.3, 0.8), np.random.default_rng(seed)
    root = generator.standard_normal((6, 6))
    given = problem(0.3 * root @ root.T + np.eye(6), generator.standard_normal(6), lengths(law, 3))
    follower, states = path(given, programme=(4.0,), remember=(0,))
    assert follower.end is End.REACHED
    assert all(state.stable and state.event not in (Event.JUMP, Event.FOLD) for state in states)


def test_a_closed_curve_is_gone_round_once() -> None:
    """The exact path knows it by its cells; the wanted factor is not on it, so loading does not lead there."""
    given = random_problem(165)
    exact = Follower(given, PathOptions(programme=(5.0,), follow=Follow.EXACT))
    wanted = list(exact.states())
    follower, states = path(given, programme=(5.0,), follow=Follow.EXACT, most_events=1000)
    assert follower.is_closed
    assert follower.reason == exact.reason
    np.testing.assert_allclose([s.factor for s in states], [s.factor for s in wanted], atol=1e-9)

    smoothed = tuple(replace(b, law=create("chks", b.law, epsilon=1e-4)) for b in given.bonds)
    found = at_full_load(
        replace(given, force_rate=5.0 * given.force_rate, bonds=smoothed), PathOptions(most_events=1000)
    )
    assert found is not None
    assert found.x is None
    assert "form a closed curve" in found.reason
    turn = float(found.reason.split()[3])
    assert turn == pytest.approx(peak(wanted) / 5.0, rel=1e-2)


def mirrored(given: CondensedProblem) -> CondensedProblem:
    """The same problem with all displacements of the other sign."""
    return replace(
        given,
        force=-given.force,
        force_rate=-given.force_rate,
        lower=-given.upper,
        upper=-given.lower,
        bonds=tuple(replace(b, signs=-b.signs) for b in given.bonds),
    )


@pytest.mark.parametrize(
    ("follow", "turned"),
    [(Follow.STABLE, False), *(pytest.param(f, True, marks=pytest.mark.long) for f in Follow)],
)
def test_a_strip_that_is_peeled_off_is_the_exact_path(follow: Follow, turned: bool) -> None:
    """Ahead of the crack vertices move by less and less: they still pass their ends where they come to these."""
    given = mirrored(peeled()) if turned else peeled()
    wanted = list(Follower(given, PathOptions(follow=follow)).states())
    follower, states = path(given, follow=follow)
    assert follower.end is End.REACHED, follower.reason
    assert folds(states) == pytest.approx(folds(wanted), rel=1e-9)
    assert states[-1].x == pytest.approx(wanted[-1].x, abs=1e-9 * float(np.max(np.abs(wanted[-1].x))))
    assert largest_distance(given, states) < 1e-8


@pytest.mark.long
@pytest.mark.parametrize("seed", range(40))
def test_peaks_of_random_paths_are_the_exact_ones(seed: int) -> None:
    """To the first jump: which of several stable states a body jumps to is not the same for both."""
    given = random_problem(seed)
    exact = Follower(given, PathOptions(programme=(5.0,), follow=Follow.EXACT))
    wanted = list(exact.states())
    if not wanted:
        pytest.skip("nothing holds the body under its constant loads")
    follower, states = path(given, programme=(5.0,), follow=Follow.EXACT)
    assert follower.end is exact.end, follower.reason
    assert peak(states) == pytest.approx(peak(wanted), rel=1e-9)
    assert states[-1].x == pytest.approx(wanted[-1].x, abs=1e-8)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_block_on_friction_bears_the_same_in_each_direction(angle: float) -> None:
    """Symmetric in the plane: along an axis and oblique it is the chain of one component, which is exact."""
    law = graph(DROP)
    wanted = list(Follower(line(law, 5), PathOptions(programme=(9.0,))).states())
    follower, states = path(plate(law, 5, angle), programme=(9.0,))
    assert follower.end is End.ESCAPES
    assert peak(states) == pytest.approx(peak(wanted), rel=1e-9)
    given = plate(law, 5, angle)
    assert largest_distance(given, states) < 1e-9


def test_a_curved_law_softens_as_its_closed_form_says() -> None:
    """One vertex on a spring k, moved by λ: k (λ - x) = exp(-x/δ); it snaps where that slope is k: x = -δ log(kδ)."""
    given = problem(0.5, 0.5, bonds(Exponential(1.0, 0.0, 1.0), 0))
    follower, states = path(given, programme=(3.0, 0.1), follow=Follow.EXACT)
    at = -np.log(0.5)
    assert follower.end is End.REACHED
    fold = next(s for s in states if s.event is Event.FOLD and s.factor < 1.9)
    assert float(fold.x[0]) == pytest.approx(at, rel=1e-5)
    assert fold.factor == pytest.approx(at + 2.0 * np.exp(-at), rel=1e-10)
    assert largest_imbalance(given, states) < 1e-8


@pytest.mark.parametrize("follow", Follow)
def test_a_curved_path_has_a_state_at_each_wanted_factor_that_it_comes_to(follow: Follow) -> None:
    """A bond on a spring, up, round two limit points where it is followed exactly, and back: λ = x + t(x)."""
    law, wanted = Exponential(2.0, 0.1, 0.5), (0.9, 1.6, 7.0)
    given = problem(1.0, 1.0, bonds(law, 0))
    plain = path(given, programme=(3.0, 0.5), follow=follow)[1]
    times = {
        f: sum((a.factor - f) * (b.factor - f) < 0.0 for a, b in pairwise(plain) if b.event is not Event.JUMP)
        for f in wanted
    }
    states = path(given, programme=(3.0, 0.5), follow=follow, stops=wanted)[1]
    assert {f: sum(s.factor == f for s in states) for f in wanted} == times
    assert max(times.values()) > 1
    assert times[7.0] == 0
    for state in (s for s in states if s.factor in wanted):
        least, most = law.interval(state.x, 1e-12)
        assert least[0] - 1e-9 <= state.factor - state.x[0] <= most[0] + 1e-9


def test_smoothed_laws_tend_to_the_law() -> None:
    """The quadratic smoothing of a drop of height c rounds its corner off within ε/c: the peak falls with ε."""
    options = PathOptions(programme=(9.0,), follow=Follow.EXACT)
    wanted = first_fold(Follower(line(graph(DROP), 4), options))
    smoothed = [line(create("quadratic", graph(DROP), epsilon=epsilon), 4) for epsilon in (1e-1, 1e-2, 1e-3)]
    off = [abs(first_fold(CurvedFollower(given, options)) - wanted) / wanted for given in smoothed]
    assert off[1] < 0.2 * off[0]
    assert off[2] < 0.2 * off[1]
    assert off[2] < 1e-3


@pytest.mark.parametrize("epsilon", [1e-1, 1e-6])
def test_the_quadratic_smoothing_of_a_polyline_is_one_and_its_path_exact(epsilon: float) -> None:
    """A bond on one spring k: λ = x + t(x)/k. The drop from 1 to 0.4 at 1 is a ramp of the width ε_absolute/0.6."""
    k, half = 0.5, 0.5 * (0.5 * epsilon) / 0.6
    given = problem(k, k, bonds(create("quadratic", graph(DROP), epsilon=epsilon), 0))
    states = list(Follower(given, PathOptions(programme=(9.0,), follow=Follow.EXACT)).states())
    folds = [s for s in states if s.event is Event.FOLD]
    assert [float(s.x[0]) for s in folds] == pytest.approx([1.0 - half, 1.0 + half], rel=1e-12)
    rounding = 1e-12 + 1e-16 / epsilon  # of a displacement, times the slope of the ramp
    assert [s.factor for s in folds] == pytest.approx([3.0 * (1.0 - half), 1.0 + half + 0.4 / k], rel=rounding)
    assert largest_imbalance(given, states) < 1e-9


def first_fold(follower: Follower) -> float:
    return next(s.factor for s in follower.states() if s.event is Event.FOLD)


@pytest.mark.parametrize(
    "law",
    [
        graph(SOFTENING),
        graph(DROP),
        pytest.param(SMOOTHED, marks=pytest.mark.long),
        pytest.param(Exponential(1.0, 0.1, 0.4), marks=pytest.mark.long),
    ],
)
def test_loading_and_unloading_in_the_plane_with_memory(law: Superpotential) -> None:
    """Slips turn; energies balance, nothing is dissipated twice, unloading is along the secant: |F| < the law's."""
    given = oblique(law)
    follower, states = path(given, programme=(0.6, 0.0, 0.6, 1.2), remember=(0,))
    assert follower.end is not End.LOST, follower.reason
    assert largest_imbalance(given, states) < 1e-8
    assert largest_distance(given, states, (0,)) < 1e-8
    lost = np.array([s.dissipated for s in states])
    assert np.all(np.diff(lost) >= -1e-12 * (1.0 + lost[-1]))
    turns = [s for s in states if s.event is Event.TURN]
    if len(turns) == 3:
        assert turns[1].dissipated == pytest.approx(turns[0].dissipated, rel=1e-9)
        assert turns[2].x == pytest.approx(turns[0].x, abs=1e-8)


@pytest.mark.long
@pytest.mark.parametrize(
    "law", [graph(SOFTENING), graph(DROP), graph([(0, 0.3), (0.5, 0.1)]), SMOOTHED, Exponential(1.0, 0.1, 0.4)]
)
def test_a_tenth_of_the_step_is_the_same_branch(law: Superpotential) -> None:
    given = oblique(law)
    _, states = path(given, programme=(1.5,), follow=Follow.EXACT)
    with FINER:
        _, finer = path(given, programme=(1.5,), follow=Follow.EXACT)
    assert len(finer) >= len(states)
    assert events(finer) == events(states)
    for one, other in zip(folds(states), folds(finer), strict=True):
        assert one == pytest.approx(other, rel=1e-8)
    assert states[-1].x == pytest.approx(finer[-1].x, abs=1e-8)


def events(states: Sequence[PathState]) -> list[Event]:
    return [s.event for s in states if s.event is not Event.STEP]


def folds(states: Sequence[PathState]) -> list[float]:
    return [s.factor for s in states if s.event is Event.FOLD]


def test_a_path_goes_on_from_any_of_its_states() -> None:
    given = oblique(graph(SOFTENING))
    options: dict[str, Any] = {"programme": (0.6, 0.2, 0.8), "remember": (0,)}
    _, whole = path(given, **options)
    for at in range(0, len(whole) - 1, 7):
        _, rest = path(given, whole[at], **options)
        assert [s.event for s in rest] == [s.event for s in whole[at + 1 :]]
        assert [s.factor for s in rest] == pytest.approx([s.factor for s in whole[at + 1 :]], rel=1e-9)
        assert rest[-1].work == pytest.approx(whole[-1].work, rel=1e-9)


def test_an_edge_where_a_law_on_a_length_meets_another_is_refused() -> None:
    given = plate(graph(DROP), 3, 0.0, bonds(graph(DROP), 1))
    with pytest.raises(InputError, match=r"\|u_t\|"):
        CurvedFollower(given, PathOptions())
