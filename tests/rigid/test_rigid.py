"""Solvability decides whether a run starts at all, so it is held to closed forms of statics.

Run as a script under mpirun this file prints the verdicts of `scenes()` with the vertices dealt to the ranks.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from runs import LONG_RANKS, on_ranks
from scipy.optimize import linprog

from hvi_fenicsx.rigid import (
    Directional,
    JoinedBodies,
    Resistance,
    RigidBody,
    RigidProblem,
    Solvability,
    analyse,
    combine,
    gives_way,
    kernel,
    load_factors,
    modes,
    rigid_fields,
    works,
)

Array = NDArray[np.float64]
ALONE = MPI.COMM_SELF
FREE = Directional(0.0, 0.0)
SQUARE = RigidBody(2, np.array([0.5, 0.5, 0.0]))


def even(strength: float) -> Directional:
    return Directional(strength, strength)


def only(body: RigidBody) -> JoinedBodies:
    """A body that meets no other."""
    return JoinedBodies((body,))


def force(body: RigidBody, point: tuple[float, ...], vector: tuple[float, ...]) -> Array:
    """Work of a single force on the basis motions."""
    return np.asarray(rigid_fields(np.array([point]), body)[0] @ np.array(vector))


def edge(start: tuple[float, float], end: tuple[float, float], cells: int) -> tuple[Array, Array]:
    """Vertices (m, 3) and trapezoidal weights of a straight part."""
    s = np.linspace(0.0, 1.0, cells + 1)[:, None]
    points = np.hstack([(1.0 - s) * np.array(start) + s * np.array(end), np.zeros_like(s)])
    weights = np.full(cells + 1, np.hypot(end[0] - start[0], end[1] - start[1]) / cells)
    weights[[0, -1]] *= 0.5
    return points, weights


def floor_2d(
    body: RigidBody,
    cells: int,
    growth: Directional,
    peak: Directional,
    length: float = 1.0,
    angle: float = 0.0,
    c4: float = 0.0,
) -> tuple[Array, Resistance]:
    """A straight floor from the origin, with a tangential law; `angle` turns it counterclockwise."""
    t = np.array([np.cos(angle), np.sin(angle)])
    points, weights = edge((0.0, 0.0), (length * t[0], length * t[1]), cells)
    normals = np.tile([t[1], -t[0]], (cells + 1, 1))
    tangents = np.tile(t, (cells + 1, 1, 1))
    fields = rigid_fields(points, body)
    return works(normals, fields), Resistance(
        fields=fields, weights=weights, directions=tangents, growth=growth, peak=peak, c4=c4
    )


def floor_3d(
    body: RigidBody, cells: int, growth: float, peak: float, a: float = 1.0, b: float = 1.0
) -> tuple[Array, Resistance]:
    """The floor [0, a] × [0, b] at z = 0 with a law of the length of the slip."""
    x, wx = edge((0.0, 0.0), (a, 0.0), cells)
    y, wy = edge((0.0, 0.0), (0.0, b), cells)
    points = np.array([p + q for p in x for q in y])
    fields = rigid_fields(points, body)
    normals = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    tangents = np.tile([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], (len(points), 1, 1))
    return works(normals, fields), Resistance(
        fields=fields, weights=np.outer(wx, wy).ravel(), directions=tangents, growth=even(growth), peak=even(peak)
    )


def block(
    push: float, growth: float = 0.5, peak: float = 1.0, weight: float = 1.0, height: float = 0.0
) -> RigidProblem:
    """A 1 × 1 block, pushed to the right at the given height."""
    body = SQUARE
    contact, friction = floor_2d(body, 16, even(growth), even(peak))
    loads = {
        "push": force(body, (0.0, height, 0.0), (push, 0.0)),
        "weight": force(body, (0.5, 0.5, 0.0), (0.0, -weight)),
    }
    return RigidProblem(body=only(body), loads=loads, contact=(contact,), resistances=(friction,))


def slab(
    push: tuple[float, float], torque: float = 0.0, weight: float = 50.0, growth: float = 0.3, cells: int = 8
) -> RigidProblem:
    """A heavy 2 × 1 × 1 block in space, pushed and turned at the level of the floor."""
    body = RigidBody(3, np.array([1.0, 0.5, 0.5]))
    contact, friction = floor_3d(body, cells, growth, 2.0 * growth, 2.0, 1.0)
    loads = {
        "push": force(body, (1.0, 0.5, 0.0), (*push, 0.0)) + torque * np.eye(6)[5],
        "weight": force(body, (1.0, 0.5, 0.5), (0.0, 0.0, -weight)),
    }
    return RigidProblem(body=only(body), loads=loads, contact=(contact,), resistances=(friction,))


def wall(q: float, resistances: tuple[Resistance, ...] = (), lift: float = 0.0) -> RigidProblem:
    """The paper's model problem: u1 = 0 on the left side, floor below, load 1 to the right and q down."""
    body = SQUARE
    side, _ = edge((0.0, 0.0), (0.0, 1.0), 4)
    contact, _ = floor_2d(body, 4, FREE, FREE)
    loads = {
        "pull": force(body, (1.0, 0.5, 0.0), (1.0, 0.0)),
        "press": force(body, (0.5, 1.0, 0.0), (0.0, -q)),
        "lift": force(body, (0.5, 1.0, 0.0), (0.0, lift)),
    }
    return RigidProblem(
        body=only(body),
        loads=loads,
        fixed=(works(np.tile([1.0, 0.0], (5, 1)), rigid_fields(side, body)),),
        contact=(contact,),
        resistances=resistances,
    )


