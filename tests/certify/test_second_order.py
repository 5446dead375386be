"""Minimiser or not: the verdict against the energy itself, sampled around the point by an assembly of its own."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from runs import ROOT
from scenes import STEEL, Table, displacement, points, solved

import hvi_fenicsx as hvi
from hvi_fenicsx.system.thresholds import DEFAULT
from hvi_fenicsx.workflow import Solution

sys.path.insert(0, str(Path(__file__).parents[1] / "attack"))

from referee.assembly import Problem, assemble
from referee.meshes import block

Array = npt.NDArray[np.float64]
LITERAL = {"law": "quadratic_linear_literal", "gamma1": 1e6, "gamma2": 5e5, "delta": 9e-6}
EVEN = {"law": "quadratic_linear", "gamma1": 1e6, "gamma2": 5e5, "delta": 9e-6}
PUSHING = {"law": "graph", "points": [[0, -3e6]]}
GUIDE = {"on": "left", "displacement": [0.0, "free"]}
PRESS = {"on": "top", "traction": [0.0, -1e6]}


def square(**boundary: Table) -> Table:
    domain = {"shape": "rectangle", "size": [1.0, 1.0], "cells": [2, 2]}
    return {"domain": domain, "material": dict(STEEL), "boundary": boundary, "solver": {"second_order": True}}


def cube(**boundary: Table) -> Table:
    domain = {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [1, 1, 1]}
    material = STEEL | {"model": "three_dimensional"}
    return {"domain": domain, "material": material, "boundary": boundary, "solver": {"second_order": True}}


def tresca(strength: float) -> Table:
    return {"law": "tresca", "yield_traction": strength}


def floor(**more: Any) -> Table:
    return {"on": "bottom", "contact": {"gap": 0.0}, **more}


def bilateral(at: float, law: Table) -> Table:
    return {"on": "bottom", "contact": {"lower": at, "upper": at}, "adhesion": law}


IN_CORNERS = {
    "strong Tresca at a wall that pushes": square(
        press=PRESS, floor=floor(friction=tresca(2e6)), wall={"on": "left", "adhesion": LITERAL}
    ),
    "Tresca that covers the drop just so": square(
        press=PRESS,
        floor=floor(friction=tresca(2.6e5)),
        wall={"on": "left", "contact": {"gap": 0.0}, "adhesion": LITERAL},
    ),
}
ON_BOUNDS = {
    "a drop at a reached bound": square(wall=GUIDE, press=PRESS, floor=floor(adhesion=LITERAL)),
    "no room at a drop": square(wall=GUIDE, press=PRESS, floor=bilateral(-9e-6, EVEN)),
    "no room at the literal one": square(wall=GUIDE, press=PRESS, floor=bilateral(9e-6, LITERAL)),
}
SPACE = {
    "top": {"on": "top", "displacement": [0.0, 0.0, -2e-6]},
    "pull": {"on": "right", "traction": [1e6, 0.0, 0.0]},
}
IN_SPACE = {
    "pushed from rest": cube(top=SPACE["top"], floor=floor(friction=PUSHING)),
    "pushed and pulled": cube(top=SPACE["top"], pull=SPACE["pull"], floor=floor(friction=PUSHING)),
}


def lowest_nearby(problem: Problem, u: Array) -> float:
    """The least energy found within 1e-2 of the displacement's size, less that at u, relative to it."""
    size, d = 1e-2 * float(np.abs(u).max()), u.shape[1]
    low, high = np.full(u.shape, -1.0), np.full(u.shape, 1.0)
    for bound in problem.bounds:
        axis = int(np.argmax(np.abs(bound.normal)))
        ends = np.sort(bound.normal[axis] * np.array([bound.lower, bound.upper]))
        room = (ends - u[bound.vertex, axis]) / size
        low[bound.vertex, axis] = np.clip(room[0], low[bound.vertex, axis], 0.0)
        high[bound.vertex, axis] = np.clip(room[1], 0.0, high[bound.vertex, axis])
    low.ravel()[problem.fixed] = high.ravel()[problem.fixed] = 0.0
    start, random = problem.energy(u), np.random.default_rng(0)

    def energy(z: Array) -> float:
        step = np.clip(z, low.ravel(), high.ravel()).reshape(-1, d)
        return (problem.energy(u + size * step) - start) / abs(start)

    sparse = random.standard_normal((150, u.size)) * (random.random((150, u.size)) < 0.2)
    directions = np.vstack([np.eye(u.size), curved(energy, np.flatnonzero((low < high).ravel()), u.size), sparse])
    return min(energy(sign * length * v) for v in directions for sign in (-1, 1) for length in (1.0, 0.1))


def curved(energy: Callable[[Array], float], free: npt.NDArray[np.intp], n: int) -> Array:
    """The eigenvectors of the energy's second differences: among them the directions of negative curvature."""
    steps = 0.1 * np.eye(n)[free]
    single = [energy(v) for v in steps]
    hessian = np.array(
        [
            [energy(v + w) - a - b for w, b in zip(steps, single, strict=True)]
            for v, a in zip(steps, single, strict=True)
        ]
    )
    vectors = np.linalg.eigh(hessian + hessian.T)[1]
    return np.asarray(vectors.T @ np.eye(n)[free])


def sampled(table: Table, found: Solution) -> float:
    """The same for a solution of the program."""
    mesh = block(table["domain"]["size"], table["domain"]["cells"])
    distance = np.linalg.norm(mesh.points[:, None] - points(found)[None], axis=2)
    assert np.max(np.min(distance, axis=1)) < 1e-12
    return lowest_nearby(assemble(table, mesh), displacement(found)[np.argmin(distance, axis=1)])


@pytest.mark.parametrize("table", [*ON_BOUNDS.values(), *IN_CORNERS.values()], ids=[*ON_BOUNDS, *IN_CORNERS])
def test_a_drop_spoils_no_minimum_where_a_bound_or_a_kink_covers_it(table: Table) -> None:
    found = solved(table)
    assert found.exit_code == 0, found.reason
    assert found.examination is not None
    assert sampled(table, found) > -1e-9
    assert found.examination.certificate.second_order == "local minimiser"


@pytest.mark.long
@pytest.mark.parametrize("name", IN_SPACE)
def test_a_law_that_pushes_is_judged_across_the_slip(name: str) -> None:
    """Its force turns with the slip: j'/|u_t| is negative, however straight the law."""
    found, short = solved(IN_SPACE[name]), solved(IN_SPACE[name] | {"solver": {"second_order": False}})
    assert found.examination is not None
    assert short.examination is not None
    minimal = sampled(IN_SPACE[name], found) > -1e-9
    assert found.examination.certificate.second_order == ("local minimiser" if minimal else "not a minimiser")
    assert short.examination.certificate.second_order == "undecided"


def test_a_falling_law_is_decided_by_default_on_a_small_mesh() -> None:
    """The strip that is peeled, with 2,114 unknowns; where the factorisation would take long it is left open."""
    scene = hvi.read_scene(ROOT / "demos/peeling.toml", ["solver.degree=1"])
    found = hvi.solve(scene, estimate=False)
    assert found.certificate is not None
    assert found.certificate.second_order == "local minimiser"
    again = hvi.solve(scene, estimate=False, thresholds=replace(DEFAULT, largest_direct=(2_000, 2_000)))
    assert again.certificate is not None
    assert again.certificate.second_order == "undecided"
