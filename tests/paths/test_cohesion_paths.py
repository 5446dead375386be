"""Paths with a law of opening and slip: against exact ones in one mode, closed forms, energies, finer steps, resume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from condensed import bonds, chain, graph, problem
from test_curved_paths import FINER, events, folds, largest_distance, path, peak
from test_exact_paths import largest_imbalance

from hvi_fenicsx.effects import Direction
from hvi_fenicsx.laws import BenzeggaghKenane, Exponential, Mixity, PowerLaw, Superpotential
from hvi_fenicsx.paths.follower import Follower
from hvi_fenicsx.paths.state import End, Event, Follow, PathOptions, PathState
from hvi_fenicsx.reduced.condensed_problem import Bonds, CondensedProblem

Array = npt.NDArray[np.float64]
SOFTENING = [[0, 0], [1, 1], [5, 0]]
RIGID = [[0, 1], [5, 0]]
BETA = 0.6


def cohesion(law: Superpotential, n: int, width: int = 2) -> Bonds:
    """A law at n vertices; the first unknown of each is u·n, the others slips."""
    return Bonds(
        law=law,
        unknowns=np.arange(width * n).reshape(-1, width),
        signs=np.tile([-1.0] + [BETA] * (width - 1), (n, 1)),
        weights=np.linspace(0.8, 1.2, n),
        part="glue",
        direction=Direction.SEPARATION,
        points=np.zeros((n, 3)),
        opens=True,
    )


def strip(law: Superpotential, pull: Sequence[float], *, closes: bool = False, n: int = 4) -> CondensedProblem:
    """Points in a row, the same springs in all directions, pulled at the last one."""
    width = len(pull)
    stiffness = np.kron(chain(n, 2.0), np.eye(width)) + 0.02 * np.eye(width * n)
    upper = np.full(width * n, np.inf)
    if closes:
        upper[::width] = 0.0
    given = cohesion(law, n, width)
    return problem(stiffness, np.kron(np.eye(1, n, n - 1)[0], pull), given, upper=upper)


def one_mode(law: Superpotential, sign: float, pull: float, n: int = 4) -> CondensedProblem:
    """The same with one component."""
    own = bonds(law, np.arange(n), np.linspace(0.8, 1.2, n), sign)
    return problem(chain(n, 2.0) + 0.02 * np.eye(n), np.eye(1, n, n - 1)[0] * pull, own)


@pytest.mark.parametrize(
    ("points", "follow"),
    [
        (SOFTENING, Follow.STABLE),
        pytest.param(SOFTENING, Follow.EXACT, marks=pytest.mark.long),
        pytest.param(RIGID, Follow.STABLE, marks=pytest.mark.long),
        pytest.param(RIGID, Follow.EXACT, marks=pytest.mark.long),
    ],
)
def test_one_mode_alone_is_the_exact_path_of_that_mode(points: Any, follow: Follow) -> None:
    opening = graph(points, one_sided=True), -1.0
    slip = graph([[x / BETA, traction * BETA] for x, traction in points]), 1.0
    for (law, sign), pull, component in ((opening, [-1.0, 0.0], 0), (slip, [0.0, 1.0], 1)):
        options: dict[str, Any] = {"programme": (2.0, 0.4, 4.0), "follow": follow, "remember": (0,)}
        wanted = list(Follower(one_mode(law, sign, pull[component]), PathOptions(**options)).states())
        for closes in (False, True):
            given = strip(graph(points), pull, closes=closes)
            follower, states = path(given, **options)
            assert follower.end is End.REACHED, follower.reason
            assert peak(states) == pytest.approx(peak(wanted), rel=1e-10)
            assert states[-1].x[component::2] == pytest.approx(wanted[-1].x, rel=1e-9, abs=1e-10)
            assert states[-1].dissipated == pytest.approx(wanted[-1].dissipated, rel=1e-9)


@pytest.mark.parametrize(
    ("angle", "closes", "width"),
    [
        (30.0, True, 2),
        (-20.0, False, 3),
        *(
            pytest.param(angle, closes, width, marks=pytest.mark.long)
            for angle in (-20.0, 30.0)
            for closes in (False, True)
            for width in (2, 3)
        ),
    ],
)
def test_energies_balance_on_mixed_paths_with_memory(angle: float, closes: bool, width: int) -> None:
    """Pulled off askew or pressed on: opening and slip turn on the way; nothing is dissipated twice."""
    pull = [-np.sin(np.radians(angle)), np.cos(np.radians(angle)), 0.3][:width]
    given = strip(graph(SOFTENING), pull, closes=closes, n=3)
    given.stiffness[0, -1] = given.stiffness[-1, 0] = 0.01  # the modes feel each other
    follower, states = path(given, programme=(1.2, 0.1, 1.2, 2.5), remember=(0,))
    assert follower.end is End.REACHED, follower.reason
    assert largest_imbalance(given, states) < 1e-8
    assert largest_distance(given, states, (0,)) < 1e-8
    lost = np.array([s.dissipated for s in states])
    assert lost[-1] > 0.1
    assert np.all(np.diff(lost) >= -1e-12 * (1.0 + lost[-1]))
    turns = [s for s in states if s.event is Event.TURN]
    assert turns[1].dissipated == pytest.approx(turns[0].dissipated, rel=1e-9)
    assert turns[2].x == pytest.approx(turns[0].x, abs=1e-8)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("points", "angle"),
    [
        pytest.param(SOFTENING, 20.0, marks=pytest.mark.long),
        (SOFTENING, 70.0),
        pytest.param(RIGID, 20.0, marks=pytest.mark.long),
        (RIGID, 70.0),
    ],
)
def test_points_without_springs_bear_the_ellipse(points: Any, angle: float) -> None:
    """All points are pulled alike: 1/sqrt(t_n² + (t_s/beta)²), then they come off together."""
    across, along = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    given = cohesion(graph(points), 3)
    free = problem(np.kron(chain(3, 2.0), np.eye(2)), np.kron(given.weights, [-across, along]), given)
    follower, states = path(free, programme=(5.0,))
    assert follower.end is End.ESCAPES, follower.reason
    assert peak(states) == pytest.approx(1.0 / np.hypot(across, along / BETA), rel=1e-9)


def energy_slopes(given: CondensedProblem, state: PathState) -> Array:
    """The derivative of the energy by differences: zero at an equilibrium off all kinks."""
    step = 1e-6
    ways = np.eye(given.size) * step
    ends = [[given.energy(state.x + s * way, state.factor) for way in ways] for s in (1.0, -1.0)]
    return np.asarray((np.array(ends[0]) - np.array(ends[1])) / (2 * step))


@pytest.mark.long
def test_states_are_stationary_points_of_the_energy() -> None:
    given = strip(graph(SOFTENING), [-0.5, 1.0])
    _, states = path(given, programme=(3.0,), follow=Follow.EXACT)
    between = [s for s in states if s.event is Event.STEP]
    assert len(between) > 3
    assert max(float(np.abs(energy_slopes(given, s)).max()) for s in between) < 1e-7


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "mixity", "closes"),
    [
        (graph(SOFTENING), None, False),
        (graph(SOFTENING), None, True),
        (graph([[0, 0], [0.05, 1], [5, 0]]), BenzeggaghKenane(3.0, 2.1), False),
        (Exponential(1.0, 0.0, 0.5), None, False),
    ],
)
def test_a_tenth_of_the_step_is_the_same_branch(law: Superpotential, mixity: Mixity | None, closes: bool) -> None:
    given = strip(law, [0.2, 1.0] if closes else [-0.4, 1.0], closes=closes)
    given = replace(given, bonds=(replace(given.bonds[0], mixity=mixity),))
    options: dict[str, Any] = {"programme": (3.0,), "follow": Follow.EXACT, "remember": (0,)}
    _, states = path(given, **options)
    with FINER:
        _, finer = path(given, **options)
    assert events(finer) == events(states)
    assert folds(finer) == pytest.approx(folds(states), rel=1e-8)
    assert states[-1].x == pytest.approx(finer[-1].x, abs=1e-8)
    assert states[-1].dissipated == pytest.approx(finer[-1].dissipated, rel=1e-8)
    for found in (states, finer):
        assert np.all(np.diff([s.dissipated for s in found]) >= -1e-12 * found[-1].dissipated)


@pytest.mark.parametrize("criterion", [BenzeggaghKenane(3.0, 2.1), PowerLaw(3.0, 1.5)])
@pytest.mark.parametrize("angle", [0.0, 50.0, 90.0])
def test_all_of_the_energy_at_a_mixity_is_dissipated(criterion: Mixity, angle: float) -> None:
    """One vertex on equal springs in both modes is torn off along a ray: the share of the slip stays."""
    across, along = np.cos(np.radians(angle)), np.sin(np.radians(angle)) / BETA
    share = (BETA * along) ** 2
    given = replace(cohesion(graph(SOFTENING), 1), weights=np.ones(1), mixity=criterion)
    springs = np.array([50.0, 50.0 * BETA**2])
    torn = problem(np.diag(springs), 6.0 * springs * [-across, along], given)
    follower, states = path(torn, programme=(1.0, 0.0), remember=(0,))
    assert follower.end is End.REACHED, follower.reason
    assert states[-1].dissipated == pytest.approx(2.5 * float(criterion.energy(np.array([share]))[0]), rel=1e-8)
    assert largest_imbalance(torn, states) < 1e-8


@pytest.mark.parametrize("criterion", [BenzeggaghKenane(3.0, 2.1), PowerLaw(0.5, 1.5)])
@pytest.mark.parametrize("closes", [pytest.param(False, marks=pytest.mark.long), True])
def test_with_energies_that_differ_every_state_is_an_equilibrium_of_its_own_mixity(
    criterion: Mixity, closes: bool
) -> None:
    given = strip(graph([[0, 0], [0.05, 1], [5, 0]]), [-0.4, 1.0], closes=closes)
    given = replace(given, bonds=(replace(given.bonds[0], mixity=criterion),))
    follower, states = path(given, programme=(4.0,), follow=Follow.EXACT, remember=(0,))
    assert follower.end is End.REACHED, follower.reason
    assert largest_distance(given, states, (0,)) < 1e-8
    assert largest_imbalance(given, states) < 1e-8
    assert np.all(np.diff([s.dissipated for s in states]) > -1e-6 * states[-1].dissipated)


@pytest.mark.parametrize("angle", [0.0, 50.0])
def test_a_jump_releases_what_a_bond_by_mode_does_not_dissipate(angle: float) -> None:
    """As above on soft springs: torn off at once at the peak; by hand, the energy falls by e²/(2k) + e/2."""
    across, along = np.cos(np.radians(angle)), np.sin(np.radians(angle)) / BETA
    criterion, k = BenzeggaghKenane(3.0, 2.1), 0.1
    e = float(criterion.energy(np.array([(BETA * along) ** 2]))[0])
    given = replace(cohesion(graph(SOFTENING), 1), weights=np.ones(1), mixity=criterion)
    springs = np.array([k, k * BETA**2])
    torn = problem(np.diag(springs), 60.0 * springs * [-across, along], given)
    follower, states = path(torn, programme=(1.0,), remember=(0,))
    assert follower.end is End.REACHED, follower.reason
    (jumped,) = [s for s in states if s.event is Event.JUMP]
    assert jumped.dissipated == pytest.approx(2.5 * e, rel=1e-8)
    assert jumped.released == pytest.approx(e**2 / (2.0 * k) + 0.5 * e - 2.5 * e, rel=1e-7)
    assert largest_imbalance(torn, states) < 1e-8