def words(verdict: Solvability) -> list[str]:
    return [mode.name for mode in verdict.kernel]


def test_the_block_slides_at_growth_and_at_peak_times_its_length() -> None:
    verdict = analyse(ALONE, block(0.8))
    assert verdict.lambda_held == pytest.approx(0.5 / 0.8, abs=1e-9)
    assert verdict.lambda_peak == pytest.approx(1.0 / 0.8, abs=1e-9)
    assert words(verdict) == ["translation along x", "translation along y", "rotation about (0.5, 0.5)"]
    assert verdict.critical is not None
    assert verdict.critical.name == "translation along +x"
    assert verdict.direction is not None
    assert verdict.direction.name == "translation along +x"


@pytest.mark.parametrize(
    ("push", "state"),
    [
        (0.5 - 1e-6, "held"),
        (0.5, "borderline"),
        (0.5 + 1e-6, "metastable"),
        (1.0 - 1e-6, "metastable"),
        (1.0, "borderline"),
        (1.0 + 1e-6, "escapes"),
    ],
)
def test_the_states_flip_exactly_at_the_load_factors(push: float, state: str) -> None:
    verdict = analyse(ALONE, block(push))
    assert verdict.state == state
    assert gives_way(ALONE, block(push)) == (push > 0.5)
    assert (verdict.direction is None) == (state == "held")


def test_a_tower_tips_about_its_edge_or_slides_whichever_comes_first() -> None:
    """Width 1, pushed at height 4: moments about the edge give W/8; friction gives 0.5."""
    tips = load_factors(ALONE, block(1.0, weight=2.0, height=4.0), "push")
    assert (tips.held, tips.peak) == (pytest.approx(0.25, abs=1e-9), pytest.approx(0.25, abs=1e-9))
    assert tips.mode is not None
    assert tips.mode.name == "rotation about (1, 0), clockwise"
    slides = load_factors(ALONE, block(1.0, weight=8.0, height=4.0), "push")
    assert (slides.held, slides.peak) == (pytest.approx(0.5, abs=1e-9), pytest.approx(1.0, abs=1e-9))
    assert slides.mode is not None
    assert slides.mode.name == "translation along +x"


def test_weight_is_a_load_of_which_there_must_be_enough() -> None:
    """A push of 0.4 at height 4 has the moment 1.6 about the edge: the weight must exceed 3.2."""
    factors = load_factors(ALONE, block(0.4, weight=1.0, height=4.0), "weight")
    assert factors.held_from == pytest.approx(3.2, abs=1e-8)
    assert factors.held == np.inf
    assert factors.mode is None


def test_the_papers_condition_is_the_conservative_one() -> None:
    """With the literal law c = γ2 meas(Γc)^½: condition (iii) fails for a load that still holds the body."""
    _, friction = floor_2d(SQUARE, 4, even(1.5), even(3.0), c4=1.5)
    verdict = analyse(ALONE, wall(1.0, (friction,)))
    assert verdict.state == "held"
    assert verdict.paper.c == pytest.approx(1.5, abs=1e-12)
    assert not verdict.paper.satisfied
    assert analyse(ALONE, wall(2.0, (friction,))).paper.satisfied


