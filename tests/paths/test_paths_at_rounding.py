"""Curved paths where rounding and sharp corners come near to the steps: bodies that lean far, plateaus, light loads."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import numpy.typing as npt
import pytest
from condensed import bonds, chain, graph, problem
from test_curved_paths import line, path, peak

from hvi_fenicsx.laws import Exponential
from hvi_fenicsx.laws.smoothing import create
from hvi_fenicsx.paths.branch import Outcome
from hvi_fenicsx.paths.equations import Bordered
from hvi_fenicsx.paths.events import Arc
from hvi_fenicsx.paths.jumps import _motions
from hvi_fenicsx.paths.motion import Relaxation
from hvi_fenicsx.paths.passages import Crossing
from hvi_fenicsx.paths.state import End, Event, Follow
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem

Array = npt.NDArray[np.float64]
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


def test_small_changes_of_forces_have_all_their_digits_where_displacements_are_large() -> None:
    """The end of the spring is 1.5e4 away: where the last bond moves by 1e-8, its force changes by k 1e-8."""
    curve = path(pulled(4, 1e-4), programme=(1.5,))[0]._branch
    assert np.max(np.abs(curve.here.y)) > 1e4
    y = curve.here.y.copy()
    y[3] += 1e-8
    moved = float(curve.points.values(y[:-1]).x[3] - curve.here.values.x[3])
    before, after = (curve.residual(at, curve.points.values(at[:-1])) for at in (curve.here.y, y))
    assert (after - before)[4] * curve.points.forces[4] == pytest.approx(-1e-4 * moved, rel=1e-6, abs=0.0)


class HardlyOnwards(Crossing):
    """One point goes on along its law by no more than rounding."""

    point = 0

    def _all_rates(self) -> Array:
        return np.where(np.arange(len(self._points)) == self.point, 1e-9, 0.0)


def test_a_bond_that_turned_back_stays_on_its_secant_where_its_rate_is_rounding() -> None:
    """Where the curve has taken it back, the sign of a rate of 1e-9 at the turn itself says nothing."""
    follower, _ = path(line(Exponential(1.0, 0.3, 0.5), 4), programme=(1.5,), remember=(0,))
    here, crossing = follower._branch.here, HardlyOnwards(follower._branch, lambda: None)
    point = crossing.point = next(k for k, outward in enumerate(follower._points.outward) if outward)
    turn = Arc(outcome=Outcome.TURNED, point=point, before=here, after=here)
    assert [p.point for p in crossing.run(turn)] == [point]


def test_an_event_that_is_near_does_not_shorten_the_steps_after_it() -> None:
    curve = path(line(Exponential(1.0, 0.3, 0.5), 4), programme=(1.5,))[0]._branch
    assert curve.points.bent
    before = curve.length
    y = curve.here.y + 1e-13 * curve.here.tangent
    curve._checked(Arc(outcome=Outcome.END, point=0, before=curve.here, after=curve._after(y)), 1e-13)
    assert curve.length == before


def test_a_body_that_slides_on_for_ever_comes_off_at_the_plateau() -> None:
    """A free body on bonds that soften to a fifth, pressed against a floor: all slides, and the factor tends to 1/5."""
    law = create("chks", graph([(0, 0), (1, 1), (4, 0.2)]), epsilon=1e-6)
    roots = np.random.default_rng(3).standard_normal((5, 6))
    roots[:, :3] -= roots[:, :3].mean(axis=1)[:, None]  # moving the first three alike strains nothing
    given = problem(
        50.0 * roots.T @ roots + 1e3 * np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        bonds(law, [0, 1, 2], 1.0 / 3.0),
        force=np.r_[np.zeros(3), np.full(3, -1e3)],
        lower=np.r_[np.full(3, -np.inf), np.zeros(3)],
    )
    follower, states = path(given, programme=(9.0,), follow=Follow.EXACT)
    assert follower.end is End.ESCAPES
    assert states[-1].factor == pytest.approx(0.2, rel=1e-6)
    assert len(states) < 100


def test_a_light_load_does_not_pass_for_rest() -> None:
    """A vertex on a spring of 1 that is moved by λ, with a law of 1e-5: past the drop it moves on to x = λ - 0.4e-5."""
    law = create("chks", graph([(0, 0), (1, 1e-5), (1, 0.4e-5)]), epsilon=1e-8)
    given = problem(1.0, 1.0, bonds(law, 0))
    states = path(given, programme=(2.0,), follow=Follow.EXACT)[1]
    fold = next(s for s in states if s.event is Event.FOLD)
    start = path(given, programme=(fold.factor - 1e-9,), follow=Follow.EXACT)[0]
    points, load = start._points, given.load(fold.factor * (1.0 + 1e-9))
    motion = Relaxation(given, points, start._branch.here.y[:-1], load, held=True, step=lambda: None)
    assert motion.run(np.ones(1))
    assert float(points.values(motion.z).x[0]) == pytest.approx(load[0] - 0.4e-5, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_equations_without_a_digit_left_are_singular(seed: int) -> None:
    """Rounding may leave factors of a singular matrix: along what they give the row does not grow by 1."""
    thin = np.random.default_rng(seed).standard_normal((9, 8))
    matrix = np.asfortranarray(thin @ thin.T)
    with suppress(np.linalg.LinAlgError):
        assert float(matrix[-1].copy() @ Bordered(matrix.copy(order="F")).along) == pytest.approx(1.0, abs=0.5)


def test_no_motion_is_tried_twice() -> None:
    """Past a fold the softest motion is that along the path; the other sense of it comes last."""
    follower, _ = path(line(Exponential(1.0, 0.3, 0.5), 4), programme=(9.0,), follow=Follow.EXACT)
    given, here = follower._problem, follower._branch.here
    softest = next(_motions(given, follower._points, here, here.tangent[:-1]))
    motions = list(_motions(given, follower._points, here, softest))
    assert len(motions) == 2
    np.testing.assert_array_equal(motions[1], -motions[0])
