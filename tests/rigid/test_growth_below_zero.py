"""Laws that drive a body: growth that is not convex, factors that hold nothing, the paper's constant; sampled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scenes import block

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.console import existence
from hvi_fenicsx.rigid import (
    Directional,
    JoinedBodies,
    Resistance,
    RigidBody,
    RigidProblem,
    Solvability,
    analyse,
    rigid_fields,
    works,
)

Array = NDArray[np.float64]
ALONE = MPI.COMM_SELF


def growth(problem: RigidProblem, motions: Array) -> Array:
    """∫ j^∞(y) of motions (t, n), (t,)."""
    total = np.zeros(len(motions))
    for part in problem.resistances:
        slips = np.einsum("mrn,tn->tmr", part.slips, motions)
        size = np.linalg.norm(slips, axis=2)
        ahead = slips[:, :, 0] >= 0 if slips.shape[2] == 1 else np.ones_like(size, dtype=bool)
        total += (size * np.where(ahead, part.growth.plus, part.growth.minus)) @ part.weights
    return total


def lowest(problem: RigidProblem, function: Callable[[Array], Array], seed: int = 0) -> float:
    """Minimum of a function of unit motions over the cone: random motions, the best of them varied less and less."""
    rng, n = np.random.default_rng(seed), problem.body.motions
    rows = np.vstack(problem.contact)
    known = np.zeros((0, n))
    for spread in [np.inf, *np.geomspace(1.0, 1e-7, 40)]:
        trials = rng.normal(size=(20_000 if spread == np.inf else 4_000, n))
        if len(known):
            trials = np.vstack([known, known[rng.integers(len(known), size=len(trials))] + spread * trials])
        trials = trials[(trials @ rows.T <= 0.0).all(axis=1)]
        trials /= np.abs(trials).max(axis=1, keepdims=True)
        known = trials[np.argsort(function(trials))[:60]]
    return float(function(known).min())


def random_problem(seed: int, d: int) -> RigidProblem:
    """A body between two parts, of which one drives it on and the other one holds it; contact below."""
    rng = np.random.default_rng(seed)
    body = RigidBody(d, np.zeros(3))
    parts = []
    for p in range(3):
        points = np.hstack([rng.uniform(-1, 1, size=(8, d)), np.zeros((8, 3 - d))])
        points[:, d - 1] = p - 1 if d == 3 else points[:, d - 1]
        radial = d == 3 and p < 2
        directions = np.linalg.qr(rng.normal(size=(8, d, d)))[0][:, : 2 if radial else 1]
        directions = np.broadcast_to(np.eye(3)[None, :2], (8, 2, 3)) if radial else directions
        plus, minus = rng.uniform(0.0, 1.0, 2) if p else -rng.uniform(0.0, 0.7, 2)
        law = Directional(plus, plus) if radial else Directional(minus, plus)
        parts.append(
            Resistance(
                fields=rigid_fields(points, body),
                weights=rng.uniform(0.1, 0.3, 8),
                directions=directions,
                growth=law,
                peak=Directional(3.0, 3.0),
                c4=max(0.0, -law.minus, -law.plus),
            )
        )
    points = np.hstack([rng.uniform(-1, 1, size=(4, d)), np.zeros((4, 3 - d))])
    contact = works(-np.abs(rng.normal(size=(4, d))), rigid_fields(points, body))
    load = rng.normal(size=body.motions) * rng.choice([0.02, 0.2, 1.0])
    return RigidProblem(body=JoinedBodies((body,)), loads={"g": load}, contact=(contact,), resistances=tuple(parts))


def agree(problem: RigidProblem, verdict: Solvability, rel: float = 1e-5) -> None:
    """The margin is the sampled one, and says the same as the state and the load factor."""
    sampled = lowest(problem, lambda y: growth(problem, y) - y @ sum(problem.loads.values()))
    assert verdict.margin == pytest.approx(sampled, rel=rel, abs=rel)
    assert verdict.margin <= sampled + 1e-9
    assert (verdict.state == "held") == (verdict.margin > 0)
    assert verdict.state in (("held",) if verdict.margin > 0 else ("metastable", "escapes"))
    if verdict.state == "held":
        assert verdict.held_from < 1.0 < verdict.lambda_held
    if verdict.paper.satisfied:
        assert verdict.state == "held"


@pytest.mark.parametrize("seed", [2, 3, 4, 6, *(pytest.param(s, marks=pytest.mark.long) for s in range(7, 40))])
def test_in_the_plane_the_margin_is_the_sampled_one(seed: int) -> None:
    problem = random_problem(seed, 2)
    agree(problem, analyse(ALONE, problem))


@pytest.mark.parametrize("seed", [5, *(pytest.param(s, marks=pytest.mark.long) for s in (0, 1, 2, 3, 4, 6, 7))])
def test_in_space_the_margin_is_the_sampled_one(seed: int) -> None:
    problem = random_problem(100 + seed, 3)
    agree(problem, analyse(ALONE, problem), rel=1e-3)


def literal(seed: int) -> RigidProblem:
    """A law that drives the body one way, and a load that presses it against all of its contact."""
    rng = np.random.default_rng(seed)
    body, drive = RigidBody(2, np.zeros(3)), rng.uniform(0.2, 0.6)
    points, at = (np.hstack([rng.uniform(-1, 1, (m, 2)), np.zeros((m, 1))]) for m in (8, 5))
    part = Resistance(
        fields=rigid_fields(points, body),
        weights=rng.uniform(0.1, 0.3, 8),
        directions=np.linalg.qr(rng.normal(size=(8, 2, 2)))[0][:, :1],
        growth=Directional(-drive, drive),
        peak=Directional(0.0, 2 * drive),
        c4=drive,
    )
    normals = rng.normal(size=(5, 2))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    cone = works(normals, rigid_fields(at, body))
    load = rng.uniform(0.3, 3.0, 5) @ cone
    return RigidProblem(body=JoinedBodies((body,)), loads={"g": load}, contact=(cone,), resistances=(part,))


def loaded(problem: RigidProblem, factor: float) -> RigidProblem:
    """The problem with its load times a factor."""
    return replace(problem, loads={"g": factor * problem.loads["g"]})


@pytest.mark.parametrize("seed", [1, 5, 13, 90])
def test_the_papers_condition_holds_the_body_wherever_it_is_satisfied(seed: int) -> None:
    """Its constant has the norm of the trace; with γ0 = 1 the condition held for loads that the law overcomes."""
    problem = literal(seed)
    (part,) = problem.resistances
    paper = analyse(ALONE, problem).paper
    assert paper.margin is not None
    trials = np.random.default_rng(1).choice([-1.0, 0.0, 1.0], size=(500, 3))
    fields = np.einsum("tn,mnd->tmd", trials, part.fields)
    trace = np.sqrt(np.max(np.sum(fields**2, axis=2) @ part.weights))
    assert paper.c == pytest.approx(part.c4 * np.sqrt(part.weights.sum()) * trace, rel=1e-12)
    just = analyse(ALONE, loaded(problem, 1.0001 * paper.c / paper.margin))
    assert (just.paper.satisfied, just.state) == (True, "held")
    if seed != 1:
        overcome = analyse(ALONE, loaded(problem, 1.01 * paper.c / trace / paper.margin))
        assert (overcome.paper.satisfied, overcome.state) == (False, "metastable")


def test_literal_friction_that_no_factor_of_the_load_holds_says_so() -> None:
    """γ2 = 5 P drives the block to the left, and to the right P would have to stay below it: never both."""
    scene = block(
        2, push=0.2e6, friction={"law": "quadratic_linear_literal", "gamma1": 2e6, "gamma2": 1e6, "delta": 9e-6}
    )
    prepared = prepare(read_tables(scene))
    found = prepared.solvability
    assert found.state == "metastable"
    assert found.never_held
    assert found.summary()["lambda_held"] is None
    assert found.summary()["never_held"] is True
    line = existence(prepared)
    assert "held at no load factor" in line
    assert "held up to" not in line