def test_lift_off_begins_where_the_lift_exceeds_weight_and_adhesion() -> None:
    points, weights = edge((0.0, 0.0), (1.0, 0.0), 4)
    opening = np.tile([[0.0, 1.0]], (5, 1, 1))
    glue = Resistance(
        fields=rigid_fields(points, SQUARE),
        weights=weights,
        directions=opening,
        growth=Directional(0.0, 0.25),
        peak=Directional(0.0, 0.75),
    )
    bare = load_factors(ALONE, wall(1.0, lift=4.0), "lift")
    assert (bare.held, bare.peak) == (pytest.approx(0.25, abs=1e-12), pytest.approx(0.25, abs=1e-12))
    glued = load_factors(ALONE, wall(1.0, (glue,), lift=4.0), "lift")
    assert (glued.held, glued.peak) == (
        pytest.approx(1.25 / 4, abs=1e-12),
        pytest.approx(1.75 / 4, abs=1e-12),
    )
    assert glued.mode is not None
    assert glued.mode.name == "translation along +y"


@pytest.mark.parametrize("angle", [0.2, 0.7, -0.4])
def test_a_plate_on_a_slanted_floor_slides_when_its_weight_along_the_slope_exceeds_the_growth(
    angle: float,
) -> None:
    t = np.array([np.cos(angle), np.sin(angle)])
    middle = 1.5 * t
    body = RigidBody(2, np.array([*middle, 0.0]))
    contact, friction = floor_2d(body, 12, even(0.25), even(0.4), 3.0, angle)
    loads = {"weight": force(body, (*middle, 0.0), (0.0, -2.0))}
    verdict = analyse(ALONE, RigidProblem(body=only(body), loads=loads, contact=(contact,), resistances=(friction,)))
    slope = 2.0 * abs(np.sin(angle))
    assert verdict.lambda_held == pytest.approx(0.75 / slope, abs=1e-9)
    assert verdict.lambda_peak == pytest.approx(1.2 / slope, abs=1e-9)
    down = -np.sign(angle) * t
    assert verdict.critical is not None
    assert verdict.critical.name == f"translation along ({down[0]:.2f}, {down[1]:.2f})"


def test_a_one_sided_law_holds_one_way_only() -> None:
    body = SQUARE
    contact, friction = floor_2d(body, 6, Directional(0.0, 0.5), Directional(0.0, 1.0))
    for push, held, state in ((0.3, 0.5 / 0.3, "held"), (-0.3, 0.0, "escapes")):
        loads = {
            "push": force(body, (0.5, 0.0, 0.0), (push, 0.0)),
            "weight": force(body, (0.5, 0.5, 0.0), (0.0, -1.0)),
        }
        problem = RigidProblem(body=only(body), loads=loads, contact=(contact,), resistances=(friction,))
        verdict = analyse(ALONE, problem)
        assert verdict.lambda_held == pytest.approx(held, abs=1e-9)
        assert verdict.state == state
        assert gives_way(ALONE, problem) == (state in ("metastable", "escapes"))  # no push meets the peak exactly


def test_springs_take_motions_out_of_the_kernel_and_one_sided_springs_out_of_the_cone() -> None:
    infinite = Directional(np.inf, np.inf)
    body = SQUARE
    contact, spring = floor_2d(body, 6, infinite, infinite)
    loads = {
        "push": force(body, (0.5, 0.0, 0.0), (7.0, 0.0)),
        "weight": force(body, (0.5, 0.5, 0.0), (0.0, -1.0)),
    }
    verdict = analyse(ALONE, RigidProblem(body=only(body), loads=loads, contact=(contact,), resistances=(spring,)))
    assert words(verdict) == ["translation along y", "rotation about (0.5, 0)"]
    assert verdict.state == "held"
    points, weights = edge((0.0, 0.0), (1.0, 0.0), 6)
    support = Resistance(
        fields=rigid_fields(points, body),
        weights=weights,
        directions=np.tile([[0.0, -1.0]], (7, 1, 1)),
        growth=Directional(0.0, np.inf),
        peak=Directional(0.0, np.inf),
    )
    on_support = RigidProblem(body=only(body), loads=loads, resistances=(spring, support))
    assert analyse(ALONE, on_support).margin == pytest.approx(verdict.margin, abs=1e-10)


