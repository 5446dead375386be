"""Opening and slip in one law: against laws of one mode, areas under the law, statics by hand, another optimiser."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scenes import Table, solved
from scipy.optimize import minimize

from hvi_fenicsx import InputError, Solution, read_tables, solve, workflow
from hvi_fenicsx.certify.contact_state import ContactState

Array = npt.NDArray[np.float64]
E, PEAK, FIRST, LAST = 2.0e11, 2.0e6, 1.0e-6, 5.0e-6
ENERGY = PEAK * LAST / 2
BOND = [[0.0, 0.0], [FIRST, PEAK], [LAST, 0.0]]
RIGID = [[0.0, PEAK], [LAST, 0.0]]
BRITTLE = [[0.0, 0.0], [FIRST, PEAK], [FIRST, 0.4 * PEAK]]


def law(points: Any, **more: Any) -> Table:
    return {"law": "graph", "points": points, **more}


def square(floor: Table, top: Table, cells: int = 3, dimension: int = 2, **solver: Any) -> Table:
    """A unit square or cube; its bottom is the part that is glued."""
    shape = {2: "rectangle", 3: "box"}[dimension]
    material = {"youngs_modulus": E, "poisson_ratio": 0.3}
    material["model"] = {2: "plane_stress", 3: "three_dimensional"}[dimension]
    return {
        "domain": {"shape": shape, "size": [1.0] * dimension, "cells": [cells] * dimension},
        "material": material,
        "boundary": {"top": {"on": "top", **top}, "glue": {"on": "bottom", **floor}},
        "solver": solver,
    }


def glue(found: Solution) -> ContactState:
    assert found.exit_code == 0, found.reason
    assert found.examination is not None
    return next(state for state in found.examination.states if state.surface.part == "glue")


def scaled(slip: float, points: Any) -> list[list[float]]:
    """The law of the slip alone that beta makes of a law of both modes."""
    return [[x / slip, traction * slip] for x, traction in points]


ONE_MODE = {
    "opening": ([0.0, "free"], lambda points: {"adhesion": law(points, one_sided=True)}, [0.0, 4.0e-6]),
    "slip": (["free", 0.0], lambda points: {"friction": law(scaled(0.5, points))}, [9.0e-6, 0.0]),
}


@pytest.mark.parametrize("points", [BOND, RIGID, BRITTLE], ids=["softening", "rigid", "brittle"])
@pytest.mark.parametrize("mode", ONE_MODE)
def test_one_mode_alone_is_the_law_of_that_mode(mode: str, points: Any) -> None:
    """The other component is prescribed on the part."""
    held, alone, pull = ONE_MODE[mode]
    top = {"displacement": pull}
    together = solved(square({"displacement": held, "cohesion": law(points, beta=0.5)}, top))
    separate = solved(square({"displacement": held, **alone(points)}, top))
    one, other = glue(together), glue(separate)
    assert np.allclose(one.values, other.values, rtol=0.0, atol=1e-10 * np.abs(other.values).max())
    mine, its = (getattr(state, {"opening": "pressure", "slip": "friction"}[mode]) for state in (one, other))
    assert np.allclose(mine, its, rtol=0.0, atol=1e-10 * np.abs(its).max())


@pytest.mark.parametrize("mode", ["slip", "both"])
def test_in_space_it_is_friction_where_nothing_opens(mode: str) -> None:
    held = ["free", "free", 0.0]
    top = {"displacement": [9.0e-6, 3.0e-6, 0.0]}
    if mode == "both":
        top = {"displacement": [9.0e-6, "free", 0.0]}
    together = solved(square({"displacement": held, "cohesion": law(BOND, beta=0.5)}, top, 2, 3))
    separate = solved(square({"displacement": held, "friction": law(scaled(0.5, BOND))}, top, 2, 3))
    one, other = glue(together), glue(separate)
    assert np.allclose(one.values, other.values, rtol=0.0, atol=1e-9 * np.abs(other.values).max())


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_forces_are_the_derivative_of_the_energy(dimension: int) -> None:
    """At random separations, some of them closed."""
    table = square({"cohesion": law(BOND, beta=0.7)}, {"traction": [1.0e6] * dimension}, 1, dimension)
    system = workflow.prepare(read_tables(table)).system
    (term,) = system.terms
    rng, n = np.random.default_rng(1), system.load.local_size
    u = rng.normal(size=n) * 2 * term.law.length_scale

    def energy(v: Array) -> float:
        return float(term.surface.weights @ term.law.value(term.argument(v)))

    def force(v: Array) -> Array:
        out, x = np.zeros(n), term.argument(v)
        at_vertices = out.reshape(-1, dimension)
        at_vertices[term.surface.blocks] = term.force(v, (term.law.left(x) + term.law.right(x)) / 2)
        return out

    argument = term.argument(u)
    rates = term.rate(u, term.law.right(argument), term.law.convex.second(argument) - term.law.concave.second(argument))
    for _ in range(4):
        v, h = rng.normal(size=n), 1e-6
        assert (energy(u + h * v) - energy(u - h * v)) / (2 * h) == pytest.approx(float(force(u) @ v), rel=1e-6)
        change = (force(u + h * v) - force(u - h * v)) / (2 * h)
        w, at = term.surface.weights, term.surface.values
        product = np.einsum("m,mab,mb->ma", w, rates, at(v))
        assert np.allclose(at(change), product, rtol=1e-5, atol=1e-6 * np.abs(product).max())


@pytest.mark.parametrize("beta", [0.5, 2.0])
def test_the_strength_under_an_inclined_pull_is_that_of_an_ellipse(beta: float) -> None:
    """A pull without moment about the middle of the floor, in shares of the strength in tension."""
    for tension, shear in ((0.6, 0.3), (0.2, -0.5), (0.0, 0.4)):
        along, up = shear * PEAK, tension * PEAK
        top = {"traction": [along, f"{up} + {12 * along}*(x - 0.5)"]}
        found = workflow.prepare(read_tables(square({"cohesion": law(BRITTLE, beta=beta)}, top, 4))).solvability
        strength = 1.0 / np.hypot(tension, shear / beta)
        assert found.lambda_peak <= strength * (1 + 1e-9)
        assert found.lambda_held == pytest.approx(0.4 * found.lambda_peak, rel=1e-9)


def work(delta: Array) -> Array:
    """∫ of the graph of BOND up to lengths, written down once more."""
    rising, left = np.minimum(delta, FIRST), np.maximum(LAST - delta, 0.0)
    falling = (LAST - FIRST) * PEAK / 2 - PEAK * np.minimum(left, LAST - FIRST) ** 2 / (2 * (LAST - FIRST))
    return np.asarray(PEAK * rising**2 / (2 * FIRST) + falling)


@pytest.mark.parametrize("closes", [False, True])
def test_another_optimiser_ends_where_the_program_does(closes: bool) -> None:
    """L-BFGS with bounds on all unknowns, from the solution shaken by parts of the softening's length."""
    floor = {"cohesion": law(BOND, beta=0.6)} | ({"contact": {"gap": 0.0}} if closes else {})
    table = square(floor, {"displacement": [2.4e-6, 1.6e-6]}, 3)
    found = solved(table)
    state, scales = glue(found), found.problem.scales
    system = workflow.prepare(read_tables(table)).system
    stiffness = system.jacobian.matrix.copy()
    stiffness.convert("dense")
    matrix, load = stiffness.getDenseArray(), system.load.array_r
    normal, along = state.surface.blocks * 2 + 1, state.surface.blocks * 2
    unit = scales.displacement

    def energy(u: Array) -> tuple[float, Array]:
        opening, slip = np.maximum(u[normal], 0.0), 0.6 * u[along]
        delta = np.hypot(opening, slip)
        tractions = np.interp(delta * unit, [0.0, FIRST, LAST], [0.0, PEAK, 0.0]) / scales.stress
        rate = np.divide(tractions, delta, out=np.zeros_like(delta), where=delta > 0.0) * state.surface.weights
        force = matrix @ u - load
        total = 0.5 * float(u @ (force - load)) + float(state.surface.weights @ work(delta * unit)) / (
            scales.stress * unit
        )
        np.add.at(force, normal, rate * opening)
        np.add.at(force, along, 0.6 * rate * slip)
        return total, force

    assert found.solve_result is not None
    solution, rng = found.solve_result.u.x.array.copy(), np.random.default_rng(5)
    bounds = np.tile([-np.inf, np.inf], (len(solution), 1))
    if closes:
        bounds[normal, 0] = 0.0
    lowest = energy(solution)[0]
    for shaken in (0.1, 0.5):
        start = solution + shaken * LAST / unit * rng.normal(size=len(solution))
        options = {"maxiter": 20_000, "maxfun": 100_000, "ftol": 1e-16, "gtol": 1e-10}
        end = minimize(energy, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        assert end.fun == pytest.approx(lowest, rel=1e-8)
        assert np.allclose(end.x, solution, rtol=0.0, atol=1e-4 * np.abs(solution).max())


REFUSED = [
    ({"cohesion": law(BOND, beta=0.0)}, "1e-09 or more"),
    ({"cohesion": law(BOND, one_sided=True)}, "leave one_sided out"),
    ({"cohesion": law([[0, 0], [1e-6, 1e6], [2e-6, -1e6], [3e-6, 0]])}, "push the sides apart"),
    ({"cohesion": law(BOND), "friction": law(BOND)}, "cohesion alone, or adhesion and friction"),
    ({"cohesion": law(BOND), "adhesion": law(BOND)}, "cohesion alone, or adhesion and friction"),
    ({"cohesion": law([[0, 0], [1e-6, 1e6], [1e-6, 2e6]])}, "smooth it"),
]


@pytest.mark.parametrize(("floor", "words"), REFUSED)
def test_what_makes_no_sense_is_refused_with_the_mend(floor: Table, words: str) -> None:
    with pytest.raises(InputError, match=words):
        solve(read_tables(square(floor, {"traction": [0.0, 1.0e6]}, 1)))


CRITERIA = {
    "none": lambda b, ratio, exponent: 1.0,
    "benzeggagh_kenane": lambda b, ratio, exponent: 1.0 + (ratio - 1.0) * b**exponent,
    "power_law": lambda b, ratio, exponent: ((1.0 - b) ** exponent + (b / ratio) ** exponent) ** (-1.0 / exponent),
}


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("angle", [0.0, 40.0, 90.0])
def test_each_mode_dissipates_its_share_of_the_energy_at_its_mixity(criterion: str, angle: float) -> None:
    """The separation is prescribed along a ray, so the share B of the slip stays, and all of G(B) is dissipated."""
    beta, ratio, exponent = 0.5, 3.0, 2.1
    opening, slip = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    rate = float(np.hypot(opening, beta * slip))
    share = (beta * slip / rate) ** 2
    mixed = {"beta": beta}
    if criterion != "none":
        mixed |= {"mixity": criterion, "energy_ratio": ratio, "exponent": exponent}
    states = []
    for delta in (FIRST, LAST, 1.2 * LAST):
        way = {"displacement": [slip * delta / rate, opening * delta / rate]}
        found = solved(square({**way, "cohesion": law(BOND, **mixed)}, {"traction": [0.0, 0.0]}, 1))
        state, u, p = glue(found), found.problem.scales.displacement, found.problem.scales.stress
        states.append([state.normal * u, state.pressure * p, state.slip[:, 0] * u, state.friction[:, 0] * p])
        assert found.certificate.mixity == (None if criterion == "none" else pytest.approx(0.0, abs=1e-8))
    down, pulls, along, drags = np.moveaxis(np.array([np.zeros_like(states[0]), *states]), 1, 0)
    energy = ENERGY * CRITERIA[criterion](share, ratio, exponent)
    assert np.trapezoid(pulls, -down, axis=0) == pytest.approx(energy * (1.0 - share), rel=1e-8, abs=1e-12)
    assert np.trapezoid(drags, along, axis=0) == pytest.approx(energy * share, rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("criterion", [name for name in CRITERIA if name != "none"])
def test_a_mixity_that_stands_is_that_of_the_law_with_the_energies_it_asks_for(criterion: str) -> None:
    """The forces at the glue, from the displacements and the definition of the law alone."""
    ratio, exponent, beta = 2.0, 1.5, 0.6
    mixed = {"beta": beta, "mixity": criterion, "energy_ratio": ratio, "exponent": exponent}
    found = solved(square({"cohesion": law(BOND, **mixed)}, {"displacement": [2.4e-6, "1.6e-6*(1 + x)"]}, 3))
    state, scales = glue(found), found.problem.scales
    assert found.examination is not None
    assert found.examination.certificate.mixity is not None
    assert found.examination.certificate.mixity <= 1e-8
    opening, slip = -state.normal * scales.displacement, state.slip[:, 0] * scales.displacement
    delta = np.hypot(opening, beta * slip)
    share = (beta * slip / delta) ** 2
    assert np.ptp(share) > 0.1
    traction = np.interp(delta, [0.0, FIRST, LAST], [0.0, PEAK, 0.0]) * CRITERIA[criterion](share, ratio, exponent)
    assert np.allclose(-state.pressure * scales.stress, -traction * opening / delta, rtol=0.0, atol=1e-6 * PEAK)
    assert np.allclose(
        state.friction[:, 0] * scales.stress, traction * beta**2 * slip / delta, rtol=0.0, atol=1e-6 * PEAK
    )
    assert found.estimate is None
    assert found.uniqueness is not None
    assert "no potential" in found.uniqueness.why