def test_a_body_in_a_tight_corner_has_motions_but_none_that_is_admitted() -> None:
    """Contact all round: the kernel is full, the cone is {0}."""
    body = RigidBody(2, np.zeros(3))
    sides = [
        ([1.0, 0.5, 0.0], [1.0, 0.0]),
        ([1.0, -0.5, 0.0], [1.0, 0.0]),
        ([-1.0, 0.5, 0.0], [-1.0, 0.0]),
        ([-1.0, -0.5, 0.0], [-1.0, 0.0]),
        ([0.0, 1.0, 0.0], [0.0, 1.0]),
        ([0.0, -1.0, 0.0], [0.0, -1.0]),
    ]
    contact = works(np.array([n for _, n in sides]), rigid_fields(np.array([p for p, _ in sides]), body))
    verdict = analyse(ALONE, RigidProblem(body=only(body), loads={"g": np.array([1.0, 2.0, 3.0])}, contact=(contact,)))
    assert (verdict.state, verdict.margin, verdict.lambda_held) == ("held", None, np.inf)
    assert len(verdict.kernel) == 3


def test_balanced_and_unheld_motions_are_free_and_the_state_is_borderline() -> None:
    verdict = analyse(ALONE, block(0.0, growth=0.0, peak=0.0))
    assert (verdict.state, verdict.margin) == ("borderline", 0.0)
    assert [mode.name for mode in verdict.free] == ["translation along x"]
    assert verdict.direction is not None
    assert verdict.direction.name in ("translation along +x", "translation along -x")
    floating = analyse(ALONE, RigidProblem(body=only(RigidBody(2, np.zeros(3))), loads={"balanced": np.zeros(3)}))
    assert floating.state == "borderline"
    assert len(floating.free) == 3
    in_space = analyse(ALONE, slab((0.0, 0.0), growth=0.0))
    assert in_space.state == "borderline"
    assert [mode.name for mode in in_space.free] == [
        "translation along x",
        "translation along y",
        "rotation about the axis through (1, 0.5, 0.5) along z",
    ]


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1, 2.5])
def test_an_oblique_push_in_space_meets_the_area_times_the_growth(angle: float) -> None:
    """Area 2, growth 0.3: by symmetry no rotation helps the push, whatever its direction."""
    push = (0.8 * np.cos(angle), 0.8 * np.sin(angle))
    verdict = analyse(ALONE, slab(push))
    assert verdict.lambda_held == pytest.approx(0.6 / 0.8, abs=1e-8)
    assert verdict.lambda_peak == pytest.approx(1.2 / 0.8, abs=1e-8)
    assert verdict.state == "metastable"
    assert verdict.direction is not None
    along = np.array(verdict.direction.coefficients)[:3]
    assert along / np.linalg.norm(along) == pytest.approx([np.cos(angle), np.sin(angle), 0.0], abs=1e-4)


def test_a_torque_about_the_vertical_meets_growth_times_distance() -> None:
    """The law turned about the middle resists by γ Σ w r."""
    problem = slab((0.0, 0.0), torque=0.5)
    part = problem.resistances[0]
    arms = np.linalg.norm(part.slips[:, :, 5], axis=1)
    verdict = analyse(ALONE, problem)
    assert verdict.lambda_held == pytest.approx(0.3 * float(part.weights @ arms) / 0.5, abs=1e-8)
    assert verdict.critical is not None
    assert verdict.critical.name == "rotation about the axis through (1, 0.5, 0.5) along +z"


def test_an_eccentric_push_in_space_agrees_with_a_fine_search() -> None:
    """Sliding and turning together, the limit surface of planar friction, has no closed form: search."""
    problem = slab((0.0, 0.0))
    body, part = problem.body.bodies[0], problem.resistances[0]
    loads = {**problem.loads, "push": force(body, (1.7, 0.5, 0.0), (0.2, 0.7, 0.0))}
    factor = load_factors(
        ALONE,
        RigidProblem(body=only(body), loads=loads, contact=problem.contact, resistances=(part,)),
        "push",
    )

    def ratio(t: Array) -> float:
        y = np.array([t[0], t[1], 0.0, 0.0, 0.0, t[2]])
        slip = part.slips @ y
        return 0.3 * float(part.weights @ np.linalg.norm(slip, axis=1)) / float(loads["push"] @ y)

    best, spread = np.array([0.0, 1.0, 0.5]), 1.0
    rng = np.random.default_rng(1)
    for _ in range(60):
        trials = np.vstack([best, best + spread * rng.normal(size=(200, 3))])
        best = min((t for t in trials if loads["push"] @ np.r_[t[:2], 0, 0, 0, t[2]] > 0), key=ratio)
        spread *= 0.8
    assert factor.held <= ratio(best) + 1e-9
    assert factor.held == pytest.approx(ratio(best), rel=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_random_plane_problems_agree_with_one_large_linear_programme(seed: int) -> None:
    """λ = min R(y) with <g,y> = 1 on the cone, every |slip| an unknown of its own: no cuts."""
    rng = np.random.default_rng(seed)
    body = RigidBody(2, rng.normal(size=3) * [1.0, 1.0, 0.0])
    points = np.hstack([rng.normal(size=(30, 2)), np.zeros((30, 1))])
    angles = rng.uniform(0.0, 2.0 if seed % 3 else 4.0, 30)
    fields = rigid_fields(points, body)
    contact = works(-np.column_stack([np.cos(angles), np.sin(angles)])[:8], fields[:8])
    tangents = rng.normal(size=(30, 1, 2))
    laws = [Directional(*sorted(rng.uniform(0.1, 1.0, 2))) for _ in range(2)]
    parts = tuple(
        Resistance(
            fields=fields[s], weights=rng.uniform(0.1, 1.0, 15), directions=tangents[s], growth=law, peak=even(2.0)
        )
        for s, law in zip((slice(15), slice(15, 30)), laws, strict=True)
    )
    g = rng.normal(size=3)
    found = load_factors(ALONE, RigidProblem(body=only(body), loads={"g": g}, contact=(contact,), resistances=parts))
    rows = np.vstack([p.slips[:, 0] for p in parts])
    weights = np.concatenate([p.weights for p in parts])
    plus, minus = np.repeat([law.plus for law in laws], 15), np.repeat([law.minus for law in laws], 15)
    upper = np.vstack(
        [
            np.hstack([plus[:, None] * rows, -np.eye(30)]),
            np.hstack([-minus[:, None] * rows, -np.eye(30)]),
            np.hstack([contact, np.zeros((8, 30))]),
        ]
    )
    reference = linprog(
        np.r_[np.zeros(3), weights],
        upper,
        np.zeros(len(upper)),
        np.r_[g, np.zeros(30)][None],
        [1.0],
        [(None, None)] * 33,
        "highs",
    )
    assert found.held == pytest.approx(reference.fun if reference.status == 0 else np.inf, rel=1e-8)


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(s, marks=pytest.mark.long) for s in range(3, 8))])
def test_no_sampled_motion_is_worse_than_the_margin(seed: int) -> None:
    """The margin is attained by its own direction and undercut by no other unit motion of the cone."""
    rng = np.random.default_rng(100 + seed)
    d = 2 + seed % 2
    body = RigidBody(d, np.zeros(3))
    points = np.hstack([rng.uniform(-1, 1, size=(40, d)), np.zeros((40, 3 - d))])
    normals = -np.abs(rng.normal(size=(6, d)))
    slips = np.linalg.qr(rng.normal(size=(40, d, d - 1)))[0].transpose(0, 2, 1)
    fields = rigid_fields(points, body)
    part = Resistance(
        fields=fields, weights=rng.uniform(0.01, 0.05, 40), directions=slips, growth=even(0.8), peak=even(1.1)
    )
    g = rng.normal(size=body.motions) * rng.choice([0.1, 0.5, 2.0])
    cone = works(normals, fields[:6])
    verdict = analyse(ALONE, RigidProblem(body=only(body), loads={"g": g}, contact=(cone,), resistances=(part,)))
    trials = rng.normal(size=(4000, body.motions))
    trials = trials[(trials @ cone.T <= 0.0).all(axis=1)]
    trials /= np.abs(trials).max(axis=1, keepdims=True)
    slip = np.einsum("mrn,tn->tmr", part.slips, trials)
    values = 0.8 * np.linalg.norm(slip, axis=2) @ part.weights - trials @ g
    assert verdict.margin is not None
    assert values.min() >= verdict.margin - 1e-9
    assert verdict.state == ("held" if verdict.margin > 0 else "metastable" if verdict.lambda_peak > 1 else "escapes")
    assert (verdict.lambda_held > 1.0) == (verdict.margin > 0.0)


@pytest.mark.parametrize(
    ("points", "directions", "expected"),
    [
        ([[0, 0, 0]], [[1, 0]], ["translation along y", "rotation about (0.5, 0)"]),
        ([[0, 0, 0], [0, 1, 0]], [[1, 0], [1, 0]], ["translation along y"]),
        ([[0, 0, 0], [0, 0, 0]], [[1, 0], [0, 1]], ["rotation about (0, 0)"]),
        (
            [[0, 0, 0], [2, 2, 0]],
            [[1, 1], [1, 1]],
            ["translation along (0.71, -0.71)", "rotation about (0.5, 0.5)"],
        ),
        ([[0, 0, 0], [1, -1, 0]], [[1, 1], [1, 1]], ["translation along (0.71, -0.71)"]),
    ],
)
def test_kernels_in_the_plane_are_told_in_words(
    points: list[list[float]], directions: list[list[float]], expected: list[str]
) -> None:
    body = SQUARE
    fields, ways = rigid_fields(np.array(points, float), body), np.array(directions, float)
    basis = kernel(ALONE, only(body), [works(ways, fields)])
    found = [mode.name for mode in modes(basis, only(body))]
    work = [np.einsum("n,mnd->md", column, fields) for column in basis.T]
    assert all(np.abs((field * ways).sum(axis=1)).max() < 1e-12 for field in work)
    assert found == expected


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        (
            [2],
            [
                "translation along x",
                "translation along y",
                "rotation about the axis through (0.5, 0.5, 0.5) along z",
            ],
        ),
        (
            [0, 1],
            [
                "translation along z",
                "rotation about the axis through (0.5, 0.5, 0) along x",
                "rotation about the axis through (0.5, 0.5, 0) along y",
            ],
        ),
    ],
)
def test_kernels_in_space_are_told_in_words(axes: list[int], expected: list[str]) -> None:
    """Components fixed on the whole base of a cube."""
    body = RigidBody(3, np.array([0.5, 0.5, 0.5]))
    fields = floor_3d(body, 3, 0.0, 0.0)[1].fields
    fixed = [fields[:, :, axis] for axis in axes]
    found = [mode.name for mode in modes(kernel(ALONE, only(body), fixed), only(body))]
    assert found == expected


def test_bodies_that_do_not_touch_are_as_weak_as_the_weakest() -> None:
    both = combine([analyse(ALONE, block(0.3)), analyse(ALONE, block(0.8))])
    assert both.state == "metastable"
    assert both.margin == pytest.approx(-0.3, abs=1e-10)
    assert both.lambda_held == pytest.approx(0.5 / 0.8, abs=1e-9)
    assert len(both.kernel) == 6


def test_the_example_in_the_documents_prints_what_they_say(capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(__file__).parents[2] / "docs" / "solvability.md").read_text()
    source, printed = text.split("```python\n")[1].split("```", 1)
    exec(compile(source, "docs/solvability.md", "exec"), {})
    assert capsys.readouterr().out.strip() == printed.split("```")[1].strip()


def scenes() -> dict[str, RigidProblem]:
    """What is compared between one rank and several."""
    return {
        "block": block(0.8),
        "tower": block(0.2, weight=2.0, height=4.0),
        "wall": wall(1.0),
        "slab": slab((0.3, 0.4), 0.2),
    }


def share(problem: RigidProblem, rank: int, size: int) -> RigidProblem:
    """The rows of one rank, dealt like cards; the last of several ranks gets none."""
    mine = slice(rank, None, size - 1) if size > 1 else slice(None)
    if size > 1 and rank == size - 1:
        mine = slice(0, 0)
    return RigidProblem(
        body=problem.body,
        loads=problem.loads,
        fixed=tuple(rows[mine] for rows in problem.fixed),
        contact=tuple(rows[mine] for rows in problem.contact),
        resistances=tuple(
            Resistance(
                fields=p.fields[mine],
                weights=p.weights[mine],
                directions=p.directions[mine],
                growth=p.growth,
                peak=p.peak,
                c4=p.c4,
            )
            for p in problem.resistances
        ),
    )


def verdicts(comm: MPI.Comm) -> dict[str, object]:
    parts = {name: share(problem, comm.rank, comm.size) for name, problem in scenes().items()}
    return {
        name: {**analyse(comm, part).summary(), "push": load_factors(comm, part).peak} for name, part in parts.items()
    }


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_the_verdict_does_not_depend_on_the_number_of_ranks(ranks: int) -> None:
    answers = on_ranks(ranks, __file__)
    assert len(answers) == ranks
    assert all(answer == answers[0] for answer in answers)
    alone = json.loads(json.dumps(verdicts(ALONE)))
    for name, expected in alone.items():
        for key, value in expected.items():
            found = answers[0][name][key]
            assert found == (pytest.approx(value, abs=1e-8) if isinstance(value, float) else value), (
                name,
                key,
            )


if __name__ == "__main__":
    gathered = MPI.COMM_WORLD.gather(verdicts(MPI.COMM_WORLD), root=0)
    if gathered is not None:
        print(json.dumps(gathered))
